"""Motions of a Panda and a UR10e, designed by different rules, with errors taken from recordings of these arms.

The errors are residuals of real recordings after subtracting arm, load and friction. Stretches of them from random
places, for all joints together, are added to simulated signals, so that errors keep their correlation in time. Gains,
friction and the error of the arm's model are drawn from the prior that identification uses.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.identification.evidence.gains import Gains, build_nominal_gains
from affordance.identification.evidence.model_error import build_phantom_covariance
from affordance.identification.evidence.paired_runs import pair_runs
from affordance.identification.evidence.unpaired_runs import fit_empty_arm
from affordance.identification.excitation.expectation import Aim, Expectation
from affordance.identification.excitation.motion_design import NUM_CHANGES, NUM_DRAWS, search
from affordance.identification.excitation.planned_motion import (
    FourierFamily,
    MotionFamily,
    MotionLimits,
    PostureFamily,
    list_times,
    to_motion,
    to_trajectory,
)
from affordance.identification.posterior.calibration import calibrate_gains
from affordance.identification.posterior.log_cholesky import compute_jacobian, parameters_from_theta
from affordance.identification.posterior.payload_fit import build_channel_prior, fit_payload
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.recording.preparation import PreparedRun, prepare
from affordance.identification.settings import DEFAULT_SETTINGS, SignalKind
from affordance.plant.serial_chain import ChainDynamics, SerialChain
from studies.excite.posewise import score_condition
from studies.recorded.clones import UR10E_LOAD, load_panda, load_ur10e
from studies.recorded.peers import TO_90
from studies.recorded.random_payloads import draw_payload

ARMS = ("panda", "ur10e")
RULES = ("stated", "stated_postures", "random", "random_postures", "condition", "d_optimal")
SECONDS = (2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
# Lengths of random motions, which need longer to approach the floor.
LONG_SECONDS = (*SECONDS, 24.0, 32.0)
# Postures per second for rules that visit postures, and number of motions that a random rule draws instead of
# searching.
_POSTURES, _RANDOM = 0.4, 8
_TRIED = 60  # most random motions drawn until one is within the limits
_MASS, _NUM_BODIES, _MASS_SD = 1.0, 4, 0.1
_MASSES, _NUM_TRUTHS = (0.5, 2.0), 24
_RATE, _FINE = 100.0, 500.0  # rate of recordings, and rate at which limits are checked, [Hz]
_CUTOFF = 5.0  # cutoff of the filter that was applied to the recordings, [Hz]
_ACCELERATION, _TIP_SPEED, _REACH = 3.0, 1.0, 1.5
# Makers' limits of angles, rates and torques of a Panda; those of a UR10e are in its file.
_PANDA = (
    (-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973),
    (2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973),
    (2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
    (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
)
_UR10E = (
    (-6.283, -6.283, -3.1416, -6.283, -6.283, -6.283),
    (6.283, 6.283, 3.1416, 6.283, 6.283, 6.283),
    (3.14, 3.14, 3.14, 6.28, 6.28, 6.28),
    (330.0, 330.0, 150.0, 54.0, 54.0, 54.0),
)
_HOMES = {
    "panda": (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785),
    "ur10e": (0.0, -1.571, 1.571, -1.571, -1.571, 0.0),
}


@dataclass(frozen=True)
class MotionConfig:
    """Configuration of the motions of one rule."""

    data: str  # folder of the recordings
    arm: str  # name of the arm
    rule: str  # name of the rule
    seconds: tuple[float, ...] = SECONDS  # lengths of the motions, [s]
    seed: int = 0  # root of every random draw
    num_draws: int = NUM_DRAWS  # number of random motions from which a search starts
    num_changes: int = NUM_CHANGES  # number of changes tried on each of the best motions


class World(NamedTuple):
    """Arm with its model, its calibration, and its recorded errors, shape (N, n)."""

    expectation: Expectation
    limits: MotionLimits
    errors: Array


def run_motions(config: MotionConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Designs motions of all lengths, and identifies random payloads along them.

    Returns:
        For each length: ``said``, root mean square of the stated standard deviation of the mass, [kg]; ``rmse``, root
        mean square error of the mass, [kg]; ``inside``, share of 90 % intervals that contain the true mass;
        ``excess``, the largest used share of a limit; ``predicted``, the standard deviation that the design predicts,
        [kg].
    """
    world = build_world(config.arm, config.data)
    rows = []
    for number, seconds in enumerate(config.seconds):
        rng = np.random.default_rng([config.seed, repeat, number])
        motions = _design(config, world, seconds, rng)
        each = [_identify(world, m, rng, max(3, _NUM_TRUTHS // len(motions))) for m in motions]
        said, rmse, inside = np.mean(each, axis=0)
        predicted = np.mean([world.expectation.predict(m).mass ** 2 for m in motions])
        bodies = parameters_from_theta(world.expectation.bodies)
        excess = max(world.limits.compute_excess(world.expectation.robot, _refine(m), bodies) for m in motions)
        rows.append([np.sqrt(said), np.sqrt(rmse), inside, excess, np.sqrt(predicted)])
    return dict(zip(("said", "rmse", "inside", "excess", "predicted"), np.array(rows).T, strict=True))


@cache
def build_world(arm: str, data: str) -> World:
    """Builds the world of an arm from its recordings."""
    settings = DEFAULT_SETTINGS
    if arm == "panda":
        panda = load_panda(Path(data))
        gains = build_nominal_gains(panda.robot.joint_names, SignalKind.JOINT_TORQUE, settings)
        return _collect(panda.robot, gains, prepare(panda.empty, settings), None, arm)
    recorded = load_ur10e(Path(data))
    evidence = pair_runs(recorded.robot, recorded.empty, recorded.loaded, settings)
    gains = calibrate_gains(evidence, UR10E_LOAD, settings).with_drift(settings)
    solid = SolidPrior.for_hand().with_mass(UR10E_LOAD, 1e-3 * UR10E_LOAD)
    fit = fit_payload(evidence, build_channel_prior(evidence, gains, settings), solid, settings)
    errors = np.einsum("cni,ci->nc", fit.evidence.samples.build_columns(), fit.weights)
    return _collect(recorded.robot, gains, prepare(recorded.empty, settings), errors, arm)


def _collect(robot: SerialChain, gains: Gains, empty: PreparedRun, errors: Array | None, arm: str) -> World:
    """Builds the world of an arm; by default its errors are the residuals of a fit to its empty run."""
    fitted = fit_empty_arm(robot, [empty], [empty.signal], gains, DEFAULT_SETTINGS)
    density = fitted.least_variance / empty.rate
    if errors is None:
        errors = fitted.residual[0][np.isfinite(fitted.residual[0]).all(axis=1)]
    else:
        density = gains.least_variance / empty.rate
    bodies = (
        SolidPrior.for_hand().with_mass(_MASS, _MASS_SD * _MASS).draw_theta(np.random.default_rng(0), _NUM_BODIES)
    )
    floor = build_phantom_covariance(fitted.phantom_mass)
    q_lower, q_upper, v_max, tau_max = np.array(_PANDA if arm == "panda" else _UR10E)
    home = np.array(_HOMES[arm])
    limits = MotionLimits(
        np.maximum(q_lower, home - _REACH),
        np.minimum(q_upper, home + _REACH),
        v_max,
        np.full(len(home), _ACCELERATION),
        tau_max,
        _TIP_SPEED,
        0.0,
    )
    return World(Expectation(robot, gains, density, bodies, floor), limits, errors)


def _design(config: MotionConfig, world: World, seconds: float, rng: np.random.Generator) -> list[PreparedRun]:
    expectation, bodies = world.expectation, parameters_from_theta(world.expectation.bodies)
    family: MotionFamily = FourierFamily(expectation.robot, world.limits, seconds)
    if config.rule.endswith("postures"):
        family = PostureFamily(expectation.robot, world.limits, seconds, max(1, round(_POSTURES * seconds)))
    if config.rule.startswith("random"):
        seeds = rng.integers(2**31, size=_RANDOM)
        return [
            search(lambda *_: 0.0, family, bodies, num_draws=_TRIED, num_changes=0, seed=int(seed)).motion
            for seed in seeds
        ]

    def score(motion: PreparedRun, dynamics: ChainDynamics) -> float:
        if config.rule.startswith("stated"):
            return expectation.predict(motion, dynamics).get(Aim.MASS)
        Y = dynamics.Y
        weights = expectation.gains.mean[:, 0] / np.sqrt(expectation.error_density * motion.rate)
        rows = (Y * weights[:, None]).reshape(-1, 10)
        if config.rule == "condition":
            return score_condition(rows)
        D = compute_jacobian(expectation.bodies[0])
        known = np.linalg.inv(D @ SolidPrior.for_hand().covariance @ D.T)
        return -float(np.linalg.slogdet(known + rows.T @ rows)[1])

    found = search(
        score,
        family,
        bodies,
        num_draws=config.num_draws,
        num_changes=config.num_changes,
        seed=int(rng.integers(2**31)),
    )
    return [found.motion]


def _identify(
    world: World, motion: PreparedRun, rng: np.random.Generator, num_truths: int
) -> tuple[float, float, float]:
    """Identifies payloads along a motion; returns mean squares of stated and true errors, [kg^2], and coverage."""
    expectation, settings = world.expectation, world.expectation.settings
    gains, robot = expectation.gains, expectation.robot
    num_rows, n = round(motion.times[-1] * _RATE), robot.num_joints
    along = to_trajectory(motion)
    times = np.arange(num_rows) / _RATE
    q, v, vdot = (_evaluate(along, times, order) for order in range(3))
    moved = to_motion(times, q, v, vdot)._replace(cutoff=_CUTOFF)
    evidence = expectation.build_evidence(moved)
    prior = build_channel_prior(evidence, gains, settings)
    squares = []
    for _ in range(num_truths):
        pi = draw_payload(rng, _MASSES).parameters
        load = pi + rng.multivariate_normal(np.zeros(10), expectation.floor, method="svd")
        samples = evidence.with_load(load).samples
        torque = samples.Y @ load
        g = gains.mean + np.array([rng.multivariate_normal(np.zeros(2), C, method="svd") for C in gains.covariance])
        c = evidence.list_friction_sds(settings) * rng.standard_normal((n, 3))
        first = rng.integers(len(world.errors))
        errors = np.take(world.errors, np.arange(first, first + num_rows), axis=0, mode="wrap")
        signal = (g[:, 0] + g[:, 1] * samples.load_sign) * torque + errors
        signal = signal + c[:, 0] * samples.direction + c[:, 1] * v + c[:, 2]
        felt = replace(evidence, samples=samples._replace(signal=signal))
        fit = fit_payload(felt, prior, SolidPrior.for_hand(), settings)
        log_sd, mass = float(np.sqrt(fit.mode.covariance[0, 0])), float(np.exp(fit.mode.theta[0]))
        inside = abs(np.log(mass / pi[0])) <= TO_90 * log_sd
        squares.append([(mass * log_sd) ** 2, (mass - pi[0]) ** 2, float(inside)])
    said, rmse, inside = np.mean(squares, axis=0)
    return float(said), float(rmse), float(inside)


def _evaluate(along: Any, times: Array, order: int) -> Array:
    """Evaluates a derivative of a trajectory, (N, n)."""
    return np.asarray(along.derivative(order).vector_values(times)).T


def _refine(motion: PreparedRun) -> PreparedRun:
    """Returns a motion as a controller executes it, with cubic polynomials between its points."""
    along = to_trajectory(motion)
    times = list_times(motion.times[-1], _FINE)
    return to_motion(times, *(_evaluate(along, times, order) for order in range(3)))


def find_seconds(seconds: tuple[float, ...], error: Array, floor: float) -> float:
    """Computes the time after which an error stays within 1.2 times the floor, [s].

    Errors are interpolated between lengths in the logarithm. If this never happens, the result is the longest length
    plus one second.
    """
    above = np.flatnonzero(error > 1.2 * floor)
    if not above.size:
        return seconds[0]
    last = int(above[-1])
    if last == len(seconds) - 1:
        return seconds[-1] + 1.0
    x = np.log(error[last : last + 2] / (1.2 * floor))
    t = np.log(seconds[last : last + 2])
    return float(np.exp(t[0] + (t[1] - t[0]) * x[0] / (x[0] - x[1])))


def list_seconds(rule: str) -> tuple[float, ...]:
    """Lists the lengths of a rule's motions, [s]."""
    return LONG_SECONDS if rule.startswith("random") else SECONDS


def describe_motions(found: Mapping[str, Mapping[str, NDArray[Any]]], seconds: tuple[float, ...]) -> dict[str, Any]:
    """Summarises the results of all rules on one arm, for the lengths ``seconds``, [s]; repeats are the first axis.

    The floor is the smallest standard deviation that identification states, among lengths that all rules have.
    """
    rules: dict[str, Any] = {
        rule: {
            "said_sd_g": 1e3 * np.sqrt(np.mean(each["said"] ** 2, axis=0)),
            "rmse_g": 1e3 * np.sqrt(np.mean(each["rmse"] ** 2, axis=0)),
            "inside_90": float(each["inside"].mean()),
        }
        for rule, each in found.items()
    }
    shared = min(len(each["rmse_g"]) for each in rules.values())
    by_error, floors = {}, {}
    for key in ("said_sd_g", "rmse_g"):
        floors[key] = float(min(each[key][:shared].min() for each in rules.values()))
        by_error[key] = {
            rule: find_seconds(seconds[: len(each[key])], each[key], floors[key]) for rule, each in rules.items()
        }
    said = by_error["said_sd_g"]
    own = found["stated"]
    return {
        "seconds": list(seconds),
        "rules": rules,
        "floor_g": floors["said_sd_g"],
        "seconds_to_floor": said,
        "seconds_to_floor_by_rmse": by_error["rmse_g"],
        "seconds_over_random": said["stated"] / said["random"],
        "largest_share_of_a_limit": max(each["excess"].max() for each in found.values()),
        "predicted_over_stated": float(np.mean(own["predicted"] / own["said"])),
    }
