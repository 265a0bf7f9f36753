"""Runs of Linear+ and Linear++ for every learner: numbers, figures and trajectories, compared with people's."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.belief.learner import Learner
from affordance.belief.learners import KAPPA
from affordance.experiments.people.fraction import estimate_people_fraction
from affordance.experiments.people.lift_experiment import LiftExperiment, Observers, simulate_observers
from affordance.experiments.people.linear_plus import (
    NUM_LAST_CYCLES,
    Group,
    build_experiment,
    list_test_cycles,
)
from affordance.files.atomic import write_json
from affordance.files.model_folder import MODELS
from affordance.files.netcdf import LabelledArray, Trajectories, write_trajectories
from affordance.protocols.published import PublishedTable
from affordance.reporting.figures import save_figure
from affordance.reporting.people_figures import Interval, LiftCurve, draw_test_object
from affordance.reporting.report import write_report, write_section
from affordance.reporting.section import Section, render_section
from affordance.reporting.statistics import estimate_mean, estimate_proportion
from affordance.runs.repeats import list_versions
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.clamp_trial import tabulate_excursions
from affordance.simulation.trial import get_runner

# Measures for which people's numbers are published.
MEASURES = ("first_N", "end_N", "family_N", "f")
FIGURE = "test_object"
SECTION = Path(__file__).parents[1] / "sections" / "people.yaml"
_LABELS = {
    Learner.DENSITY: "one density for each colour",
    Learner.KINDS_MAP: "kinds, most probable",
    Learner.KINDS_DRAWN: "kinds, drawn",
}
# Duration of a hold after release in the simulated lifts, until the hand has come to rest, [s].
_HELD = 1.0


@dataclass(frozen=True)
class PeopleConfig:
    """Configuration of a run.

    Attributes:
        group: Group of people to simulate.
        models: Folder with the published values.
        seed: Root of every random draw.
        settings: Settings of all simulations.
    """

    group: Group
    models: Path = MODELS
    seed: int = 0
    settings: Settings = DEFAULT_SETTINGS


def run(config: PeopleConfig, folder: Path, *, repeats: int, jobs: int) -> dict[str, Any]:
    """Simulates a group for every learner, and writes metrics.json, figure and trajectories.

    Args:
        config: Configuration of the run.
        folder: Folder for the files.
        repeats: Number of observers of each learner, at least 2.
        jobs: Number of processes.

    Returns: Numbers of metrics.json.

    Raises:
        BadValueError: The file with people's values is wrong.
    """
    start = time.perf_counter()
    people = config.group.load_people(config.models)
    experiment = build_experiment(config.group)
    observers = {
        learner: simulate_observers(
            experiment, learner, config.settings, repeats=repeats, seed=config.seed, jobs=jobs
        )
        for learner in Learner
    }
    simulated_s = time.perf_counter() - start
    numbers = compute_metrics(experiment, observers, people)
    numbers["excursion_m"] = _compute_excursions(config, experiment, observers)
    numbers["lifts_per_s"] = sum(each.force.size for each in observers.values()) / simulated_s
    save_figure(draw(config.group, experiment, observers, people), folder, FIGURE)
    _write_lifts(folder / "trajectories.nc", experiment, observers)
    numbers.update(
        seed=config.seed,
        repeats=repeats,
        config=config,
        versions=list_versions(),
        wall_s=time.perf_counter() - start,
    )
    write_section(folder, describe(config.group, numbers, repeats))
    write_json(folder / "metrics.json", numbers)  # last: it marks a complete run
    write_report(folder.parent)
    return numbers


def compute_metrics(
    experiment: LiftExperiment, observers: Mapping[Learner, Observers], people: PublishedTable
) -> dict[str, Any]:
    """Computes the numbers of metrics.json: learners, people, kappa and further results.

    Raises:
        BadValueError: The table of people's values lacks a row that is needed.
    """
    learners: dict[str, dict[str, Any]] = {}
    for learner, found in observers.items():
        learners[learner.value] = {}
        for name in MEASURES:
            estimate = estimate_mean(found.measure(experiment.measures[name]))
            learners[learner.value][name] = float(estimate.mean)
            learners[learner.value][f"{name}_ci95"] = estimate.ci95
    published: dict[str, Any] = {}
    for name in MEASURES[:-1]:
        value = people.get(name)
        published[name] = value.value
        published[f"{name}_ci95"] = [value.low, value.high]
    fraction = estimate_people_fraction(people)
    published["f"], published["f_ci95"] = fraction.mean, [fraction.low, fraction.high]
    needless = {learner: found.count_needless_kinds(experiment.honest) for learner, found in observers.items()}
    correlation = experiment.measures["training_correlation"]
    return {
        "learners": learners,
        "people": published,
        "kappa": {learner.value: KAPPA[learner.pick] for learner in observers if learner.pick is not None},
        "needless_kinds": {
            learner.value: float(estimate_proportion(np.array(count), lifts).mean)
            for learner, (count, lifts) in needless.items()
        },
        "training_correlation": {
            learner.value: float(found.measure(correlation).mean()) for learner, found in observers.items()
        },
        "training_correlation_people": people.get("training_correlation").value,
    }


def draw(
    group: Group, experiment: LiftExperiment, observers: Mapping[Learner, Observers], people: PublishedTable
) -> Figure:
    """Draws the test object lift by lift, one panel per learner, with people's intervals in each."""
    curves = [
        LiftCurve(_LABELS[learner], *list_test_cycles(experiment, found)) for learner, found in observers.items()
    ]
    first, end, family = (
        Interval(value.value, value.low, value.high) for value in (people.get(name) for name in MEASURES[:-1])
    )
    return draw_test_object(
        curves,
        weight=people.get("weight_N").value,
        first=first,
        end=end,
        family=family,
        num_last=NUM_LAST_CYCLES,
        title=f"{group.title}: the test object weighs {group.test_mass:g} kg, its family predicts 0.9 kg",
    )


def describe(group: Group, numbers: Mapping[str, Any], repeats: int) -> Section:
    """Puts the numbers beside people's."""
    return render_section(SECTION, numbers, {"group": group, "repeats": repeats})


def _compute_excursions(
    config: PeopleConfig, experiment: LiftExperiment, observers: Mapping[Learner, Observers]
) -> dict[str, dict[str, float]]:
    """Computes the mean farthest movement of the hand at release of the test object, first lift and end, [m]."""
    table = tabulate_excursions(get_runner(config.settings), experiment.tools[-1], duration=_HELD)
    excursions = {}
    for learner, found in observers.items():
        moved = table.interpolate(list_test_cycles(experiment, found)[0])
        excursions[learner.value] = {
            "first": float(moved[:, 0].mean()),
            "end": float(moved[:, -NUM_LAST_CYCLES:].mean()),
        }
    return excursions


def _write_lifts(path: Path, experiment: LiftExperiment, observers: Mapping[Learner, Observers]) -> None:
    """Writes the object and force of every lift of every observer."""
    variables = {}
    for learner, found in observers.items():
        name = learner.value
        axes = ("observer", "lift")
        variables[f"tool_{name}"] = LabelledArray(
            axes, found.tool, "1", f"place of the object among the names, {name}"
        )
        variables[f"force_{name}"] = LabelledArray(axes, found.force, "N", f"upward force before release, {name}")
        variables[f"weight_{name}"] = LabelledArray(axes, found.weight, "N", f"true weight, {name}")
    write_trajectories(path, Trajectories(variables, {"tool": [tool.name for tool in experiment.tools]}))
