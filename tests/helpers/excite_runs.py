"""Small runs of the study of how to move: the weighed objects, and a generated arm; as shipped and with a change."""

import functools
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from affordance.identification.evidence.gains import build_nominal_gains
from affordance.identification.evidence.model_error import build_phantom_covariance
from affordance.identification.excitation.expectation import Expectation, Spread
from affordance.identification.excitation.planned_motion import FourierFamily, MotionLimits
from affordance.identification.settings import DEFAULT_SETTINGS, SignalKind
from helpers.generated_runs import THETA, build_robot, draw_errors
from helpers.stacked import stack
from helpers.study_runs import Numbers
from studies.excite import motions, posewise, study
from studies.excite.motions import World

DATA = str(Path(__file__).parents[1] / "data")
OBJECTS = ("white", "red", "black")
NUMBERS, SECONDS = (1, 3, 5, 8), (2.0, 8.0)
_BROADER = 1.5  # limits of a planner that is wrong about them


@functools.cache
def build_world(arm: str, data: str) -> World:
    """A generated arm, with errors that agree over a third of a second."""
    with tempfile.TemporaryDirectory() as folder:
        robot = build_robot(Path(folder))
    gains = build_nominal_gains(robot.joint_names, SignalKind.JOINT_TORQUE, DEFAULT_SETTINGS)
    bound = np.ones(6)
    limits = MotionLimits(-1.5 * bound, 1.5 * bound, 2.0 * bound, 3.0 * bound, 200.0 * bound, 1.0)
    errors = np.sqrt(0.1) * draw_errors(np.arange(0.0, 10.0, 0.01), 6, 0.3, np.random.default_rng(0))
    floor = build_phantom_covariance(0.02)
    return World(Expectation(robot, gains, np.full(6, 0.03), THETA[None], floor), limits, errors)


def move(*, poses: str = "", motion: str = "") -> Numbers:
    """Numbers of the study, with postures and motions as shipped, or with something changed."""
    return study.describe(_choose_poses(poses), NUMBERS, _design_motions(motion), SECONDS)


def _choose_poses(change: str) -> dict[str, list[Numbers]]:
    """Postures; "sure": all but the load counts as known; "white": chosen as if errors were white noise."""
    rules = {"stated": "d_optimal" if change == "white" else "stated", "random": "random"}
    return {name: [_choose(each, rule, change == "sure") for each in OBJECTS] for name, rule in rules.items()}


def _design_motions(change: str) -> dict[str, dict[str, Numbers]]:
    """Motions; "perverse": the least informative are chosen; "reckless": limits count as broader than they are."""
    return {"generated": {"stated": _design("stated", change), "random": _design("random", "")}}


@functools.cache
def _choose(name: str, rule: str, is_sure: bool) -> Numbers:
    config = posewise.PosewiseConfig(DATA, name, rule, numbers=NUMBERS)
    with pytest.MonkeyPatch.context() as patch:
        if is_sure:
            patch.setattr(posewise, "prepare_task", _know_all)
        return stack([posewise.run_pool(config, repeat) for repeat in range(2)])


@functools.cache
def _design(rule: str, change: str) -> Numbers:
    config = motions.MotionConfig("", "generated", rule, SECONDS, num_draws=10, num_changes=5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(motions, "build_world", build_world)
        patch.setattr(motions, "_NUM_TRUTHS", 2)
        patch.setattr(motions, "_RANDOM", 2)
        if change == "perverse":
            patch.setattr(motions, "_design", _design_worst)
        if change == "reckless":
            patch.setattr(motions, "FourierFamily", _exceed)
        return stack([motions.run_motions(config, 0)])


_DESIGN, _PREDICT, _PREPARE = motions._design, Expectation.predict, posewise.prepare_task


def _design_worst(config, world, seconds, rng):  # type: ignore[no-untyped-def]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Expectation, "predict", lambda self, *m: Spread(*(-each for each in _PREDICT(self, *m))))
        return _DESIGN(config, world, seconds, rng)


def _know_all(data: str, name: str) -> tuple[posewise.Task, float]:
    """Gains, friction and errors are taken to be known ten times as well, and no floor."""
    task, mass = _PREPARE(data, name)
    gains = replace(
        task.gains, covariance=0.01 * task.gains.covariance, least_variance=0.01 * task.gains.least_variance
    )
    sure = replace(
        task.prior,
        gain_covariance=gains.covariance,
        friction_sd=0.1 * task.prior.friction_sd,
        phantom_covariance=np.zeros((10, 10)),
    )
    return task._replace(gains=gains, prior=sure), mass


def _exceed(robot, limits, duration) -> FourierFamily:  # type: ignore[no-untyped-def]
    """Plans with broader limits than the arm has, and looks at no others."""
    wider = limits._replace(v_max=_BROADER * limits.v_max, vdot_max=_BROADER * limits.vdot_max, tip_speed=np.inf)
    return FourierFamily(robot, wider, duration)
