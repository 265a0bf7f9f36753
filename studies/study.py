"""Shared part of all studies' commands: options, results, files and printing.

A study is a folder with a module ``command.py`` that defines ``STUDY``.
"""

import argparse
import datetime
import inspect
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.commands.options import change_by_name, check_bounds, refuse_changes
from affordance.files.atomic import write_json
from affordance.plant.arm import ARM
from affordance.reporting.figures import save_figure
from affordance.reporting.report import write_report, write_section
from affordance.reporting.section import Section
from affordance.runs.repeats import compute_key, list_versions, prepare_folder, run_repeats
from affordance.settings import Settings
from affordance.version import find_commit


class Findings(NamedTuple):
    """Findings of a study.

    Attributes:
        numbers: Content of metrics.json. Versions, commit and date of the run are added; ``versions`` may contain
            those of further libraries.
        section: Section of the report; None for a study that writes numbers only.
        figures: Functions that draw figures, by file name without suffix.
        writers: Functions that write further files into the study's folder.
    """

    numbers: Mapping[str, Any]
    section: Section | None = None
    figures: Mapping[str, Callable[[], Figure]] = {}
    writers: tuple[Callable[[Path], None], ...] = ()


# Function that runs a study in its folder and yields findings; each yield replaces the previous one.
type Work = Callable[[Path], Iterable[Findings]]


class Task(NamedTuple):
    """Task without findings, such as printing a table."""

    run: Callable[[], int]  # function that does the task, prints the result, and returns the exit status


@dataclass(frozen=True)
class Study:
    """Study with its command."""

    HELP: str  # one line of help, as for every command
    add_arguments: Callable[[argparse.ArgumentParser], None]  # function that adds the options to a parser
    # Function that checks the arguments, reads all files, and returns the work to be done. Nothing is written before
    # it returns.
    plan: Callable[[argparse.Namespace], Work | Task]
    # Folder of the results inside ``--out``; empty for ``--out`` itself, None for the study's name.
    folder: str | None = None
    # Settings, or groups of settings, that the study does not use, each with the reason.
    refused: Mapping[tuple[str, ...], str] = field(default_factory=dict)
    on_one_thread: bool = False  # True if the process runs on one thread, like the processes of repeats

    def check(self, arguments: argparse.Namespace) -> None:
        """Checks the options that all studies share.

        Raises:
            BadValueError: An option is out of bounds, or changes a setting that the study does not use.
        """
        check_bounds(arguments)
        for names, why in self.refused.items():
            refuse_changes(arguments, names, why)

    def run(self, arguments: argparse.Namespace) -> int:
        """Runs the study, writes its findings and prints their path.

        Returns the exit status.

        Raises:
            AffordanceError: An argument or a file is invalid.
        """
        if self.on_one_thread and "OMP_NUM_THREADS" not in os.environ:  # has an effect only before NumPy is loaded
            os.environ["OMP_NUM_THREADS"] = "1"
            os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
        self.check(arguments)
        find_commit()  # cached now, so that it is the commit that runs, not one checked out meanwhile
        work = self.plan(arguments)
        if isinstance(work, Task):
            return work.run()
        name = Path(inspect.getfile(self.plan)).parent.name if self.folder is None else self.folder
        folder = prepare_folder(arguments.out) / name
        section, written = None, None
        for findings in work(folder):
            section, written = findings.section, write_findings(findings, folder)
        if section is not None:
            print_section(section)
        if written is not None:
            print(f"The {'numbers' if section is None else 'report'}: {written}")
        return 0


def add_only(parser: argparse.ArgumentParser, names: Iterable[str], what: str) -> None:
    """Adds ``--only``, which selects parts of a study by name."""
    names = tuple(names)
    help_ = f"only these {what}, of {', '.join(names)} (default: all)"
    parser.add_argument("--only", nargs="+", choices=names, default=[], metavar="NAME", help=help_)


def read_settings(arguments: argparse.Namespace) -> Settings:
    """Returns the settings of ``--set`` with the arm of ``--models``.

    Raises:
        BadValueError: A setting is unknown, or its value has the wrong type or is out of bounds.
    """
    return change_by_name(arguments, Settings(arm=arguments.models / ARM.name))


def run_kept[C](
    config: C,
    run_repeat: Callable[[C, int], Mapping[str, NDArray[Any]]],
    folder: Path,
    models: Path | Sequence[Path],
    *,
    repeats: int,
    jobs: int,
    description: str,
) -> dict[str, NDArray[Any]]:
    """Runs the missing repeats of a configuration in several processes.

    A stored repeat is valid as long as its configuration, the models, and the sources of all studies are unchanged
    (one study may use another's sources).

    Args:
        config: Configuration, a dataclass.
        run_repeat: Picklable function of the configuration and the number of a repeat, which returns arrays by name.
        folder: Folder of the study.
        models: Folder of models, or the files that are read.
        repeats: Number of repeats.
        jobs: Number of processes.
        description: Label of the progress bar.

    Returns:
        Arrays, stacked over repeats along the first axis.
    """
    key = compute_key(config, models, run_repeat)
    run = partial(run_repeat, config)
    return run_repeats(folder / "repeats" / key, run, repeats=repeats, jobs=jobs, description=description)


def write_findings(findings: Findings, folder: Path) -> Path:
    """Writes a study's findings, and the common report if they have a section.

    Returns:
        Path of the report, or of metrics.json if there is no section.
    """
    for name, draw in findings.figures.items():
        save_figure(draw(), folder, name)
    for write in findings.writers:
        write(folder)
    if findings.section is not None:
        write_section(folder, findings.section)
    metrics = folder / "metrics.json"
    versions = {**list_versions(), **findings.numbers.get("versions", {})}
    run = {"versions": versions, "commit": find_commit(), "finished": f"{datetime.date.today():%Y-%m-%d}"}
    write_json(metrics, {**findings.numbers, **run})  # last: it marks a complete run
    return metrics if findings.section is None else write_report(folder.parent)


def print_section(section: Section) -> None:
    """Prints a study's claims with results, and its text."""
    for claim in section.claims:
        found = "; ".join(f"{each.name} {each.value}, {each.bound}" for each in claim.criteria)
        print(f"{'met    ' if claim.met else 'not met'} {claim.text} {found}")
    for paragraph in (section.summary, *section.remarks):
        print(paragraph)


def format_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Formats rows of texts as a Markdown table."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, ["---"] * len(header), *rows))
