"""Simulates wrist sensors at rest or in slow motion, and joint torques in held postures."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.extensions.payload.recording.run import Run, RunDescription, resample
from affordance.extensions.payload.settings import SignalKind
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.plant.serial_chain import SerialChain
from studies.payload.errors import UR_LIKE
from studies.payload.simulated import Factors, Recordings
from studies.payload.solids import CLASSES

WRIST = Path(__file__).with_name("wrist.urdf"), "sensor"
# Tool that is nearly symmetric about z, with its centre of mass half a millimetre off the axis.
SYMMETRIC = np.array([1.155, -6e-4, 3.5e-4, 0.055, 4e-3, 4e-3, 1e-3, 0.0, 0.0, 0.0])
_MASSES = (0.5, 3.0)  # smallest and largest mass in held postures, [kg]
_NUM_POSTURES = 30
# Home posture and rotations of the wrist from it, [rad]; SDs of a wrist sensor's errors, which are correlated over
# half a minute, and its offsets, [N] and [N m].
_HOME = np.array([3.14, 0.79, 3.14])
_TURNS = np.array(
    [[-0.25, 0, 0.4], [0.2, 0.15, 0.4], [0.25, -0.1, 0.4], [-0.2, -0.1, -0.6], [0.1, 0.15, -0.5], [0, 0.19, -0.25]]
)
_SLOW_ERRORS, _OFFSETS = [0.06, 0.15, 0.12, 8e-3, 3e-3, 3e-4], [-3.0, -4.7, -16.9, 1e-3, -0.058, 9e-3]


def draw_postures(num: int, num_joints: int, rng: np.random.Generator) -> Array:
    """Draws random joint angles, shape (num, num_joints), [rad]."""
    return rng.uniform(-1.5, 1.5, (num, num_joints))


def draw_errors(times: Array, num_channels: int, agreement: float, rng: np.random.Generator) -> Array:
    """Draws errors with unit variance and a correlation time, shape (N, num_channels).

    Args:
        times: Evenly spaced times, shape (N,), [s].
        num_channels: Number of channels, with independent errors.
        agreement: Integrated autocorrelation time of the first-order autoregression, [s]; 0 for white noise.
        rng: Random generator.
    """
    step = times[1] - times[0]
    # The integrated autocorrelation time is (1 + a) / (1 - a) samples.
    a = max(0.0, (agreement / step - 1.0) / (agreement / step + 1.0))
    white = rng.standard_normal((len(times), num_channels))
    errors: Array = np.empty_like(white)
    errors[0] = white[0]
    for k in range(1, len(times)):
        errors[k] = a * errors[k - 1] + np.sqrt(1.0 - a * a) * white[k]
    return errors


def generate_wrench(
    robot: SerialChain, q: Array, pi: Array, rng: np.random.Generator, tilt_deg: float = 1.0, gain_sd: float = 0.01
) -> Array:
    """Generates forces and moments of a sensor with offsets and gain errors on a tilted base.

    Args:
        robot: Arm up to the sensor.
        q: Postures, shape (N, n), [rad].
        pi: Inertial parameters of the load, shape (10,).
        rng: Random generator.
        tilt_deg: Tilt of the base, [deg].
        gain_sd: SD of each channel's gain, whose mean is 1.

    Returns: The signal, shape (N, 6), [N] and [N m].
    """
    tilt = Rotation.from_rotvec([np.radians(tilt_deg), 0.0, 0.0])
    true = robot.with_gravity(tilt.apply(robot.gravity_W))
    rest = np.zeros_like(q)
    wrench = true.compute_wrench_regressors(q, rest, rest)[:, [3, 4, 5, 0, 1, 2]] @ pi
    offset = np.concatenate([rng.normal(0.0, 5.0, 3), rng.normal(0.0, 0.3, 3)])
    noise = np.repeat([0.15, 0.01], 3) * rng.standard_normal(wrench.shape)
    signal: Array = wrench * (1.0 + rng.normal(0.0, gain_sd, 6)) + offset + noise
    return signal


def generate_torques(
    robot: SerialChain, q: Array, loads: tuple[Array, ...], rng: np.random.Generator
) -> tuple[Array, ...]:
    """Generates the torques of six joints with each load.

    Sensor offsets drift. Gains have errors of 1 % and link masses of 10 %.

    Args:
        robot: Arm with six joints.
        q: Postures, shape (N, 6), [rad].
        loads: Inertial parameters of each load, shape (10,) each.
        rng: Random generator.

    Returns: The torques with each load, shape (N, 6) each, [N m].
    """
    links = robot.link_parameters * (1.0 + 0.1 * rng.standard_normal((6, 1)))
    gain, rest = 1.0 + rng.normal(0.0, 0.01, 6), np.zeros_like(q)
    arm = robot.compute_link_regressors(q, rest, rest) @ links.ravel()
    Y = robot.compute_payload_regressors(q, rest, rest)
    noise = np.repeat([0.3, 0.1], 3)
    return tuple(
        gain * (arm + Y @ pi) + rng.normal(0.0, 0.1, 6) + noise * rng.standard_normal(arm.shape) for pi in loads
    )


def generate_slow_wrench(payload: Array, rng: np.random.Generator, late: float = 0.0) -> tuple[SerialChain, Run]:
    """Generates a wrist sensor's run in which the load moves slowly between six held postures.

    Args:
        payload: Inertial parameters of the load, shape (10,).
        rng: Random generator.
        late: Delay of forces and moments, [s].

    Returns: The wrist and its run of 174 s.
    """
    robot = load_robot(*WRIST)
    times = np.linspace(0.0, 173.9, 1740)
    q = np.tile(_HOME, (len(times), 1))
    for number, turn in enumerate(_TURNS):
        share = np.interp(times - 29.0 * number, [0.0, 9.0, 24.0, 29.0], [0.0, 1.0, 1.0, 0.0], left=0.0, right=0.0)
        q += (share**2 * (3.0 - 2.0 * share))[:, None] * turn
    rest = np.zeros_like(q)
    wrench = (robot.compute_wrench_regressors(q, rest, rest) @ payload)[:, [3, 4, 5, 0, 1, 2]]
    errors = np.array(_SLOW_ERRORS) * draw_errors(times, 6, 30.0, rng)
    signal: Array = resample(times - late, times, wrench) + np.array(_OFFSETS) + errors
    return robot, Run("slow", RunDescription(robot.joint_names, SignalKind.WRENCH), times, q, signal)


def hold(robot: SerialChain, q: Array, signal: Array, kind: SignalKind, name: str = "held") -> Run:
    """Builds a run of postures, (N, n), from the signal in each posture, (N, C)."""
    times = np.linspace(0.0, 0.5 * (len(q) - 1), len(q))
    return Run(name, RunDescription(robot.joint_names, kind, postures=True), times, q, signal)


def _draw_slow_wrist(solid: str, rng: np.random.Generator) -> Recordings:
    robot, run = generate_slow_wrench(SYMMETRIC, rng)
    return _record(robot, run, SYMMETRIC, solid)


def _draw_held_wrist(solid: str, rng: np.random.Generator, gain_sd: float) -> Recordings:
    robot, payload = load_robot(*WRIST), _draw_payload(solid, rng)
    q = draw_postures(_NUM_POSTURES, robot.num_joints, rng)
    wrench = generate_wrench(robot, q, payload, rng, gain_sd=gain_sd)
    return _record(robot, hold(robot, q, wrench, SignalKind.WRENCH), payload, solid)


def _draw_held_joints(solid: str, rng: np.random.Generator) -> Recordings:
    robot, payload = load_robot(UR_LIKE.robot, UR_LIKE.tip), _draw_payload(solid, rng)
    q = draw_postures(int(rng.integers(4, _NUM_POSTURES + 1)), robot.num_joints, rng)
    kind = SignalKind.JOINT_TORQUE
    empty, loaded = generate_torques(robot, q, (0.0 * payload, payload), rng)
    return _record(robot, hold(robot, q, loaded, kind), payload, solid, hold(robot, q, empty, kind, "empty"))


def _draw_payload(solid: str, rng: np.random.Generator) -> Array:
    payload = CLASSES[solid](rng)
    payload *= float(np.exp(rng.uniform(*np.log(_MASSES)))) / payload[0]
    return payload


def _record(robot: SerialChain, loaded: Run, truth: Array, solid: str, empty: Run | None = None) -> Recordings:
    length = float(loaded.times[-1])
    return Recordings(robot, empty, loaded, None, truth, Factors(solid, True, truth[0], length, 0.0, 0.0))


# Functions that simulate the recordings of a load, for each case.
AT_REST: Mapping[str, Callable[[str, np.random.Generator], Recordings]] = {
    "slow_wrist": _draw_slow_wrist,
    "wrist_1": partial(_draw_held_wrist, gain_sd=0.01),
    "wrist_3": partial(_draw_held_wrist, gain_sd=0.03),
    "held_joints": _draw_held_joints,
}
