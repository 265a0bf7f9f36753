"""Common functions of all studies: options, cached repeats, result files and printing.

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
        numbers: Content of metrics.json, to which versions, commit and date are added. ``versions`` can contain
            versions of further libraries.
        section: Section of the report; None for no report.
        figures: Functions that draw figures, by file name without suffix.
        writers: Functions that write further files to the folder of the study.
    """

    numbers: Mapping[str, Any]
    section: Section | None = None
    figures: Mapping[str, Callable[[], Figure]] = {}
    writers: tuple[Callable[[Path], None], ...] = ()


# Function that runs a study in its folder. Later findings replace earlier findings.
type Work = Callable[[Path], Iterable[Findings]]


class Task(NamedTuple):
    """Task without findings, such as printing a table."""

    run: Callable[[], int]  # function that prints results and returns the exit status


@dataclass(frozen=True)
class Study:
    """Study with its command."""

    HELP: str  # one line of help
    add_arguments: Callable[[argparse.ArgumentParser], None]  # function that adds options to a parser
    # Function that checks arguments, reads all files, and returns the work. It does not write any files.
    plan: Callable[[argparse.Namespace], Work | Task]
    # Results folder inside ``--out``; empty for ``--out`` itself, None for the name of the study.
    folder: str | None = None
    # Settings, or groups of settings, that the study does not use, and the reason for each.
    refused: Mapping[tuple[str, ...], str] = field(default_factory=dict)
    on_one_thread: bool = False  # True if the main process uses one thread

    def check(self, arguments: argparse.Namespace) -> None:
        """Checks common options of all studies.

        Raises:
            BadValueError: An option is out of bounds, or changes a setting that the study does not use.
        """
        check_bounds(arguments)
        for names, why in self.refused.items():
            refuse_changes(arguments, names, why)

    def run(self, arguments: argparse.Namespace) -> int:
        """Runs the study, writes its findings, prints their path, and returns the exit status.

        Raises:
            AffordanceError: An argument or a file is invalid.
        """
        if self.on_one_thread and "OMP_NUM_THREADS" not in os.environ:  # effective only before NumPy is imported
            os.environ["OMP_NUM_THREADS"] = "1"
            os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
        self.check(arguments)
        find_commit()  # cached at the start, because another commit can be checked out during the run
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
    """Adds the option ``--only``, which selects parts of a study by name."""
    names = tuple(names)
    help_ = f"only these {what}, of {', '.join(names)} (default: all)"
    parser.add_argument("--only", nargs="+", choices=names, default=[], metavar="NAME", help=help_)


def read_settings(arguments: argparse.Namespace) -> Settings:
    """Reads the settings of ``--set`` and the arm of ``--models``.

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
    """Runs the repeats of a configuration that are not in the cache, in several processes.

    Cached repeats are invalidated if the configuration, the models, or sources of any study change.

    Args:
        config: Configuration, a dataclass.
        run_repeat: Picklable function that returns arrays by name, given the configuration and the number of a
            repeat.
        folder: Folder of the study.
        models: Folder of models, or list of model files.
        repeats: Number of repeats.
        jobs: Number of processes.
        description: Label of the progress bar.

    Returns: Arrays, stacked over repeats along the first axis.
    """
    key = compute_key(config, models, run_repeat)
    run = partial(run_repeat, config)
    return run_repeats(folder / "repeats" / key, run, repeats=repeats, jobs=jobs, description=description)


def write_findings(findings: Findings, folder: Path) -> Path:
    """Writes findings of a study, and the common report if they have a section.

    Returns: Path of the report, or of metrics.json without a section.
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
    write_json(metrics, {**findings.numbers, **run})  # written last, because it marks a complete run
    return metrics if findings.section is None else write_report(folder.parent)


def print_section(section: Section) -> None:
    """Prints the claims of a study with their results, and its text."""
    for claim in section.claims:
        found = "; ".join(f"{each.name} {each.value}, {each.bound}" for each in claim.criteria)
        print(f"{'met    ' if claim.met else 'not met'} {claim.text} {found}")
    for paragraph in (section.summary, *section.remarks):
        print(paragraph)


def format_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Formats rows of strings as a Markdown table."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, ["---"] * len(header), *rows))
