"""``affordance study``: names the studies; each is a command of its own, of the module study_NAME."""

import argparse
import importlib

STUDIES = ("arms", "learners", "people")
HELP = f"a study that takes its time: {', '.join(STUDIES)}"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """None of its own."""


def run(arguments: argparse.Namespace) -> int:
    """Prints the studies, a line each."""
    for name in STUDIES:
        print(f"  affordance study {name:<10} {importlib.import_module(f'affordance.commands.study_{name}').HELP}")
    return 0
