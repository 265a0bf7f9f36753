"""Simulates recordings like a user's: a motion with an empty hand and with a load, with errors of real signals."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.identification.identify import Runs
from affordance.identification.recording.run import Run, RunDescription
from affordance.identification.settings import SignalKind
from affordance.plant.serial_chain import SerialChain
from affordance.robots.robot import Robot

_DURATION, _RATE = 12.0, 100.0  # [s], [Hz]
_HARMONICS, _BASE = 4, 0.1  # number of sines at each joint, and their lowest frequency, [Hz]
# Largest amplitude of a joint's motion, [rad], and largest fractions of the distance to its limits and of its
# velocity limit.
_AMPLITUDE, _SHARE = 0.6, 0.8


class Signals(NamedTuple):
    """Errors of a robot's joint signals."""

    kind: SignalKind  # kind of the signal
    gain_sd: float  # relative standard deviation of each joint's gain, drawn once per robot
    # Mean and standard deviation of friction as a fraction of the load, drawn once per robot.
    load_friction: tuple[float, float]
    # Standard deviations of Coulomb friction, viscous friction at 1 rad/s, and offset, as fractions of the joint's
    # torque limit.
    friction: tuple[float, float, float]
    noise_sd: float  # standard deviation of the error, as a fraction of the joint's torque limit
    agreement: float  # correlation time of the errors, [s]


# Errors of a Panda's torque sensors and of a UR10e's motors, from recordings (docs/decisions/0020-recorded-data.md):
# residuals are a few thousandths of the limit and correlated over a fifth of a second; gains are within 1 % (Panda)
# and 2 % (UR10e); motors lose 3 to 10 % of the load to friction.
TORQUE_SENSORS = Signals(SignalKind.JOINT_TORQUE, 0.01, (0.0, 0.0), (0.003, 0.003, 0.003), 0.002, 0.2)
MOTORS = Signals(SignalKind.MOTOR_TORQUE, 0.02, (0.06, 0.03), (0.02, 0.013, 0.007), 0.004, 0.2)


class Recorder(NamedTuple):
    """Simulated robot that records its own joint signals."""

    chain: SerialChain  # chain of the arm up to the hand
    tau_max: Array  # torque limits, (n,), [N m]
    signals: Signals  # errors of its signals
    gain: Array  # gain of each joint, (n,)
    load_friction: Array  # friction as a fraction of the load at each joint, (n,)
    motion: tuple[Array, Array, Array]  # angles, rates and accelerations along the motion, (N, n) each

    def record(self, pi: Array, rng: np.random.Generator, name: str) -> Runs:
        """Records the motion with an empty hand, and with a load that has the ten parameters pi, (10,)."""
        empty = self._record(np.zeros(10), rng, f"{name}, empty")
        return Runs(self._record(pi, rng, name), (empty,))

    def _record(self, pi: Array, rng: np.random.Generator, name: str) -> Run:
        q, v, vdot = self.motion
        n, signals = len(self.gain), self.signals
        load = self.chain.compute_link_regressors(q, v, vdot) @ self.chain.link_parameters.ravel()
        load = load + self.chain.compute_payload_regressors(q, v, vdot) @ pi
        coulomb, viscous, offset = np.outer(signals.friction, self.tau_max) * rng.standard_normal((3, n))
        torque = load + self.load_friction * np.abs(load) * np.sign(v) + coulomb * np.sign(v) + viscous * v + offset
        errors = draw_errors(len(q), n, signals.agreement * _RATE, rng)
        tau = self.gain * (torque + signals.noise_sd * self.tau_max * errors)
        description = RunDescription(self.chain.joint_names, signals.kind)
        return Run(name, description, np.arange(len(q)) / _RATE, q, tau, v=v)


def build_recorder(robot: Robot, signals: Signals, rng: np.random.Generator) -> Recorder:
    """Builds the recorder of a robot, with random gains and load friction, and a motion around its home posture."""
    n = len(robot.home)
    mean, sd = signals.load_friction
    return Recorder(
        chain=robot.chain,
        tau_max=robot.limits.tau_max,
        signals=signals,
        gain=1.0 + signals.gain_sd * rng.standard_normal(n),
        load_friction=np.maximum(mean + sd * rng.standard_normal(n), 0.0),
        motion=move(robot, rng),
    )


def move(robot: Robot, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Builds a motion of every joint around home, a sum of slow sines within limits: angles, rates, accelerations."""
    times = np.arange(0.0, _DURATION, 1.0 / _RATE)[:, None]
    limits = robot.limits
    room = np.minimum(robot.home - limits.q_lower, limits.q_upper - robot.home)
    omega = 2.0 * np.pi * _BASE * np.arange(1, _HARMONICS + 1)
    amplitudes = rng.standard_normal((2, _HARMONICS, len(robot.home))) / np.arange(1, _HARMONICS + 1)[:, None]
    q, v, vdot = (np.zeros((len(times), len(robot.home))) for _ in range(3))
    for a, b, w in zip(*amplitudes, omega, strict=True):
        s, c = np.sin(w * times), np.cos(w * times)
        q += a * s + b * c
        v += w * (a * c - b * s)
        vdot -= w**2 * (a * s + b * c)
    scale = np.minimum(_AMPLITUDE, _SHARE * room) / np.abs(q).max(axis=0)
    scale = np.minimum(scale, _SHARE * limits.v_max / np.abs(v).max(axis=0))
    return robot.home + scale * q, scale * v, scale * vdot


def draw_errors(num_rows: int, num_joints: int, agreement: float, rng: np.random.Generator) -> Array:
    """Draws unit-variance errors, (rows, joints), autocorrelated over a number of rows (first order)."""
    a = max(0.0, (agreement - 1.0) / (agreement + 1.0))
    errors = rng.standard_normal((num_rows, num_joints))
    for k in range(1, num_rows):
        errors[k] = a * errors[k - 1] + np.sqrt(1.0 - a * a) * errors[k]
    return errors
