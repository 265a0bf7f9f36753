"""Choices and blows in settings of the study of robustness, as shipped and with one thing changed."""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any

import pytest

from affordance.choice import blow_cost
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_options
from affordance.control.cost_measure import CostMeasure
from affordance.files.model_folder import MODELS
from affordance.named_settings import NO_CHANGES, Changes, change_settings
from affordance.objects.tool import list_densities
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.blow import simulate_blow
from helpers.study_runs import Numbers
from studies.robustness.assumptions import list_defaults, load_assumptions
from studies.robustness.build import World, build_world
from studies.robustness.choosing import (
    Experience,
    compare_measures,
    find_travel_of_other_grip,
    list_blow_costs,
    measure_choices,
    measure_tasks,
)
from studies.robustness.learning import collect_experience_at_rest

# Number of observers.
_LEARNERS = 60
# A threshold of torque below which lies whatever is held, [N m].
NUMB: Changes = {"noise.threshold": 50.0}
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
    return collect_experience_at_rest(StaticHold(load_arm(settings.arm)), world, 0, _LEARNERS)


def choose(*, is_other: bool = False, changes: Changes = NO_CHANGES) -> dict[str, Numbers]:
    """Choices of Simulations III and IV, and numbers about both tasks together."""
    world, reach, hammer = _plan(is_other)
    experience = _learn(change_settings(world.settings, changes))
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


def strike_and_choose(**changes: Any) -> dict[str, Numbers]:
    """Choices of Simulations III and IV, and a blow with contact, in a setting of the study of robustness."""
    numbers = choose(**changes)
    return {**numbers, "hammer": {**numbers["hammer"], **strike()}}


# Settings by what is changed, each with the claims of reaching, hammering and both that it contradicts.
CONTRADICTED: Mapping[str, tuple[Callable[[], Mapping[str, Numbers]], str]] = {
    "nothing is felt": (
        functools.partial(choose, changes=NUMB),
        "reach.increases reach.learned reach.after_one reach.after_two"
        " hammer.learned hammer.after_one hammer.after_two",
    ),
    "another tool, path and nail": (
        functools.partial(choose, is_other=True),
        "reach.correct_grip reach.chance hammer.correct_grip hammer.chance tasks.work_measures_agree"
        " tasks.effort_differs",
    ),
    "aimed 5 % too low": (
        lambda: {"hammer": strike(aim=0.95)},
        "hammer.sufficient_force",
    ),
    "torque squared is saved": (save_torque, "hammer.light_taps tasks.opposite_grips"),
}
