"""`affordance study people`: compares every learner with human data on Linear+ and Linear++."""

import argparse

from affordance.commands.options import (
    add_jobs,
    add_models,
    add_out,
    add_repeats,
    add_seed,
    add_set,
    change_by_name,
    check_bounds,
    refuse_changes,
)
from affordance.experiments.people import results
from affordance.experiments.people.linear_plus import GROUPS
from affordance.runs.repeats import prepare_folder
from affordance.simulation.static_lifts import check_closed_form

HELP = "lift families of objects with an odd member, as people did; every learner beside their published numbers"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 50, "simulated observers of each learner")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)
    add_models(parser, "people/, the published values")
    add_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Runs both groups and prints their results.

    Raises:
        BadValueError: An option is out of bounds, or a file with human data is invalid.
    """
    check_bounds(arguments)
    refuse_changes(arguments, ["learner"], "every learner is simulated")
    settings = change_by_name(arguments)
    check_closed_form(settings)
    folder = prepare_folder(arguments.out)
    for group in GROUPS:
        config = results.PeopleConfig(group, arguments.models, arguments.seed, settings)
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
