"""``affordance study files``: imports every robot file in a folder, and reports the outcome of each."""

import argparse
import itertools
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import joblib

from affordance.commands.options import add_jobs, add_out
from affordance.exceptions import BadValueError
from affordance.files.atomic import write_text
from affordance.reporting.formatting import format_number
from studies.files.examine import Examined, examine
from studies.study import Findings, Study, Work, format_table

HEADER = ("file", "format", "loads", "options", "parity", "against", "warnings", "rank hammer", "seconds")
_SUFFIXES = (".urdf", ".sdf", ".xml", ".xacro")
# Root elements with which robots' files begin; a file that only defines macros has no link.
_ROOTS = (b"<robot", b"<mujoco", b"<sdf")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("--robots", type=Path, required=True, metavar="FOLDER", help="folder of robot files")
    what = "only files whose path contains one of these"
    parser.add_argument("--containing", nargs="+", default=[], metavar="TEXT", help=what)
    add_jobs(parser, 1)
    add_out(parser)


def list_files(folder: Path, containing: list[str]) -> list[Path]:
    """Lists the robot files in a folder and its subfolders, except those that other files include.

    Raises:
        BadValueError: There are none.
    """
    found = [
        path
        for path in sorted(folder.rglob("*"))
        if path.suffix in _SUFFIXES and path.is_file() and any(root in path.read_bytes() for root in _ROOTS)
    ]
    found = [path for path in found if not containing or any(text in str(path) for text in containing)]
    included = {name for path in found for name in _list_included(path)}
    found = [path for path in found if path.name not in included]
    if not found:
        raise BadValueError("--robots", "", f"is {str(folder)!r}, which has no robot file")
    return found


def _list_included(path: Path) -> list[str]:
    """Lists the names of the files that a template or model includes."""
    words = path.read_text(encoding="utf-8", errors="replace").split('"')
    return [word.rpartition("/")[2] for tag, word in itertools.pairwise(words) if "include" in tag]


def plan(arguments: argparse.Namespace) -> Work:
    """Lists the files."""
    files = list_files(arguments.robots, arguments.containing)
    return partial(_work, arguments.robots, files, arguments.jobs)


def _work(folder: Path, files: list[Path], jobs: int, _: Path) -> Iterator[Findings]:
    """Examines one file after the other, and writes all findings so far after each."""
    found: list[Examined] = []
    tasks = (joblib.delayed(examine)(path, str(path.relative_to(folder))) for path in files)
    for each in joblib.Parallel(n_jobs=jobs, return_as="generator")(tasks):
        found.append(each)
        print(" | ".join(build_row(each)), flush=True)
        yield _conclude(found)


def _conclude(found: list[Examined]) -> Findings:
    loaded = [each for each in found if each.joints]
    compared = [each.parity for each in loaded if each.parity is not None]
    numbers: dict[str, Any] = {
        "files": len(found),
        "loaded": len(loaded),
        "loaded_without_options": sum(1 for each in loaded if not each.options),
        "compared": len(compared),
        "largest_parity": max(compared, default=None),
        "with_warnings": sum(1 for each in loaded if each.warnings),
        "with_advice": sum(1 for each in loaded if each.hammer.startswith("Take ")),
        "rows": [each._asdict() for each in found],
    }
    table = format_table(HEADER, [build_row(each) for each in found]) + "\n"
    return Findings(numbers, writers=(lambda out: write_text(out / "files.md", table),))


def build_row(each: Examined) -> list[str]:
    """Builds the row of a file in the table."""
    loads = f"{each.joints} joints" if each.joints else each.refused
    parity = "" if each.parity is None else f"{each.parity:.0e}"
    seconds = f"{format_number(each.import_s, 2)} + {format_number(each.rank_s, 2)}" if each.joints else ""
    cells = [each.file, each.format, loads, each.options, parity, each.against, "; ".join(each.warnings), each.hammer]
    return [cell.replace("|", "/") for cell in (*cells, seconds)]


STUDY = Study(
    HELP="import every robot file in a folder, and report the outcome", add_arguments=add_arguments, plan=plan
)
