"""``affordance memory``: shows, forgets, merges, exports, imports and verifies what robots have felt."""

import argparse
import importlib
from pathlib import Path

ACTIONS = ("show", "forget", "merge", "export", "import", "verify")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("action", choices=ACTIONS, help="what to do; forget needs one of the options that select trials")
    add("memory", metavar="MEMORY", help="SQLite file, or URL of a database")
    add("files", nargs="*", metavar="FILE", help="memories to merge, file to export to, or files to import")
    add("--robot", default="", metavar="NAME", help="trials of this robot")
    add("--object", default="", metavar="NAME", help="trials with objects of this name")
    add(
        "--since", default="", metavar="TIME", help="trials from this time on, as 2026-03-01 or 2026-03-01T12:00, UTC"
    )
    add("--until", default="", metavar="TIME", help="trials before this time")
    add("--trial", default="", metavar="ID", help="the trial whose id begins so, four digits at least")
    add("--same-colour", action="append", default=[], metavar="A=B", help="colours that show counts as one")
    add("--materials", type=Path, metavar="FILE", help="materials whose names are shown (default: ours)")
    add("--out", type=Path, metavar="DIR", help="folder for the picture of show (default: none)")
    add("--json", action="store_true", help="print what is shown as JSON")
    add(
        "--set",
        action="append",
        default=[],
        dest="changes",
        metavar="NAME=VALUE",
        help="a setting of the prior, as prior.sd=8000; more than once",
    )


def run(arguments: argparse.Namespace) -> int:
    """Does what is asked; returns the exit status, 3 if verifying found faults."""
    # Imported on demand: it takes a second, for which --help need not wait.
    status: int = importlib.import_module("affordance.commands.manage_memory").run(arguments)
    return status
