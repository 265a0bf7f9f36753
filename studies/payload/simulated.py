"""Simulates recordings of a known payload, with the errors in ``errors.py``.

The arm's links differ from its file. Gains, friction and offsets change in each run. Friction has a Stribeck effect
and increases with the load. Errors of neighbouring samples are correlated. A cable may pull at one of the last links.
The motion is a Fourier series around a home posture.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.paired_runs import pair_runs
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.posterior.calibration import calibrate_gains
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief
from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.plant.serial_chain import SerialChain
from studies.payload.errors import (
    ANGLE_NOISE,
    CABLE_MASS,
    CABLE_PULL,
    CABLE_SHARE,
    FRICTION_CHANGE,
    LENGTHS,
    LINK_ERROR,
    LINK_LENGTH,
    PAIRED,
    SCALE_ERROR,
    SPEED_NOISE,
    SPEEDS,
    STRIBECK_SHARE,
    STRIBECK_SPEED,
    WHITE_SHARE,
    ArmErrors,
)
from studies.payload.solids import CLASSES

_RATE = 100.0  # [Hz]
_GRAVITY = 9.81
_NUM_HARMONICS = 5
_AMPLITUDES = (0.3, 0.9)  # range of a joint's RMS angle about home, before limits are applied, [rad]
_MARGIN = 0.1  # distance of motions from the limits in the robot's file, [rad]
_SMOOTH = 0.01  # range of speeds over which friction reverses, [rad/s]
# Rest before and after a motion, time of acceleration, and part of the first rest that is missing in the loaded run,
# [s].
_REST, _RAMP, _MISSED = 0.5, 1.0, (0.0, 0.3)
# Load for calibrating the gains of currents, [kg], its distance from the flange, [m], and duration, [s], and speed,
# [rad/s], of the pair of runs.
_WEIGHED, _AWAY, _WEIGHED_LENGTH, _WEIGHED_SPEED = 3.0, 0.06, 30.0, 0.4


class Factors(NamedTuple):
    """Random factors of one load."""

    solid: str  # class of solids
    paired: bool  # True if the loaded run repeats the empty run
    mass: float  # [kg]
    length: float  # duration of the loaded run, [s]
    speed: float  # root mean square speed of a joint, [rad/s]
    cable: float  # mass of the cable in the loaded run, [kg]


class Recordings(NamedTuple):
    """Recordings of one load."""

    robot: SerialChain  # arm according to its file
    empty: Run | None
    loaded: Run
    gains: Gains | None  # gains calibrated with a weighed load; None for torque sensors
    truth: Array  # true inertial parameters at the tip, shape (10,)
    factors: Factors

    def identify(self, settings: IdentificationSettings) -> PayloadBelief:
        """Identifies the load."""
        runs = Runs(self.loaded, () if self.empty is None else (self.empty,))
        return identify(self.robot, runs, paired=self.factors.paired, gains=self.gains, settings=settings)


@dataclass(frozen=True)
class SimulatedArm:
    """True arm: links, friction and sensors."""

    errors: ArmErrors
    robot: SerialChain  # arm according to its file
    links: Array  # true parameters of the links, shape (n, 10)
    friction: Array  # Coulomb and viscous friction before changes between runs, shape (n, 2), [N m]
    load_friction: Array  # fraction of the load lost to friction at each joint, shape (n,)
    gain: Array  # gains in this session, shape (n,), [unit of the signal per N m]
    agreement: float  # time constant of the errors, [s]

    @classmethod
    def draw(cls, errors: ArmErrors, robot: SerialChain, rng: np.random.Generator) -> "SimulatedArm":
        """Draws the links, friction and sensors of a true arm."""
        n = robot.num_joints
        links = robot.link_parameters * (1.0 + LINK_ERROR * rng.standard_normal((n, 1)))
        links[:, 1:4] += LINK_ERROR * LINK_LENGTH * links[:, :1] * rng.standard_normal((n, 3))
        friction = np.column_stack([errors.coulomb, errors.viscous]) * np.exp(0.2 * rng.standard_normal((n, 2)))
        scale = 1.0 + errors.scale_common * rng.standard_normal() + errors.scale_own * rng.standard_normal(n)
        return cls(
            errors,
            robot,
            links,
            friction,
            rng.uniform(*errors.load_friction, n),
            np.array(errors.signal_per_torque) * scale,
            float(rng.uniform(*errors.agreement)),
        )

    def warm(self, rng: np.random.Generator) -> "SimulatedArm":
        """Returns the arm in another session, with new gains."""
        errors, n = self.errors, self.robot.num_joints
        drift = 1.0 + errors.drift_common * rng.standard_normal() + errors.drift_own * rng.standard_normal(n)
        return replace(self, gain=self.gain * drift)

    def record(
        self,
        motion: "Motion",
        rng: np.random.Generator,
        *,
        source: str,
        payload: Array,
        cable: float = 0.0,
        start: float = 0.0,
    ) -> Run:
        """Records a motion from time ``start``, [s], with a payload, (10,), and a cable, [kg]."""
        errors, n = self.errors, self.robot.num_joints
        times = np.arange(round((motion.length + 2.0 * _REST - start) * _RATE)) / _RATE
        q, v, vdot = motion.evaluate(start + times)
        true = replace(self.robot, link_parameters=self.links)
        torque = true.compute_arm_torques(q, v, vdot) + true.compute_payload_regressors(q, v, vdot) @ payload
        if cable > 0.0:
            torque = torque + self._pull(q, v, vdot, cable, rng)
        change = 1.0 + FRICTION_CHANGE * rng.standard_normal(n)
        rise = 1.0 + STRIBECK_SHARE * np.exp(-((v / STRIBECK_SPEED) ** 2))
        direction = np.tanh(v / _SMOOTH)
        friction = change * (self.friction[:, 0] * rise * direction + self.friction[:, 1] * v)
        friction += self.load_friction * np.abs(torque) * direction
        rotors = np.array(errors.rotor_inertia) * vdot
        drift = 1.0 + errors.change_common * rng.standard_normal() + errors.change_own * rng.standard_normal(n)
        noise = np.array(errors.noise)
        left = noise * (self._draw_errors(len(times), rng) + WHITE_SHARE * rng.standard_normal((len(times), n)))
        offset = errors.offset * rng.standard_normal(n)
        nominal = np.array(errors.signal_per_torque)
        signal = self.gain * drift * (torque + friction + rotors) + nominal * (offset + left)
        description = RunDescription(self.robot.joint_names, errors.kind, tip=errors.tip)
        return Run(
            source,
            description,
            times,
            q + ANGLE_NOISE * rng.standard_normal(q.shape),
            signal,
            v=v + SPEED_NOISE * rng.standard_normal(q.shape),
        )

    def _draw_errors(self, num: int, rng: np.random.Generator) -> Array:
        """Draws errors of a first-order autoregression with unit SD, (num, n)."""
        share = np.exp(-1.0 / (_RATE * self.agreement))
        values = rng.standard_normal((num, self.robot.num_joints))
        values[1:] *= np.sqrt(1.0 - share**2)
        for i in range(1, num):
            values[i] += share * values[i - 1]
        return values

    def _pull(self, q: Array, v: Array, vdot: Array, cable: float, rng: np.random.Generator) -> Array:
        """Computes the torques, (N, n), due to weight and sideways pull of a cable at one of the last three links."""
        links = list(self.robot.compute_link_motions(q, v, vdot))
        angle = rng.uniform(0.0, 2.0 * np.pi)
        aside = CABLE_PULL * np.array([np.cos(angle), np.sin(angle), 0.0])
        force = cable * _GRAVITY * (np.array([0.0, 0.0, 1.0]) + aside)
        link = int(rng.integers(len(links) - 3, len(links)))
        torque = np.zeros_like(q)
        torque[:, : link + 1] = np.einsum("nkj,k->nj", links[link].Jv_V_WT[:, 3:], force)
        return torque


@dataclass(frozen=True)
class Motion:
    """Motion of all joints."""

    home: Array  # shape (n,), [rad]
    sine: Array  # coefficients, shape (harmonics, n), [rad]
    cosine: Array  # coefficients, shape (harmonics, n), [rad]
    base: float  # angular frequency of the first harmonic, [rad/s]
    length: float  # duration, [s]

    @classmethod
    def draw(
        cls, errors: ArmErrors, robot: SerialChain, length: float, speed: float, rng: np.random.Generator
    ) -> "Motion":
        """Draws a motion with a given RMS speed, [rad/s], within the limits of the robot's file."""
        n, home = robot.num_joints, np.array(errors.home)
        sine, cosine = rng.standard_normal((2, _NUM_HARMONICS, n)) / np.arange(1, _NUM_HARMONICS + 1)[:, None]
        size = np.sqrt(0.5 * (sine**2 + cosine**2).sum(axis=0))
        scale = rng.uniform(*_AMPLITUDES, n) / size
        phase = np.linspace(0.0, 2.0 * np.pi, 400)[:, None] * np.arange(1, _NUM_HARMONICS + 1)
        reach = np.abs(np.sin(phase) @ (sine * scale) + np.cos(phase) @ (cosine * scale)).max(axis=0)
        low, high = robot.limits
        scale *= np.minimum(1.0, (np.minimum(home - low, high - home) - _MARGIN) / reach)
        sine, cosine = sine * scale, cosine * scale
        order = np.arange(1, _NUM_HARMONICS + 1)[:, None]
        of_unit = np.sqrt(0.5 * (order**2 * (sine**2 + cosine**2)).sum(axis=0).mean())
        return cls(home, sine, cosine, speed / float(of_unit), length)

    def evaluate(self, times: Array) -> tuple[Array, Array, Array]:
        """Computes angles, velocities and accelerations, (N, n) each."""
        phase, rate, change = self._advance(times)
        w = self.base * np.arange(1, _NUM_HARMONICS + 1)
        s, c = np.sin(phase[:, None] * w), np.cos(phase[:, None] * w)
        q = self.home + s @ self.sine + c @ self.cosine
        first = (w * c) @ self.sine - (w * s) @ self.cosine
        second = -(w**2 * s) @ self.sine - (w**2 * c) @ self.cosine
        return q, first * rate[:, None], second * rate[:, None] ** 2 + first * change[:, None]

    def _advance(self, times: Array) -> tuple[Array, Array, Array]:
        """Computes the phase of the series, [s], and its first two derivatives, from rest to rest."""
        middle = self.length - _RAMP  # duration of the same motion without ramps

        def ramp(x: Array) -> tuple[Array, Array, Array]:
            x = np.clip(x / _RAMP, 0.0, 1.0)
            return _RAMP * (x**3 - 0.5 * x**4), 3.0 * x**2 - 2.0 * x**3, 6.0 * (x - x**2) / _RAMP

        t = times - _REST
        up, down = ramp(t), ramp(self.length - t)
        between = np.clip(t - _RAMP, 0.0, middle - _RAMP)
        phase = up[0] + between + 0.5 * _RAMP - down[0]
        return phase, np.minimum(up[1], down[1]), up[2] - down[2]


def simulate(errors: ArmErrors, solid: str, rng: np.random.Generator, share_paired: float = PAIRED) -> Recordings:
    """Simulates the recordings of one load from a class of solids, with random factors.

    Args:
        errors: Sizes of the arm's errors.
        solid: Class of solids, a key of ``CLASSES``.
        rng: Random generator.
        share_paired: Probability that the loaded run repeats the empty run.
    """
    robot = load_robot(errors.robot, errors.tip)
    mass, length, speed = (_draw_log_uniform(rng, bounds) for bounds in (errors.masses, LENGTHS, SPEEDS))
    paired = bool(rng.random() < share_paired)
    cable = float(abs(CABLE_MASS * rng.standard_normal())) if rng.random() < CABLE_SHARE else 0.0
    payload = CLASSES[solid](rng)
    payload *= mass / payload[0]
    arm = SimulatedArm.draw(errors, robot, rng)
    gains = _weigh(arm, rng) if errors.kind is SignalKind.CURRENT else None
    arm = arm.warm(rng)
    motion = Motion.draw(errors, robot, length, speed, rng)
    other = motion if paired else Motion.draw(errors, robot, _draw_log_uniform(rng, LENGTHS), speed, rng)
    empty = arm.record(other, rng, source="empty", payload=np.zeros(10))
    start = rng.uniform(*_MISSED) if paired else 0.0
    loaded = arm.record(motion, rng, source="loaded", payload=payload, cable=cable, start=start)
    return Recordings(robot, empty, loaded, gains, payload, Factors(solid, paired, mass, length, speed, cable))


def _weigh(arm: SimulatedArm, rng: np.random.Generator) -> Gains:
    """Estimates the gains of currents from a pair of runs with a weighed load on the day before."""
    motion = Motion.draw(arm.errors, arm.robot, _WEIGHED_LENGTH, _WEIGHED_SPEED, rng)
    payload = _WEIGHED * np.array([1.0, 0.0, 0.0, _AWAY, *[2.0 * _AWAY**2] * 3, 0.0, 0.0, 0.0])
    empty = arm.record(motion, rng, source="weighed, empty", payload=np.zeros(10))
    loaded = arm.record(motion, rng, source="weighed", payload=payload)
    evidence = pair_runs(arm.robot, empty, loaded, DEFAULT_SETTINGS)
    by_scale = _WEIGHED * (1.0 + SCALE_ERROR * rng.standard_normal())
    gains = calibrate_gains(evidence, by_scale, DEFAULT_SETTINGS)
    return replace(gains, robot=arm.robot.fingerprint)


def _draw_log_uniform(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(*np.log(bounds))))
