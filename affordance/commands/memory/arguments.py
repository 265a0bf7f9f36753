"""Arguments of the commands for memories."""

import argparse
from pathlib import Path

from affordance.commands.arguments import add_answer, add_prior_set

_ACTIONS = ("show", "forget", "merge", "export", "import", "weigh", "join", "verify")


def declare_memory(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``memory``."""
    add = parser.add_argument
    add("action", choices=_ACTIONS, help="what to do; forget requires options that select trials")
    add("memory", metavar="MEMORY", help="SQLite file of the memory")
    what = "memories to merge, file to export to, files to import, tools files or objects' URDFs with weighings, "
    what += "or colours to join: "
    what += "'#b5a642=#c0b050' treats the second, from another camera, as the first; no colours separate all again"
    add("files", nargs="*", metavar="FILE", help=what)
    add("--robot", default="", metavar="NAME", help="select trials of this robot")
    add("--object", default="", metavar="NAME", help="select trials with objects of this name")
    what = "select trials from this time on, UTC: 2026-03-01 or 2026-03-01T12:00"
    add("--since", default="", metavar="TIME", help=what)
    add("--until", default="", metavar="TIME", help="select trials before this time")
    add("--trial", default="", metavar="ID", help="select the trial whose id begins with these digits, at least four")
    what = "materials whose names are shown (default: those of the package)"
    add("--materials", type=Path, metavar="FILE", help=what)
    add_answer(parser, "the figure and the table of show")
    add_prior_set(parser)
