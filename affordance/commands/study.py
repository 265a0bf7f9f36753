"""``affordance study``: lists the studies; each is a separate command in a module study_NAME."""

import argparse
import importlib

STUDIES = ("people", "learners", "arms", "recorded", "tools")
HELP = f"a study that takes its time: {', '.join(STUDIES)}"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds nothing, as the command has no arguments."""


def run(arguments: argparse.Namespace) -> int:
    """Prints the studies, one per line."""
    for name in STUDIES:
        print(f"  affordance study {name:<10} {importlib.import_module(f'affordance.commands.study_{name}').HELP}")
    return 0
