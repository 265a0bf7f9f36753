"""Small runs of every experiment, as shipped and with one thing changed, by whose numbers claims are judged."""

import dataclasses
import functools
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from affordance.belief import kind_memory
from affordance.belief.learner import Pick
from affordance.choice import blow_cost
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_options
from affordance.control.cost_measure import CostMeasure
from affordance.experiments.protocol_runs import load_hold_experiment, load_protocol_experiment
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.files.model_folder import MODELS
from affordance.named_settings import Changes, change_settings
from affordance.objects.tool import list_densities
from affordance.plant.load import load_arm
from affordance.proprioception.faults import Faults
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.blow import simulate_blow
from helpers.short_holds import shorten
from helpers.stacked import stack
from studies.people.fit import load_groups
from studies.robustness.assumptions import list_defaults, load_assumptions
from studies.robustness.build import HOLD_DURATION, World, build_world
from studies.robustness.choosing import (
    compare_measures,
    find_travel_of_other_grip,
    list_blow_costs,
    measure_choices,
    measure_tasks,
)
from studies.robustness.learning import collect_experience_at_rest

type Numbers = Mapping[str, Any]
type Change = Callable[[pytest.MonkeyPatch], Settings]

# Number of observers who hold, and of those who learn at rest; durations of a hold, [s].
_HOLDERS, _LEARNERS = 2, 60
_HELD = {"weight": 0.6, "com": 1.0}
# A wooden and a steel part of unlike sizes, bent, by other postures along a turned path, and a tap on the nail.
OTHER_WORLD = {
    "novel_parts": "unequal",
    "novel_share": 0.316,
    "novel_bend": 0.18,
    "novel_length": 0.32,
    "start_azimuth": 0.127,
    "start_elevation": 0.116,
    "start_elbow": -0.325,
    "path_turn": 0.873,
    "path_scale": 0.89,
    "path_rise": 0.08,
    "path_bow": -0.093,
    "path_duration": 2.6,
    "nail_force": 130.0,
}
# A threshold of torque below which lies whatever is held, [N m].
NUMB: Changes = {"noise.threshold": 50.0}
NO_SAMPLES = dataclasses.replace(DEFAULT_SETTINGS, faults=Faults(drop_probability=1.0))
# Breadths of a category by which everything is of one kind, and everything of a kind of its own.
ONE_KIND, OWN_KINDS = 8.0, 0.02


@functools.cache
def hold(name: str, settings: Settings = DEFAULT_SETTINGS) -> Numbers:
    """Simulation I or II by two observers."""
    experiment = shorten(dataclasses.replace(load_hold_experiment(name), settings=settings), _HELD[name])
    with tempfile.TemporaryDirectory() as folder:
        experience = experiment.gain_experience(Path(folder), repeats=_HOLDERS, jobs=1)
    runs = [experiment.run_observer(None, experience, repeat) for repeat in range(_HOLDERS)]
    return experiment.compute_metrics(None, experience, stack(runs))


def believe_denser() -> Numbers:
    """Simulation I by observers who believe in densities of 20,000 kg/m^3."""
    return hold("weight", change_settings(DEFAULT_SETTINGS, {"prior.mode": 20_000.0}))


def _build(changes: Mapping[str, float | str]) -> World:
    setting = list_defaults(load_assumptions())
    assert changes.keys() <= setting.keys()
    return build_world({**setting, **changes}, MODELS, DEFAULT_SETTINGS)


@functools.cache
def _plan(is_other: bool) -> tuple[World, Choice, Choice]:
    """A world, and motions by each grip of its novel tool: reaching and hammering."""
    world = _build(OTHER_WORLD if is_other else {})
    options = list_options(world.novel)
    reach, hammer = (plan_choice(options, task, world.settings) for task in (world.reach, world.hammer))
    return world, reach, hammer


@functools.cache
def _learn(settings: Settings) -> Experience:
    """Experience with the objects of Simulation II, felt at rest."""
    world = dataclasses.replace(_build({}), settings=settings)
    config = ExperienceConfig(world.learning[:2], 0, settings, HOLD_DURATION)
    return collect_experience_at_rest(StaticHold(load_arm(settings.arm)), world, config, _LEARNERS)


def choose(*, is_other: bool = False, changes: Changes | None = None) -> dict[str, Numbers]:
    """Choices of Simulations III and IV, and numbers about both tasks together."""
    world, reach, hammer = _plan(is_other)
    experience = _learn(change_settings(world.settings, changes or {}))
    numbers: dict[str, dict[str, Any]] = {
        "reach": measure_choices(reach, world.novel, experience, 0, world.rule),
        "hammer": measure_choices(hammer, world.novel, experience, 0, world.rule),
    }
    numbers["hammer"]["travel_of_other_grip_m"] = _find_travel(world, hammer)
    numbers["tasks"] = measure_tasks(
        compare_measures(reach, world.novel),
        compare_measures(hammer, world.novel),
        correct_reach=numbers["reach"]["correct_grip"],
        correct_hammer=numbers["hammer"]["correct_grip"],
    )
    return numbers


def save_torque() -> dict[str, Numbers]:
    """The grips that are correct if torque squared is saved instead of work."""
    world, reach, hammer = _plan(False)
    models = [
        dataclasses.replace(model, motions=tuple(motion.measured_by(CostMeasure.EFFORT) for motion in model.motions))
        for model in list_blow_costs(hammer).values()
    ]
    by_reach, by_hammer = (compare_measures(choice, world.novel) for choice in (reach, hammer))
    place = CostMeasure.EFFORT.name
    return {
        "hammer": {"travel_of_other_grip_m": _find_travel(world, Choice(hammer.options, models, hammer.settings))},
        "tasks": measure_tasks(
            by_reach,
            by_hammer,
            correct_reach=reach.options[by_reach[place]].grip,
            correct_hammer=hammer.options[by_hammer[place]].grip,
        ),
    }


def _find_travel(world: World, hammer: Choice) -> float:
    nail = world.hammer.nail
    return find_travel_of_other_grip(hammer, world.novel, nail.depth_set, nail.stiffness, world.hammer.force)


def strike(*, aim: float = blow_cost.AIM) -> Numbers:
    """A blow with contact, by one of the grips, planned for a multiple of the demanded force."""
    world, _, hammer = _plan(False)
    held, true = world.novel.list_gripped(), list_densities([world.novel])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blow_cost, "AIM", aim)
        grip, planned = next(iter(list_blow_costs(hammer).items()))
        blow = simulate_blow(held[grip], world.hammer, planned, true, world.settings)
    return {"force_ratios": [blow.force / world.hammer.force]}


@functools.cache
def lift(group: int, *, is_numb: bool = False, kappa: float | None = None, repeats: int = 1) -> Numbers:
    """The protocol of a group of people, with a third of its lifts, by few observers of each learner."""
    settings = change_settings(DEFAULT_SETTINGS, NUMB if is_numb else {})
    experiment = load_groups(MODELS, 0, settings)[group]
    counts = zip(experiment.blocks, (5, 16), strict=True)
    blocks = tuple(block.model_copy(update={"repetitions": count}) for block, count in counts)
    experiment = dataclasses.replace(experiment, blocks=blocks, kappa=kappa)
    return experiment.compute_metrics(
        None, None, stack([experiment.run_observer(None, None, repeat) for repeat in range(repeats)])
    )


def lift_family(name: str, *, kappa: float | None = None) -> Numbers:
    """A protocol of lifts in closed form by one observer of each learner."""
    with pytest.MonkeyPatch.context() as patch:
        _widen(patch, kappa)
        experiment = load_protocol_experiment(name)
        runs = [experiment.run_observer(None, None, 0)]
    return experiment.compute_metrics(None, None, stack(runs))


def _widen(patch: pytest.MonkeyPatch, kappa: float | None) -> None:
    if kappa is not None:
        for pick in Pick:
            patch.setitem(kind_memory.KAPPA, pick, kappa)
