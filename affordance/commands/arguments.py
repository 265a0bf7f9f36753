"""Declares the arguments of commands, separately from the code of the commands.

No slow library is imported, so that ``affordance COMMAND --help`` is fast. This module declares the arguments of the
commands in this folder, and options that several commands share. Each subfolder has a module of the same name.
``options.py`` checks and reads shared options.
"""

import argparse
from pathlib import Path

from affordance.commands.catalogue import DEFAULT_LEARNER, EXPERIMENTS, LEARNER_NAMES, OF_THE_PAPER
from affordance.commands.parser import OUTPUT, ROBOT, find_group
from affordance.files.model_folder import MODELS


def add_repeats(parser: argparse.ArgumentParser, default: int | None, what: str) -> None:
    """Adds ``--repeats``. Its help is ``what``, a description of the repeats."""
    shown = what if default is None else f"{what} (default {default})"
    parser.add_argument("--repeats", type=int, default=default, metavar="N", help=shown)


def add_seed(parser: argparse.ArgumentParser, default: int = 0) -> None:
    """Adds ``--seed``."""
    help_ = f"seed of all random draws (default {default})"
    parser.add_argument("--seed", type=int, default=default, metavar="N", help=help_)


def add_jobs(parser: argparse.ArgumentParser, default: int | None = None) -> None:
    """Adds ``--jobs``. The default is one process per core, which ``check_bounds`` counts."""
    shown = "one per core" if default is None else str(default)
    parser.add_argument(
        "--jobs", type=int, default=default, metavar="N", help=f"parallel processes (default: {shown})"
    )


def add_out(parser: argparse.ArgumentParser, default: str = "results", holds: str = "folder for the results") -> None:
    """Adds ``--out``."""
    help_ = f"{holds} (default {default}/)"
    find_group(parser, OUTPUT).add_argument("--out", type=Path, default=Path(default), metavar="DIR", help=help_)


def add_models(parser: argparse.ArgumentParser, holds: str = "arm, materials and tools to use") -> None:
    """Adds ``--models``."""
    parser.add_argument("--models", type=Path, default=MODELS, metavar="DIR", help=f"folder with {holds}")


def add_robot(parser: argparse.ArgumentParser) -> None:
    """Adds ``--robot`` and ``--tip``."""
    group = find_group(parser, ROBOT)
    help_ = "folder written by import-arm, or a robot's file, which is imported once (default: the paper's arm)"
    group.add_argument("--robot", type=Path, metavar="PATH", help=help_)
    what = "link or frame of the robot's file that holds objects (default: the end of the longest limb)"
    group.add_argument("--tip", help=what)


def add_memory(parser: argparse.ArgumentParser) -> None:
    """Adds ``--memory`` to a command that simulates one observer."""
    what = "lasting memory (SQLite file): the observer starts with it, and every trial is added"
    parser.add_argument("--memory", default="", metavar="MEMORY", help=what)


def add_set(
    parser: argparse.ArgumentParser,
    what: str = "change a setting, for example prior.sd=8000; may be repeated; docs/assumptions.md lists all",
) -> None:
    """Adds ``--set``, which changes settings by name."""
    parser.add_argument("--set", action="append", default=[], dest="changes", metavar="NAME=VALUE", help=what)


def add_learner(parser: argparse.ArgumentParser) -> None:
    """Adds ``--learner``, which ``options.read_changes`` reads."""
    what = f"{', '.join(LEARNER_NAMES)}, or your own as FILE.py:CLASS, whose code is run (default {DEFAULT_LEARNER})"
    parser.add_argument("--learner", metavar="LEARNER", help=what)


def add_prior_set(parser: argparse.ArgumentParser) -> None:
    """Adds ``--set`` for commands that use only the prior's settings, which ``options.read_prior`` reads."""
    add_set(parser, "change a setting of the prior, for example prior.sd=8000; may be repeated")


def add_answer(parser: argparse.ArgumentParser, files: str) -> None:
    """Adds ``--json`` and ``--out``, a folder for the given files; see ``answers.give_answer``."""
    add_json(parser)
    what = f"folder for {files} (default: no files)"
    find_group(parser, OUTPUT).add_argument("--out", type=Path, metavar="DIR", help=what)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Adds ``--json``; see ``answers.print_answer``."""
    find_group(parser, OUTPUT).add_argument("--json", action="store_true", help="print the answer as JSON")


def add_run_options(
    parser: argparse.ArgumentParser,
    repeats: int | None,
    what: str,
    *,
    seed: int = 0,
    jobs: int | None = None,
    models: str = "arm, materials and tools to use",
) -> None:
    """Adds the options of commands that simulate observers: repeats, seed, jobs, results, models and settings.

    If ``models`` is empty, ``--robot`` replaces ``--models``.
    """
    add_repeats(parser, repeats, what)
    add_seed(parser, seed)
    add_jobs(parser, jobs)
    add_out(parser)
    if models:
        add_models(parser, models)
    else:
        add_robot(parser)
    add_set(parser)


def declare_run(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``run``."""
    add = parser.add_argument
    others = ", ".join(name for name in EXPERIMENTS if name not in OF_THE_PAPER)
    what = f"{', '.join(OF_THE_PAPER)}, or all of these (default); {others}; or a Python file"
    add("experiment", nargs="?", default="all", help=what)
    what = (
        "number of observers, or of objects for vision (default: 200; from linear_plus on 40 to 50 of each learner)"
    )
    add_run_options(parser, None, what, models="")
    add_learner(parser)
    what = "simulate a fault named in the models' faults.yaml; may be repeated"
    add("--fault", action="append", default=[], metavar="NAME", help=what)
    what = "use true features of objects (features, default), or detect them in pictures (pixels)"
    add("--vision", choices=["features", "pixels"], default="features", help=what)
    add_memory(parser)
    add_json(parser)


def declare_film(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``film``."""
    parser.add_argument("experiment", help=f"one of {', '.join(OF_THE_PAPER)}")
    parser.add_argument("file", type=Path, help="film to write: .gif, or .webm or .mp4 (these need imageio-ffmpeg)")
    parser.add_argument(
        "--seconds",
        type=float,
        default=60.0,
        metavar="S",
        help="length of the experiment that is shown, s (default: all)",
    )
    parser.add_argument(
        "--slower", type=float, default=1.0, metavar="TIMES", help="factor by which it is slowed down (default 1)"
    )
    add_robot(parser)
    add_seed(parser)
    add_set(parser)
    add_learner(parser)


def declare_study(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``study``."""
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def declare_tutorials(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``tutorials``."""
    add_out(parser, "tutorials", "folder for the tutorials")
    parser.add_argument("--copy-only", action="store_true", help="do not open Jupyter")


def declare_doctor(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``doctor``."""
    parser.add_argument("--install", action="store_true", help="first install missing system libraries")
    parser.add_argument("--tests", action="store_true", help="also check libraries that only tests need")
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")
