"""`affordance study people`: Linear+ and Linear++ with every learner, beside people."""

import argparse
from pathlib import Path

import joblib

from affordance.commands.run import check_bounds
from affordance.experiments.people import results
from affordance.experiments.people.linear_plus import GROUPS
from affordance.files.model_folder import MODELS
from affordance.runs.repeats import prepare_folder

HELP = "lift families of objects with an odd member, as people did; every learner beside their published numbers"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--repeats", type=int, default=50, help="simulated observers of each learner (default 50)")
    parser.add_argument("--seed", type=int, default=0, help="root of every random draw (default 0)")
    parser.add_argument("--jobs", type=int, default=joblib.cpu_count(), help="processes (default: one a core)")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results (default results/)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder with people/, the published values")


def run(arguments: argparse.Namespace) -> int:
    """Runs both groups and prints what they found.

    Raises:
        BadValueError: An option is out of bounds, or a file with people's values is wrong.
    """
    check_bounds(arguments)
    folder = prepare_folder(arguments.out)
    for group in GROUPS:
        config = results.PeopleConfig(group, arguments.models, arguments.seed)
        numbers = results.run(config, folder / group.name, repeats=arguments.repeats, jobs=arguments.jobs)
        print(f"{group.title}, {arguments.repeats} observers, {numbers['wall_s']:.0f} s")
        rows = {**numbers["learners"], "people": numbers["people"]}
        for name, row in rows.items():
            cells = (
                f"{measure} {row[measure]:6.2f} [{row[f'{measure}_ci95'][0]:.2f}, {row[f'{measure}_ci95'][1]:.2f}]"
                for measure in results.MEASURES
            )
            print(f"    {name:12s} " + "   ".join(cells))
    return 0
