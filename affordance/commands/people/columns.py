"""Option that gives the names of columns in the user's table."""

import argparse
from collections.abc import Sequence

from affordance.exceptions import BadValueError


def add_columns(parser: argparse.ArgumentParser, columns: Sequence[str]) -> None:
    """Adds ``--columns``."""
    what = "columns that have another name in your table, for example object=stim participant=subj; ours are "
    parser.add_argument("--columns", nargs="+", default=[], metavar="OURS=THEIRS", help=f"{what}{', '.join(columns)}")


def read_columns(arguments: argparse.Namespace) -> dict[str, str]:
    """Reads the names of columns in the user's table, by this program's names."""
    return dict(map(_split, arguments.columns))


def _split(word: str) -> tuple[str, str]:
    ours, _, theirs = word.partition("=")
    if not (ours and theirs):
        raise BadValueError("--columns", "", f"is {word!r}, must be OURS=THEIRS, for example object=stim")
    return ours, theirs
