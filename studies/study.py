"""Harness of studies: their commands check, keep, write and print in one place.

A study is a folder with a module ``command.py`` that defines ``STUDY``.
"""

import argparse
import datetime
import importlib
import inspect
import itertools
import json
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
from affordance.exceptions import UnavailableError
from affordance.files.atomic import quarantine, write_json
from affordance.plant.arm import ARM
from affordance.reporting.figures import save_figure
from affordance.reporting.report import write_report, write_section
from affordance.reporting.section import Section
from affordance.runs.commit import find_commit
from affordance.runs.repeats import compute_key, list_versions, prepare_folder, run_repeats
from affordance.settings import Settings


class Findings(NamedTuple):
    """Findings of a study.

    Attributes:
        numbers: Content of metrics.json. Versions, commit and date of the run are added to it; ``versions`` may name
            those of further libraries.
        section: Section of the report; None for a study that writes numbers alone.
        figures: Functions that draw figures, by name of the file without suffix.
        details: Content of details.json, further numbers that explain; None for no file.
        writers: Functions that write further files into the study's folder.
    """

    numbers: Mapping[str, Any]
    section: Section | None = None
    figures: Mapping[str, Callable[[], Figure]] = {}
    details: Mapping[str, Any] | None = None
    writers: tuple[Callable[[Path], None], ...] = ()


# Function that runs a study in its folder, and yields findings, each of which replaces those before.
type Work = Callable[[Path], Iterable[Findings]]


class Task(NamedTuple):
    """Task of which the harness writes no findings, such as a table that an option asks for."""

    run: Callable[[], int]  # function that does the task, prints what it finds, and returns the exit status


@dataclass(frozen=True)
class Study:
    """Study, which is a command."""

    HELP: str  # line of help, as of all commands
    add_arguments: Callable[[argparse.ArgumentParser], None]  # function that adds the options to a parser
    # Function that checks the arguments and reads all files, and returns what is to be run; nothing is written
    # before it returns.
    plan: Callable[[argparse.Namespace], Work | Task]
    # Folder of the results in that of ``--out``, empty for that folder itself; None for the study's name.
    folder: str | None = None
    # Reasons by settings, or groups of settings, that the study does not use.
    refused: Mapping[tuple[str, ...], str] = field(default_factory=dict)
    on_one_thread: bool = False  # true if the study's process is to have one thread, as processes of repeats have

    def check(self, arguments: argparse.Namespace) -> None:
        """Checks the options that studies share.

        One that is out of bounds, or changes a setting that the study does not use, raises a BadValueError.
        """
        check_bounds(arguments)
        for names, why in self.refused.items():
            refuse_changes(arguments, names, why)

    def run(self, arguments: argparse.Namespace) -> int:
        """Runs the study, writes its findings and prints the path; returns the exit status.

        An argument or a file that is invalid raises an AffordanceError.
        """
        if self.on_one_thread and "OMP_NUM_THREADS" not in os.environ:  # it must be set before NumPy is loaded
            os.environ["OMP_NUM_THREADS"] = "1"
            os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
        self.check(arguments)
        find_commit()  # kept: of what runs, not of what may lie there when it ends
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
    """Adds ``--only``, which selects parts of a study by their names."""
    names = tuple(names)
    help_ = f"only these {what}, of {', '.join(names)} (default: all)"
    parser.add_argument("--only", nargs="+", choices=names, default=[], metavar="NAME", help=help_)


def import_part(module: str, extra: str = "dev") -> Any:
    """Imports a module that needs libraries of an extra; raises an UnavailableError without them."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise UnavailableError(f"{module} is", f"pip install '.[{extra}]' installs {error.name}") from error


def read_settings(arguments: argparse.Namespace) -> Settings:
    """Returns the settings of ``--set``, with the arm of ``--models``.

    A setting that is unknown, or a value of the wrong kind or out of bounds, raises a BadValueError.
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
    """Runs the repeats of a configuration, a dataclass, that the study's folder lacks, in processes.

    The function must be picklable; sources of all studies count, as one may use another's, and so do the files that
    are read, or a folder of models.

    Returns: Arrays, stacked over repeats along the first axis.
    """
    key = compute_key(config, models, Path(__file__).parent)
    run = partial(run_repeat, config)
    return run_repeats(folder / "repeats" / key, run, repeats=repeats, jobs=jobs, description=description)


def read_kept(path: Path, keys: Iterable[str]) -> dict[str, Any] | None:
    """Reads a mapping of some keys that a study kept; None if there is none. A damaged file is quarantined."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(content, dict):
            raise ValueError("it is no mapping")
        if missing := [key for key in keys if key not in content]:
            raise ValueError(f"it has no {missing[0]}")
    except FileNotFoundError:
        return None
    except (ValueError, RecursionError) as error:
        quarantine(path, f"is not what a study found ({error})")
        return None
    return content


def keep_result(path: Path, key: str, compute: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
    """Returns the result that a file keeps under a key; computes it, and keeps it, if there is none."""
    kept = read_kept(path, ["key"])
    if kept is None or kept["key"] != key:
        kept = {"key": key, **compute()}
        write_json(path, kept)
    return kept


def write_findings(findings: Findings, folder: Path) -> Path:
    """Writes the findings of a study; if they have a section, also the report of all in the folder of results.

    Returns: Path of the report, or of metrics.json.
    """
    for name, draw in findings.figures.items():
        save_figure(draw(), folder, name)
    for write in findings.writers:
        write(folder)
    if findings.details is not None:
        write_json(folder / "details.json", findings.details)
    if findings.section is not None:
        write_section(folder, findings.section)
    metrics = folder / "metrics.json"
    versions = {**list_versions(), **findings.numbers.get("versions", {})}
    run = {"versions": versions, "commit": find_commit(), "finished": f"{datetime.date.today():%Y-%m-%d}"}
    write_json(metrics, {**findings.numbers, **run})  # last: it marks a complete run
    return metrics if findings.section is None else write_report(folder.parent)


def print_section(section: Section) -> None:
    """Prints the claims of a study, each with what was found, and its prose."""
    for claim in section.claims:
        found = "; ".join(f"{each.name} {each.value}, {each.bound}" for each in claim.criteria)
        print(f"{'met    ' if claim.met else 'not met'} {claim.text} {found}")
    for paragraph in (section.summary, *section.remarks):
        print(paragraph)


def format_row(row: Sequence[str]) -> str:
    """Lays out one row of text in Markdown."""
    return "| " + " | ".join(row) + " |"


def format_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lays out rows of text as a Markdown table."""
    return "\n".join(format_row(row) for row in (header, ["---"] * len(header), *rows))


def print_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Prints a Markdown table row by row, as the rows are computed; returns it."""
    lines = []
    for line in itertools.chain(format_table(header, ()).splitlines(), map(format_row, rows)):
        print(line, flush=True)
        lines.append(line)
    print()
    return "\n".join(lines)
