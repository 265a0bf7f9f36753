"""Growth of the cost with the numbers of processes, materials, components, samples and repeats."""

import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.ranking import rank_options
from affordance.experiments import reach, weight
from affordance.experiments.observers import Setup, run_observers
from affordance.objects.inertia import Ellipsoid
from affordance.objects.materials import Material
from affordance.objects.tool import Component, Tool
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import compute_posterior
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import TrialRunner
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.systems import predict_object
from studies.speed.timing import time_by_turns

NUM_REPEATS = 16
MATERIALS = (1, 2, 4, 8, 16)
COMPONENTS = (1, 2, 4, 8, 16)
SAMPLES = (100, 1_000, 10_000, 100_000)
REPEATS = (1, 2, 4, 8)
# Duration of the holds that are timed for several numbers of components, [s].
_DURATION = 0.5


def build_bar(num_components: int, num_materials: int) -> Tool:
    """Builds a bar of equal parts in a row, whose materials and colours alternate."""
    components = []
    for i in range(num_components):
        kind = i % num_materials
        material = Material(f"m{kind}", (kind / num_materials, 0.5, 0.5), 1000.0, 0.0, "made up")
        half = 0.15 / num_components
        X_TE = np.eye(4)
        X_TE[0, 3] = (2 * i + 1) * half
        components.append(Component(Ellipsoid((half, 0.01, 0.01)), X_TE, material, material))
    return Tool("bar", tuple(components))


def time_materials() -> list[float]:
    """Measures the time that Bayes' rule takes, [s], for objects of several materials, measured at rest."""
    settings = DEFAULT_SETTINGS
    hold = StaticHold(load_arm(settings.arm))
    calls: dict[str, Callable[[], object]] = {}
    for number in MATERIALS:
        features = measure_features(build_bar(16, number), VisionError(), np.random.default_rng(0))
        belief = predict_object(features, MaterialMemory(), settings.prior)
        statistics = hold.measure(belief, np.full(number, 1000.0), settings.noise, (0,))
        calls[str(number)] = partial(
            compute_posterior, belief, statistics, len(hold.tau_arm), settings.noise, settings.prior.deviation
        )
    return list(time_by_turns(calls, turns=7, calls_per_turn=3).values())


def time_components() -> list[float]:
    """Measures the time of a hold, [s], with objects of several components."""
    runner = TrialRunner(DEFAULT_SETTINGS)
    calls: dict[str, Callable[[], object]] = {
        str(number): partial(runner.run_hold, build_bar(number, 1), MaterialMemory(), duration=_DURATION, seed=(0,))
        for number in COMPONENTS
    }
    return list(time_by_turns(calls, turns=5, calls_per_turn=1).values())


def time_samples() -> list[float]:
    """Measures the time to rank the novel object's grips under samples of the prior, without planning, [s]."""
    _, (tool, *_), task = reach.read(Setup())
    choice = plan_choice(list_options(tool), task, DEFAULT_SETTINGS)
    calls: dict[str, Callable[[], object]] = {str(number): partial(_rank, choice, number) for number in SAMPLES}
    return list(time_by_turns(calls, turns=5, calls_per_turn=1).values())


def _rank(choice: Choice, num_samples: int) -> None:
    rank_options(choice, MaterialMemory(), np.random.default_rng(0), num_samples)


def time_repeats(repeats: int, jobs: int) -> float:
    """Measures the time of repeats of experiment ``weight``, once processes and Diagrams are built, [s]."""
    tools = weight.read(Setup())
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        run_observers("warm-up", Setup(2 * jobs, jobs=jobs, out=out), weight.observe, tools)
        begun = time.perf_counter()
        run_observers(f"{jobs} processes", Setup(repeats, jobs=jobs, out=out), weight.observe, tools)
        return time.perf_counter() - begun


def measure(*, repeats: int = NUM_REPEATS) -> tuple[dict[str, tuple[tuple[int, ...], list[float]]], dict[str, Any]]:
    """Measures all times; returns curves of time against count by name, and the numbers for metrics.json."""
    one, two = time_repeats(repeats, 1), time_repeats(repeats, 2)
    curves = {
        "materials: Bayes' rule for one trial": (MATERIALS, time_materials()),
        f"components: a hold of {_DURATION:g} s": (COMPONENTS, time_components()),
        "samples: ranking two grips": (SAMPLES, time_samples()),
        "repeats: weight in one process": (REPEATS, [time_repeats(number, 1) for number in REPEATS]),
    }
    return curves, {
        "parallel_efficiency_2": one / (2.0 * two),
        "scaling": {name: {"counts": counts, "seconds": seconds} for name, (counts, seconds) in curves.items()},
    }
