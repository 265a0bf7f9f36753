"""Arguments of the commands for advice, and options that these commands share."""

import argparse
from pathlib import Path

from affordance.commands.arguments import add_answer, add_learner, add_robot, add_seed, add_set
from affordance.commands.parser import OneLineParser
from affordance.files.model_folder import MODELS


def _add_choice(parser: argparse.ArgumentParser, files: str, *, samples: int) -> None:
    """Adds the options of commands that choose tools: tools, knowledge about materials, criterion and robot."""
    add = parser.add_argument
    what = "file of a task, instead of a task of the robot; next takes several, in addition to tasks of the robot"
    add("--task", action="append", default=[], type=Path, dest="files", metavar="FILE", help=what)
    what = "source of the tools' shapes: their drawings, or rendered pictures"
    add("--see", choices=("drawing", "pictures"), default="drawing", help=what)
    add(
        "--by",
        choices=("work", "effort", "margin", "grip"),
        help="criterion: expected work, effort, largest fraction of an effort limit, or wrench at the grip "
        "(default: work for the paper's arm, grip for other arms and for holding still)",
    )
    add("--max-grip-force", type=float, metavar="N", help="largest force that the gripper can hold, N (default: any)")
    what = "largest moment that the gripper can hold, N m (default: any)"
    add("--max-grip-moment", type=float, metavar="NM", help=what)
    what = f"number of samples of the belief (default {samples})"
    add("--samples", type=int, default=samples, metavar="N", help=what)
    tools = MODELS / "workshop" / "tools.yaml"
    what = "tools file with grips, or an object's URDF (default: tools of the package)"
    add("--tools", type=Path, default=tools, metavar="FILE", help=what)
    add("--only", action="append", default=[], metavar="NAME", help="only the tool of this name; may be repeated")
    _add_knowledge(parser)
    add_answer(parser, f"{files}.json, .txt, .png and .svg")
    add_robot(parser)
    add_seed(parser)
    add_set(parser)
    add_learner(parser)


def _add_knowledge(parser: argparse.ArgumentParser) -> None:
    """Adds the options for knowledge about materials: a materials file, handbook densities and a memory."""
    add = parser.add_argument
    add("--materials", type=Path, metavar="FILE", help="materials (default: the robot's)")
    what = "materials whose handbook density is known: NAME,NAME,... or nothing (default: all in the tools file)"
    add("--know", metavar="NAMES", help=what)
    add("--memory", metavar="MEMORY", help="lasting memory of materials, an SQLite file (default: none)")


def declare_guess(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``guess``."""
    add = parser.add_argument
    add("tools", type=Path, help="tools file, which needs no grips, or an object's URDF")
    _add_knowledge(parser)
    add_answer(parser, "guess.json and .txt")
    add_robot(parser)
    add_set(parser)


def declare_rank(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``rank``."""
    if isinstance(parser, OneLineParser):
        parser.hint = "rank compares tools for one task; affordance next takes several"
    add = parser.add_argument
    add("task", nargs="?", help="task of the robot: hammer, reach, mash, carry or hold")
    what = "rank the package's hammers after learning from its simulated recordings"
    add("--demo", action="store_true", help=what)
    what = "instead of tools, a mass in the hand (kg); prints how much of each joint's effort limit remains"
    add("--payload", type=float, metavar="KG", help=what)
    what = "centre of mass of that mass in the hand's frame (m; default 0 0 0)"
    add("--payload-at", type=float, nargs=3, default=(0.0, 0.0, 0.0), metavar=("X", "Y", "Z"), help=what)
    _add_choice(parser, "ranking", samples=10_000)


def declare_next(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``next``."""
    add = parser.add_argument
    what = "tasks that the robot will do: hammer, reach, mash, carry, hold"
    add("tasks", nargs="*", metavar="TASK", help=what)
    what = "objects that may be held first (default: the pieces of stock of the package)"
    add("--may-hold", type=Path, default=MODELS / "workshop" / "blanks.yaml", metavar="FILE", help=what)
    add("--include-tools", action="store_true", help="the tools themselves may be held too")
    what = "price of one hold, in the unit of the cost of doing each task once (default 0)"
    add("--price", type=float, default=0.0, metavar="COST", help=what)
    _add_choice(parser, "next", samples=4000)


def declare_new_tools(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``new-tools``."""
    parser.add_argument("file", type=Path, help="file to write, for example my_tools.yaml; it must not exist yet")
