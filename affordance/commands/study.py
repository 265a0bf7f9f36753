"""``affordance study``: lists the studies; each is a command of its own, in a clone of the repository."""

import argparse

from affordance.files.model_folder import import_study

# Modules that define STUDY (studies/study.py).
STUDIES = {
    "robustness": "studies.robustness.command",
    "people": "studies.people.command",
    "learners": "studies.learners.command",
    "arms": "studies.arms.command",
    "loop": "studies.loop.command",
    "active": "studies.active.command",
    "recorded": "studies.recorded.command",
    "tools": "studies.tools.command",
    "hammering": "studies.hammering.command",
    "within_trial": "studies.within_trial.command",
    "side_by_side": "studies.side_by_side.command",
}
# Names that studies had as commands of their own.
FORMER = {"fit-kappa": "people", "robustness": "robustness"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares no arguments."""


def run(arguments: argparse.Namespace) -> int:
    """Prints the studies, one line each."""
    for name, module in STUDIES.items():
        print(f"  affordance study {name:<12} {import_study(module).STUDY.HELP}")
    return 0
