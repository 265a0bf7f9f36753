"""``affordance study learners``: runs the paper's simulations with each learner, and lifts the first decoy again."""

import argparse
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from affordance.belief.kind_memory import KAPPA
from affordance.belief.learner import Learner
from affordance.commands.options import add_run_options
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.experiments.shared.presented import PresentationExperiment
from studies.learners import decoy_again, honest_objects
from studies.study import Findings, Study, Work, read_settings

# Index of the observer whose memory is drawn.
_SHOWN = 0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_run_options(parser, 20, "simulated observers of each learner")


def plan(arguments: argparse.Namespace) -> Work:
    """Loads Simulations I and II."""
    settings = read_settings(arguments)
    weight, com = (
        load_hold_experiment(name, arguments.models, arguments.seed, settings) for name in ("weight", "com")
    )
    return partial(_work, weight, com, arguments)


def _work(
    weight: PresentationExperiment, com: PresentationExperiment, arguments: argparse.Namespace, folder: Path
) -> Iterator[Findings]:
    start, repeats, jobs = time.perf_counter(), arguments.repeats, arguments.jobs
    arrays, numbers = decoy_again.run(weight, folder, repeats=repeats, jobs=jobs)
    numbers |= {
        "honest": honest_objects.run(com, arguments.models, folder, repeats=repeats, jobs=jobs),
        "kappa": {learner.value: KAPPA[learner.pick] for learner in Learner if learner.pick is not None},
        "seed": weight.seed,
        "repeats": repeats,
        "wall_s": time.perf_counter() - start,
    }
    _print_differences(numbers)
    figures = {
        "decoy_again": partial(decoy_again.draw, weight, arrays, [learner.label for learner in Learner]),
        "memory": partial(decoy_again.draw_memory, weight, _SHOWN),
    }
    yield Findings(numbers, list_facts(repeats), figures)


def list_facts(repeats: int) -> dict[str, Any]:
    """Returns the facts of the run, as prose and claims name them."""
    return {"repeats": repeats, "num_decoys": decoy_again.NUM_DECOYS, "shown": _SHOWN}


def _print_differences(numbers: dict[str, Any]) -> None:
    print(f"{numbers['repeats']} observers of each learner, {numbers['wall_s']:.0f} s")
    for name, (one, six) in numbers["brass_after_decoy"].items():
        before, needless = numbers["brass_before_decoy"][name], numbers["needless_kinds"][name]
        heights = ", ".join(f"{100.0 * height:.1f}" for height in numbers["excursion_m"][name])
        print(f"{name}: brass {before:.0f} kg/m^3 before, {one:.0f} after one decoy, {six:.0f} after six")
        print(f"    farthest heights {heights} cm; needless kinds in {100.0 * needless:.1f} % of first lifts")
        honest = numbers["honest"][name]
        for task in honest_objects.TASKS:
            print(f"    right grip to {task}: " + ", ".join(f"{value:.3f}" for value in honest[f"p_correct_{task}"]))
        extremes = ", ".join(f"{100.0 * height:.2f}" for height in honest["height_extreme_m"])
        mass, com, needless = 100.0 * honest["mass_error"], 1000.0 * honest["com_error_m"], honest["needless_kinds"]
        print(f"    mass {mass:.2f} % off, centre of mass {com:.1f} mm")
        print(f"    test pass {extremes} cm; needless kinds in {100.0 * needless:.1f} % of first lifts")


STUDY = Study(
    "run the paper's simulations with each learner, and lift the decoy of Simulation I again",
    add_arguments,
    plan,
    refused={("learner",): "every learner is simulated"},
)
