"""Plans motions within an arm's limits: Fourier series, and postures with slow sweeps.

All motions start and end at rest. Limits of angle, velocity and acceleration are respected by construction; limits of
torque and of the tip are checked. Collisions are not checked, because the surroundings are unknown.
"""

import abc
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, override

import numpy as np
from scipy.linalg import null_space

from affordance.arrays import Array
from affordance.extensions.payload.recording.preparation import PreparedRun
from affordance.plant.arm import JointLimits
from affordance.plant.serial_chain import ChainDynamics, ChainMotion, SerialChain

# Usable share of each limit, because limits are checked at samples only.
_USED = 0.95
# Number of harmonics, and least number of samples of a motion: sixteen per period of the highest harmonic.
_TERMS, _FEWEST = 5, 80
_RATE, _WAY_RATE = 10.0, 50.0  # sampling rates for comparing motions, and for the ways to and from them, [Hz]
# Mean speed of a sweep, [rad/s], at which the direction of friction is certain, and its shortest duration, [s].
_SWEEP_SPEED, _SHORTEST = 0.1, 0.2
_PEAK_V, _PEAK_VDOT = 1.875, 10.0 / np.sqrt(3.0)  # peak rate and acceleration of a minimum-jerk move by 1 rad in 1 s
_WAY_SAMPLES = 50  # number of points of a straight path at which the tip's height is checked
_TRIALS = 4  # number of attempts to slow a motion down to the tip's speed limit


class MotionLimits(NamedTuple):
    """Limits of a motion."""

    q_lower: Array  # least joint angles, shape (n,), finite, [rad]
    q_upper: Array  # largest joint angles, shape (n,), finite, [rad]
    v_max: Array  # bound of |v|, shape (n,), [rad/s]
    vdot_max: Array  # bound of |vdot|, shape (n,), [rad/s^2]
    tau_max: Array  # bound of |tau|, shape (n,), [N m]
    tip_speed: float = np.inf  # bound of the tip's speed, [m/s]
    height: float = -np.inf  # least height of the tip in the base frame, [m]

    @classmethod
    def around(
        cls,
        home: Array,
        joints: JointLimits,
        *,
        reach: float,
        acceleration: float | Array,
        tip_speed: float,
        height: float,
    ) -> "MotionLimits":
        """Builds the limits of motions within a distance ``reach`` of home, [rad], and within the joint limits.

        The other arguments are described as attributes.
        """
        return cls(
            np.maximum(joints.q_lower, home - reach),
            np.minimum(joints.q_upper, home + reach),
            joints.v_max,
            np.broadcast_to(acceleration, home.shape),
            joints.tau_max,
            tip_speed,
            height,
        )

    def compute_excess(
        self, robot: SerialChain, motion: PreparedRun, bodies: Array, dynamics: ChainDynamics | None = None
    ) -> float:
        """Computes the largest fraction of any limit that a motion uses, for the worst of the bodies, (K, 10).

        A value above 1 exceeds a limit. For the tip's least height the value is 1 minus the height above it in
        metres. The dynamics of the motion are computed if not given.
        """
        q, v, vdot = motion.motion
        tip, arm, Y = dynamics or robot.compute_dynamics(q, v, vdot)
        middle, half = 0.5 * (self.q_upper + self.q_lower), 0.5 * (self.q_upper - self.q_lower)
        shares = [
            np.abs(q - middle) / half,
            np.abs(v) / self.v_max,
            np.abs(vdot) / self.vdot_max,
            np.max([np.abs(arm + Y @ pi) for pi in bodies], axis=0) / self.tau_max,
        ]
        of_tip = _compute_speed(tip, v) / self.tip_speed, 1.0 - float(tip.p_WT[:, 2].min() - self.height)
        return max(*(float(each.max()) for each in shares), *of_tip)


def compute_tip_speed(robot: SerialChain, motion: PreparedRun) -> float:
    """Computes the largest speed of the tip during a motion, [m/s]."""
    return _compute_speed(robot.compute_motion(*motion.motion), motion.v)


def _compute_speed(tip: ChainMotion, v: Array) -> float:
    return float(np.linalg.norm(np.einsum("nij,nj->ni", tip.Jv_V_WT[:, 3:], v), axis=1).max())


@dataclass(frozen=True)
class MotionFamily(abc.ABC):
    """Motions of equal duration, [s], within the arm's limits, each parametrised by a vector of numbers."""

    robot: SerialChain
    limits: MotionLimits
    duration: float

    @abc.abstractmethod
    def draw(self, rng: np.random.Generator) -> Array:
        """Draws the numbers of a random motion."""

    @abc.abstractmethod
    def build(self, numbers: Array, times: Array) -> PreparedRun | None:
        """Builds a motion at given times, [s], (N,). Returns None if the duration is too short."""


def list_times(duration: float, rate: float = _RATE) -> Array:
    """Computes evenly spaced times from 0 to the duration, [s].

    There are at least sixteen per period of the highest harmonic.
    """
    return np.linspace(0.0, duration, max(_FEWEST, round(duration * rate)) + 1)


def plan_way(robot: SerialChain, limits: MotionLimits, start: Array, end: Array) -> PreparedRun:
    """Plans a minimum-jerk move from rest to rest, straight in joint space.

    The move respects limits of speed and acceleration. Torques and collisions are not checked. Start and end have
    shape (n,), [rad].
    """
    step = end - start
    duration = max(
        float((_PEAK_V * np.abs(step) / (_USED * limits.v_max)).max()),
        float(np.sqrt(_PEAK_VDOT * np.abs(step) / (_USED * limits.vdot_max)).max()),
        1.0,
    )
    while True:
        times = np.linspace(0.0, duration, max(2, round(duration * _WAY_RATE)) + 1)
        motion = _move(times, (times / duration)[:, None], start, step, duration)
        over = compute_tip_speed(robot, motion) / (_USED * limits.tip_speed)
        if over <= 1.0:
            return motion
        duration *= 1.02 * over


def compute_lowest(robot: SerialChain, home: Array, ends: Array) -> float:
    """Computes the tip's least height on straight joint-space paths from home to each end, (K, n), [rad]."""
    share = np.linspace(0.0, 1.0, _WAY_SAMPLES)[:, None, None]
    paths = (home + share * (ends - home)).reshape(-1, len(home))
    return float(robot.compute_positions(paths, np.zeros(3))[:, 2].min())


def to_motion(times: Array, q: Array, v: Array, vdot: Array) -> PreparedRun:
    """Builds a motion without a signal from q, v and vdot, shape (N, n) each."""
    return PreparedRun(times, q, v, vdot, np.zeros_like(q), 0.0)


@dataclass(frozen=True)
class FourierFamily(MotionFamily):
    """Fourier series with five harmonics, from rest to rest, with equal first and last posture.

    Each joint's motion has ten numbers. Eight define its shape, which is scaled to the limits. The ninth is the used
    fraction of this scale, and the tenth the position within the remaining range of angles, both from 0 to 1.
    """

    @cached_property
    def _basis(self) -> Array:
        """Combinations of sines and cosines with zero velocity and acceleration at the start, shape (2 terms, 8)."""
        k = np.arange(1, _TERMS + 1)
        rest = np.zeros((2, 2 * _TERMS))
        rest[0, :_TERMS], rest[1, _TERMS:] = k, k**2
        return null_space(rest)

    @override
    def draw(self, rng: np.random.Generator) -> Array:
        """Draws the numbers of a motion that fully uses the limits, shape (10 n,)."""
        n, size = self.robot.num_joints, self._basis.shape[1]
        return np.concatenate([rng.standard_normal((n, size)), np.ones((n, 1)), rng.uniform(size=(n, 1))], 1).ravel()

    @override
    def build(self, numbers: Array, times: Array) -> PreparedRun | None:
        """Builds a motion at given times, [s], (N,), slowed down to the tip's speed limit."""
        table = numbers.reshape(self.robot.num_joints, -1)
        share, place = np.clip(table[:, -2], 0.0, 1.0), np.clip(table[:, -1], 0.0, 1.0)
        a, b = np.split(self._basis @ table[:, :-2].T, 2)
        shape = self._sum(a, b, list_times(self.duration))
        scale = share * np.min(
            [
                _USED * (self.limits.q_upper - self.limits.q_lower) / np.ptp(shape.q, axis=0),
                _USED * self.limits.v_max / np.abs(shape.v).max(axis=0),
                _USED * self.limits.vdot_max / np.abs(shape.vdot).max(axis=0),
            ],
            axis=0,
        )
        for _ in range(_TRIALS):
            low, high = scale * shape.q.min(axis=0), scale * shape.q.max(axis=0)
            edge = 0.5 * (1.0 / _USED - 1.0) * (high - low)
            free = (self.limits.q_upper - self.limits.q_lower) - (high - low) - 2.0 * edge
            centre = self.limits.q_lower + edge - low + place * free
            motion = to_motion(shape.times, centre + scale * shape.q, scale * shape.v, scale * shape.vdot)
            over = compute_tip_speed(self.robot, motion) / (_USED * self.limits.tip_speed)
            if over <= 1.0:
                at = self._sum(scale * a, scale * b, times)
                return at._replace(q=centre + at.q)
            scale = scale * 0.98 / over
        return None

    def _sum(self, a: Array, b: Array, times: Array) -> PreparedRun:
        """Evaluates a Fourier series with sine and cosine coefficients, shape (terms, n) each."""
        w = 2.0 * np.pi / self.duration * np.arange(1, _TERMS + 1)
        s, c = np.sin(np.outer(times, w)), np.cos(np.outer(times, w))
        return to_motion(times, s @ a + c @ b, (w * c) @ a - (w * s) @ b, -(w**2 * s) @ a - (w**2 * c) @ b)


@dataclass(frozen=True)
class PostureFamily(MotionFamily):
    """Visits to postures with a slow sweep at each, so that friction acts in both directions.

    The numbers are the angles of the postures as fractions of their ranges. The moves between postures have minimum
    jerk and are as fast as the limits allow. Sweeps take the remaining time.
    """

    num_postures: int

    @override
    def draw(self, rng: np.random.Generator) -> Array:
        """Draws the numbers of random postures, close together or far apart, shape (postures n,)."""
        n = self.robot.num_joints
        centre, spread = rng.uniform(size=n), rng.uniform()
        postures = centre + spread * (rng.uniform(size=(self.num_postures, n)) - centre)
        return np.asarray(postures.ravel())

    @override
    def build(self, numbers: Array, times: Array) -> PreparedRun | None:
        """Builds a motion at given times, [s], (N,). Returns None if the moves alone take too long."""
        limits, num = self.limits, self.num_postures
        widest = 0.5 * _SWEEP_SPEED * self.duration / (2 * num)
        half = np.minimum(widest, 0.25 * (limits.q_upper - limits.q_lower))
        margin = half + 0.5 * (1.0 - _USED) * (limits.q_upper - limits.q_lower - 2.0 * half)
        share = np.clip(numbers.reshape(num, -1), 0.0, 1.0)
        postures = limits.q_lower + margin + share * (limits.q_upper - limits.q_lower - 2.0 * margin)
        distance = np.abs(np.diff(postures, axis=0)) + 2.0 * half
        slowest = np.maximum(
            _PEAK_V * distance / (_USED * limits.v_max),
            np.sqrt(_PEAK_VDOT * distance / (_USED * limits.vdot_max)),
        )
        moves = slowest.max(axis=1, initial=0.0)
        for _ in range(_TRIALS):
            sweep = (self.duration - moves.sum()) / (2 * num)
            if sweep < _SHORTEST:
                return None
            motion = self._visit(postures, moves, sweep, half, list_times(self.duration))
            over = compute_tip_speed(self.robot, motion) / (_USED * limits.tip_speed)
            if over <= 1.0:
                return self._visit(postures, moves, sweep, half, times)
            moves = 1.02 * over * moves
        return None

    def _visit(self, postures: Array, moves: Array, sweep: float, half: Array, times: Array) -> PreparedRun:
        """Builds a visit to postures, (K, n), with moves of given durations, (K - 1,), [s]."""
        swept = np.minimum(0.5 * _SWEEP_SPEED * sweep, half)
        points = (postures[:, None] + swept * np.array([-1.0, 1.0, -1.0])[None, :, None]).reshape(
            -1, postures.shape[1]
        )
        durations = np.insert(np.full(2 * len(postures), sweep), 2 * np.arange(1, len(postures)), moves)
        starts = np.concatenate([[0.0], np.cumsum(durations)])
        i = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, len(durations) - 1)
        length = durations[i][:, None]
        x = np.clip((times - starts[i])[:, None] / length, 0.0, 1.0)
        step = points[i + 1] - points[i]
        return _move(times, x, points[i], step, length)


def _move(times: Array, x: Array, start: Array, step: Array, duration: Array | float) -> PreparedRun:
    """Builds minimum-jerk moves at times, (N,), with elapsed fractions x of their duration, (N, 1)."""
    return to_motion(
        times,
        start + step * x**3 * (10.0 - 15.0 * x + 6.0 * x**2),
        step * 30.0 * x**2 * (1.0 - x) ** 2 / duration,
        step * 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / duration**2,
    )
