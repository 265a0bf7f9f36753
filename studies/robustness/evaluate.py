"""Evaluation of a sampled setting: results of all experiments, and tests of all claims."""

import logging
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_options
from affordance.exceptions import AffordanceError
from affordance.experiments.shared.objects import check_can_be_held
from affordance.objects.tool import list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import Settings
from affordance.simulation.blow import simulate_blow
from studies.robustness.assumptions import Setting
from studies.robustness.build import World, build_world
from studies.robustness.choosing import (
    Experience,
    compare_measures,
    find_travel_of_other_grip,
    list_blow_costs,
    measure_choices,
    measure_tasks,
)
from studies.robustness.claims import EXPERIMENTS, TASKS, judge
from studies.robustness.holding import (
    Held,
    compare_with_simulated,
    measure_centre_of_mass,
    measure_rods,
)
from studies.robustness.learning import collect_experience_at_rest, learn_at_rest
from studies.robustness.least_work import plan_least_work


class Outcome(NamedTuple):
    """Outcome of one setting."""

    # Results by experiment, without experiments that could not be run.
    numbers: dict[str, dict[str, Any]]
    # 1 if a claim holds, 0 if it does not, NaN if it cannot be tested.
    outcomes: dict[str, float]
    reasons: dict[str, str]  # reason why an experiment could not be run, by its name; empty if it was run
    cpu_s: dict[str, float]  # processor time by part of the evaluation, [s]
    held: dict[str, Held]  # held objects of Simulations I and II, by experiment
    # Largest error of interpolated trajectories if all holds were simulated, [m]; NaN otherwise.
    interpolation_error: float

    @property
    def simulated(self) -> float:
        """Fraction of different holds that were simulated; NaN if nothing was held."""
        motions = [each.motions for held in self.held.values() for each in held.tools]
        if not motions:
            return float("nan")
        return sum(each.num_simulated for each in motions) / sum(each.num_distinct for each in motions)


PARTS = ("learning", "weight", "com", "reach", "hammer", "least work", "contact", "proof")


def evaluate_setting(
    setting: Setting,
    *,
    seed: int,
    models: Path,
    settings: Settings,
    num_observers: int,
    simulates_contact: bool = False,
    proves: bool = False,
) -> Outcome:
    """Simulates observers that learn, hold and choose with a setting, and tests all claims.

    Args:
        setting: Values of all assumptions, by name.
        seed: Seed of the observers.
        models: Folder of models.
        settings: Default settings of the simulations.
        num_observers: Number of observers.
        simulates_contact: True to simulate contact and test the force of blows, except for blows that minimise work.
        proves: True to simulate all holds and compare them with interpolated trajectories.
    """
    world = build_world(setting, models, settings)
    clock = _Clock()
    numbers: dict[str, dict[str, Any]] = {}
    reasons = dict.fromkeys((*EXPERIMENTS, TASKS), "")
    choices: dict[str, Choice] = {}
    held: dict[str, Held] = {}

    @contextmanager
    def attempt(name: str) -> Iterator[None]:
        try:
            yield
        except AffordanceError as error:
            reasons[name] = " ".join(str(error).split())

    with _quiet():
        hold = StaticHold(load_arm(world.settings.arm))
        with clock.measure("learning"):
            experience = collect_experience_at_rest(hold, world, seed, num_observers)
            in_turn = [range(len(world.rods))] * num_observers
            rods = learn_at_rest(hold, world, world.rods, in_turn, seed)
        with attempt("weight"), clock.measure("weight"):
            check_can_be_held(models / "rods", world.rods, world.settings)
            held["weight"] = measure_rods(world, rods, partial(_judge_alone, "weight"))
        with attempt("com"), clock.measure("com"):
            check_can_be_held(models / "learning objects", world.learning, world.settings)
            held["com"] = measure_centre_of_mass(world, experience, partial(_judge_alone, "com"))
        numbers |= {name: each.numbers for name, each in held.items()}
        with attempt("reach"), clock.measure("reach"):
            choices["reach"] = _check(plan_choice(list_options(world.novel), world.reach, world.settings))
            numbers["reach"] = measure_choices(choices["reach"], world.novel, experience, seed, world.rule)
        with attempt("hammer"):
            choices["hammer"] = _plan_hammer(world, clock)
            with clock.measure("hammer"):
                numbers["hammer"] = _measure_hammer(choices["hammer"], world, experience, seed)
            numbers["hammer"]["force_ratios"] = None
            if simulates_contact and not world.plans_least_work:
                with clock.measure("contact"):
                    numbers["hammer"]["force_ratios"] = _measure_contact(choices["hammer"], world)
        with attempt(TASKS):
            if "reach" not in numbers or "hammer" not in numbers:
                raise AffordanceError("reaching or hammering cannot be judged")
            numbers[TASKS] = measure_tasks(
                compare_measures(choices["reach"], world.novel),
                compare_measures(choices["hammer"], world.novel),
                correct_reach=numbers["reach"]["correct_grip"],
                correct_hammer=numbers["hammer"]["correct_grip"],
            )
        with clock.measure("proof"):
            compared = [compare_with_simulated(world, each) for each in held.values()] if proves else []
    return Outcome(numbers, judge(numbers), reasons, clock.seconds, held, max(compared, default=np.nan))


def _judge_alone(name: str, numbers: Mapping[str, Any]) -> dict[str, float]:
    return {key: value for key, value in judge({name: dict(numbers)}).items() if key.startswith(f"{name}.")}


def _plan_hammer(world: World, clock: "_Clock") -> Choice:
    """Plans blows with both grips, minimising work if the setting requires it."""
    with clock.measure("hammer"):
        choice = _check(plan_choice(list_options(world.novel), world.hammer, world.settings))
    if not world.plans_least_work:
        return choice
    with clock.measure("least work"):
        model, held = ArmModel(load_arm(world.settings.arm)), world.novel.list_gripped()
        costs = [
            plan_least_work(planned, world.hammer, model, held[grip].parameters, world.settings)
            for grip, planned in list_blow_costs(choice).items()
        ]
        return Choice(choice.options, costs, world.settings)


def _check(choice: Choice) -> Choice:
    for option, cost in zip(choice.options, choice.cost_models, strict=True):
        if cost.infeasible_reason:
            raise AffordanceError(f"{option.name} {cost.infeasible_reason}")
    return choice


def _measure_hammer(choice: Choice, world: World, experience: Experience, seed: int) -> dict[str, Any]:
    nail = world.hammer.nail
    return {
        **measure_choices(choice, world.novel, experience, seed, world.rule),
        "travel_of_other_grip_m": find_travel_of_other_grip(
            choice, world.novel, nail.depth_set, nail.stiffness, world.hammer.force
        ),
    }


def _measure_contact(choice: Choice, world: World) -> list[float] | None:
    """Computes the ratio of peak force to required force for each grip, with simulated contact.

    Returns None if a blow cannot be simulated.
    """
    held, true = world.novel.list_gripped(), list_densities([world.novel])
    try:
        return [
            simulate_blow(held[grip], world.hammer, planned, true, world.settings).force / world.hammer.force
            for grip, planned in list_blow_costs(choice).items()
        ]
    except AffordanceError:
        return None


class _Clock:
    """Processor time of each part of the evaluation."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PARTS, 0.0)

    @contextmanager
    def measure(self, part: str) -> Iterator[None]:
        """Adds the processor time of the context to a part."""
        start = time.process_time()
        try:
            yield
        finally:
            self.seconds[part] += time.process_time() - start


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppresses warnings about single trials, which are expected with extreme settings."""
    log = logging.getLogger("affordance")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)
