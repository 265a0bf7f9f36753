"""`affordance study learners`: runs the paper's simulations with each learner, and lifts the first decoy again."""

import argparse

from affordance.commands.options import add_run_options, change_by_name, check_bounds, refuse_changes
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.plant.arm import ARM
from affordance.runs.repeats import prepare_folder
from affordance.settings import Settings
from studies.learners import results

HELP = "run the paper's simulations with each learner, and lift the decoy of Simulation I again"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_run_options(parser, 20, "simulated observers of each learner")


def run(arguments: argparse.Namespace) -> int:
    """Runs the study and prints the differences between learners.

    Raises:
        BadValueError: An option is out of bounds, or a file of the models is invalid.
        ModelFileError: The arm cannot be loaded or is unsuitable.
    """
    check_bounds(arguments)
    refuse_changes(arguments, ["learner"], "every learner is simulated")
    settings = change_by_name(arguments, Settings(arm=arguments.models / ARM.name))
    weight, com = (
        load_hold_experiment(name, arguments.models, arguments.seed, settings) for name in ("weight", "com")
    )
    folder = prepare_folder(arguments.out) / "learners"
    numbers = results.run(weight, com, arguments.models, folder, repeats=arguments.repeats, jobs=arguments.jobs)
    print(f"{arguments.repeats} observers of each learner, {numbers['wall_s']:.0f} s")
    for name, (one, six) in numbers["brass_after_decoy"].items():
        before, needless = numbers["brass_before_decoy"][name], numbers["needless_kinds"][name]
        heights = ", ".join(f"{100.0 * height:.1f}" for height in numbers["excursion_m"][name])
        print(f"{name}: brass {before:.0f} kg/m^3 before, {one:.0f} after one decoy, {six:.0f} after six")
        print(f"    farthest heights {heights} cm; needless kinds in {100.0 * needless:.1f} % of first lifts")
        honest = numbers["honest"][name]
        for task in ("reach", "hammer"):
            print(f"    right grip to {task}: " + ", ".join(f"{value:.3f}" for value in honest[f"p_correct_{task}"]))
        extremes = ", ".join(f"{100.0 * height:.2f}" for height in honest["height_extreme_m"])
        mass, com, needless = 100.0 * honest["mass_error"], 1000.0 * honest["com_error_m"], honest["needless_kinds"]
        print(f"    mass {mass:.2f} % off, centre of mass {com:.1f} mm")
        print(f"    test pass {extremes} cm; needless kinds in {100.0 * needless:.1f} % of first lifts")
    return 0
