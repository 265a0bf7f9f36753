"""`affordance study learners`: the paper's simulations with each learner, and the decoy of the first lifted again."""

import argparse
from pathlib import Path

import joblib

from affordance.commands.run import check_bounds
from affordance.experiments.learners import results
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.files.model_folder import MODELS
from affordance.runs.repeats import prepare_folder

HELP = "run the paper's simulations with each learner, and lift the decoy of Simulation I again"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--repeats", type=int, default=20, help="simulated observers of each learner (default 20)")
    parser.add_argument("--seed", type=int, default=0, help="root of every random draw (default 0)")
    parser.add_argument("--jobs", type=int, default=joblib.cpu_count(), help="processes (default: one a core)")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results (default results/)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder with arm, materials and tools to use")


def run(arguments: argparse.Namespace) -> int:
    """Runs the study and prints what changes.

    Raises:
        BadValueError: An option is out of bounds, or a file of the models is wrong.
        ModelFileError: The arm cannot be loaded or is not fit.
    """
    check_bounds(arguments)
    folder = prepare_folder(arguments.out) / "learners"
    weight, com = (load_hold_experiment(name, arguments.models, arguments.seed) for name in ("weight", "com"))
    numbers = results.run(weight, com, arguments.models, folder, repeats=arguments.repeats, jobs=arguments.jobs)
    if results.add_to_simulation(numbers, arguments.out / weight.name):
        print(f"{arguments.out / weight.name / 'metrics.json'} has brass_after_decoy too")
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
