"""``affordance study``: lists the studies; each is a command of its own, in a clone of the repository."""

import argparse

from affordance.files.model_folder import import_study, list_studies

# Names that studies had as commands of their own.
FORMER = {"fit-kappa": "people", "robustness": "robustness"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares no arguments."""


def run(arguments: argparse.Namespace) -> int:
    """Prints the studies, one line each."""
    names = list_studies()
    for name in names:
        print(f"  affordance study {name:<12} {import_study(name).HELP}")
    if not names:
        print("There are no studies here: they need a clone of the repository.")
    return 0
