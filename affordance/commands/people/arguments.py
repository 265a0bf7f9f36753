"""Arguments of the commands for people, and options that these commands share."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from affordance.commands.arguments import (
    add_jobs,
    add_json,
    add_learner,
    add_out,
    add_robot,
    add_run_options,
    add_seed,
    add_set,
)
from affordance.commands.catalogue import COMPARED, LEARNER_NAMES, PREDICTED
from affordance.extensions.people.columns import LIFT_COLUMNS, TRIAL_COLUMNS

# Largest default of ``predict --repeats``, which otherwise is an experiment's own number of observers per learner.
MOST_OBSERVERS = 50


_LEARNERS_HELP = f"{', '.join(LEARNER_NAMES)}, or your own as FILE.py:CLASS, whose code is run"


def _add_columns(parser: argparse.ArgumentParser, columns: Sequence[str]) -> None:
    """Adds ``--columns``."""
    what = "columns that have another name in your table, for example object=stim participant=subj; ours are "
    parser.add_argument("--columns", nargs="+", default=[], metavar="OURS=THEIRS", help=f"{what}{', '.join(columns)}")


def add_table_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options that describe a table of trials."""
    add = parser.add_argument
    add("--objects", type=Path, metavar="FILE", help="tools file with the objects named in the table of trials")
    _add_columns(parser, TRIAL_COLUMNS)
    add("--materials", type=Path, metavar="FILE", help="materials of the objects (default: the robot's)")
    add("--meshes", type=Path, metavar="DIR", help="folder of mesh files (default: folder of the objects file)")


def add_contrast(parser: argparse.ArgumentParser) -> None:
    """Adds ``--contrast``."""
    what = (
        "planned contrast of a table, 'MEASURE: ONE - OTHER [in PLACE, ...]', such as 'force: large - small in test' "
        "(objects, phases or first and last lifts within persons, groups, or a number); may be repeated"
    )
    parser.add_argument("--contrast", action="append", default=[], metavar="CONTRAST", help=what)


def _add_details(parser: argparse.ArgumentParser, what: str) -> None:
    """Adds ``--details``."""
    parser.add_argument("--details", action="store_true", help=what)


def add_fit_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options that ``fit`` and ``compare-learners`` share."""
    add = parser.add_argument
    add("lifts", type=Path, help="table with one row per lift (CSV), like lifts.csv")
    add(
        "--of",
        default="",
        metavar="WHO",
        help="use only lifts with this value in the column learner (default: people)",
    )
    add(
        "--objects",
        type=Path,
        metavar="FILE",
        help="tools file with the objects; a row's mass and looks_like change its object (default: from rows)",
    )
    _add_columns(parser, LIFT_COLUMNS)
    what = "number of draws of the free parameters (default 64; with --group 256)"
    add("--draws", type=int, metavar="D", help=what)
    add("--particles", type=int, default=50, metavar="P", help="number of particles per draw (default 50)")
    add_seed(parser)
    add_jobs(parser)
    add_set(parser)


def declare_predict(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``predict``."""
    add = parser.add_argument
    add("experiment", help=f"one of {', '.join(PREDICTED)}, a Python file, or a table of trials (CSV)")
    what = f"observers of each learner (default: at most {MOST_OBSERVERS}; for a table 1 per participant)"
    add_run_options(parser, None, what, models="")
    add_learner(parser)
    add_json(parser)
    add_table_options(parser)
    add_contrast(parser)
    _add_details(parser, "also print all measures and pairs of learners")
    what = (
        "for a table: between-person standard deviation of force, or of persons' values of each contrast, N "
        "(default: its estimate from people in the table)"
    )
    add("--people-sd", type=float, metavar="N", help=what)
    what = "power of the test, for which the number of people is computed (default 0.9)"
    add("--power", type=float, default=0.9, metavar="P", help=what)


def declare_lift(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``lift``."""
    add = parser.add_argument
    add("--trials", type=Path, required=True, metavar="FILE", help="table with one row per trial (CSV)")
    add_table_options(parser)
    what = f"{', '.join(COMPARED)}, or your own as FILE.py:CLASS, whose code is run; may be repeated (default: all)"
    add("--learner", action="append", default=[], metavar="LEARNER", help=what)
    add_contrast(parser)
    _add_details(parser, "print the table of means also with --contrast")
    add_json(parser)
    add_run_options(parser, 1, "observers of each learner for each participant", models="")


def declare_fit(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``fit``."""
    add = parser.add_argument
    add_fit_options(parser)
    add("--learner", required=True, metavar="LEARNER", help=_LEARNERS_HELP)
    what = "parameters to fit, such as kappa,own_drift (default: push_error and the learner's fitted ones)"
    add("--free", metavar="NAMES", help=what)
    add("--chains", type=int, default=1, metavar="C", help="independent samplers, for r_hat of ArviZ (default 1)")
    add("--pooled", action="store_true", help="fit one value to all participants (default: one value for each)")
    add("--group", default="", metavar="COLUMN", help="column with each participant's group: compare the groups")
    add("--check", action="store_true", help="compare each participant's pushes with simulated ones")
    add("--json", action="store_true", help="print the result as JSON")
    add_out(parser)


def declare_compare_learners(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``compare-learners``."""
    add = parser.add_argument
    add_fit_options(parser)
    what = f"{_LEARNERS_HELP}; may be repeated (default: all built-in learners except kinds_map)"
    add("--learner", action="append", default=[], metavar="LEARNER", help=what)
    add("--check", action="store_true", help="check if each participant's best learner reproduces the pushes")
    add("--json", action="store_true", help="print the result as JSON")
    add_out(parser)


def declare_new_trials(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``new-trials``."""
    add = parser.add_argument
    add("file", type=Path, help="table of trials (CSV): a new one with --block, or one that exists")
    add_table_options(parser)
    what = (
        "block of trials, '[GROUP/]PHASE: [FIRST, ... >] OBJECT[=KG], ... [x CYCLES]', such as 'learn: all x 5'; may "
        "be repeated, in order"
    )
    add("--block", action="append", default=[], metavar="BLOCK", help=what)
    add("--participants", type=int, metavar="N", help="number of participants (default 8)")
    add("--groups", nargs="+", metavar="GROUP", help="groups, to which participants are assigned in turn")
    what = "order of objects in a cycle: Latin square over participants and cycles (default), shuffled, or as given"
    add("--order", choices=["latin", "shuffled", "fixed"], help=what)
    what = "also write the table for these programs, each into a folder next to it"
    add("--for", nargs="+", dest="formats", default=[], choices=["psychopy", "jspsych", "bids"], help=what)
    add_seed(parser)
    add_robot(parser)


def declare_freeze(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``freeze``."""
    add = parser.add_argument
    add("table", type=Path, help="table of trials (CSV); its plan is TABLE.plan.json")
    add_table_options(parser)
    add_contrast(parser)
    add("--claim", action="append", default=[], metavar="TEXT", help="claim in words; may be repeated")
    what = "check that table and objects match the plan (objects: by default the frozen file next to the table)"
    add("--check", action="store_true", help=what)
    add_learner(parser)
    add_set(parser)
    add_robot(parser)


def declare_new_experiment(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``new-experiment``."""
    parser.add_argument("name", help="name of the experiment: letters, digits and '_'")
    what = "folder for the file (default: the current one)"
    parser.add_argument("--out", type=Path, default=Path(), metavar="DIR", help=what)
