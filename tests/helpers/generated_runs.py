"""Generated recordings of a six-joint robot with known truth: its file, its motion, and signals of its joints."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.evidence.joint_statistics import ChannelSamples, compute_statistics
from affordance.extensions.payload.evidence.payload_likelihood import ChannelPrior, PayloadLikelihood
from affordance.extensions.payload.posterior.log_cholesky import parameters_from_theta
from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.settings import SignalKind
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.plant.serial_chain import SerialChain
from studies.payload.at_rest import draw_errors

# Shoulder, elbow and wrist of an arm of a metre: place and axis of each joint, mass and centre of each link.
_JOINTS = (
    ("0 0 0.2", "0 0 1", 5.0, "0 0 0.05"),
    ("0 0.1 0", "0 1 0", 8.0, "0.25 0 0"),
    ("0.5 -0.1 0", "0 1 0", 3.0, "0.2 0 0"),
    ("0.45 0 0", "0 1 0", 1.5, "0 0.03 0"),
    ("0 0.1 0", "0 0 1", 1.2, "0 0 0.02"),
    ("0 0 -0.1", "1 0 0", 0.4, "0.03 0 0"),
)
# A body of 1.2 kg, some centimetres off the tip: theta of log_cholesky.
THETA = np.array([np.log(1.2), 0.03, -0.02, 0.08, *np.log([0.05, 0.04, 0.06]), 0.005, -0.003, 0.002])
PAYLOAD = parameters_from_theta(THETA)


def write_urdf(folder: Path, name: str = "robot.urdf") -> Path:
    """Writes the robot's file."""
    lines = ["<robot name='generated'>", "<link name='base'/>"]
    parent = "base"
    for i, (xyz, axis, mass, centre) in enumerate(_JOINTS, start=1):
        moments = f"ixx='{0.01 * mass}' iyy='{0.012 * mass}' izz='{0.008 * mass}' ixy='0' ixz='0' iyz='0'"
        limits = "lower='-6' upper='6' effort='100' velocity='5'"
        lines += [
            f"<link name='link_{i}'><inertial><mass value='{mass}'/><origin xyz='{centre}'/>"
            f"<inertia {moments}/></inertial></link>",
            f"<joint name='joint_{i}' type='revolute'><parent link='{parent}'/><child link='link_{i}'/>"
            f"<origin xyz='{xyz}'/><axis xyz='{axis}'/><limit {limits}/></joint>",
        ]
        parent = f"link_{i}"
    lines += [
        "<link name='flange'/>",
        f"<joint name='flange_joint' type='fixed'><parent link='{parent}'/><child link='flange'/>"
        "<origin xyz='0.08 0 0'/></joint>",
        "</robot>",
    ]
    path = folder / name
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def build_robot(folder: Path) -> SerialChain:
    """The robot."""
    return load_robot(write_urdf(folder), "flange")


@dataclass(frozen=True)
class Truth:
    """Parameters of a generated signal."""

    gain: float = 1.0  # gain of each joint
    load_friction: float = 0.0  # load friction mu of each joint
    # Coulomb friction, viscous friction and offset, times gain, [N m].
    friction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotor_inertia: float = 0.0  # inertia of each joint's rotor, felt at the joint, [kg m^2]
    noise_sd: float = 0.05  # standard deviation of the error, times gain, [N m]
    agreement: float = 0.3  # time over which errors agree, [s]; 0 for white noise
    file_error: float = 0.0  # relative difference of the links' inertias from those of the robot's file


def generate_run(
    robot: SerialChain,
    payload: Array | None,
    *,
    truth: Truth,
    rng: np.random.Generator,
    duration: float = 20.0,
    rate: float = 100.0,
    motion_seed: int = 0,
    speed: float = 1.0,
    start: float = 0.0,
    kind: SignalKind = SignalKind.JOINT_TORQUE,
    source: str = "generated",
) -> Run:
    """Generates a run; motions of one seed are the same, at a multiple of their usual speed."""
    times = np.arange(0.0, duration, 1.0 / rate)
    q, v, vdot = _move(robot.num_joints, times, motion_seed, speed)
    pi = np.zeros(10) if payload is None else payload
    description = RunDescription(robot.joint_names, kind)
    if kind is SignalKind.WRENCH:
        wrench = robot.compute_wrench_regressors(q, v, vdot) @ pi
        clean = wrench[:, [3, 4, 5, 0, 1, 2]]
        signal = clean + truth.friction[2] + truth.noise_sd * draw_errors(times, clean.shape[1], truth.agreement, rng)
        return Run(source, description, times + start, q, signal, v=v)
    links = robot.link_parameters * (1.0 + truth.file_error * np.random.default_rng(5).standard_normal((6, 1)))
    load = robot.compute_link_regressors(q, v, vdot) @ links.ravel()
    load = load + robot.compute_payload_regressors(q, v, vdot) @ pi
    coulomb, viscous, offset = truth.friction
    torque = load + truth.load_friction * np.abs(load) * np.sign(v)
    torque = torque + coulomb * np.sign(v) + viscous * v + offset + truth.rotor_inertia * vdot
    torque = torque + truth.noise_sd * draw_errors(times, robot.num_joints, truth.agreement, rng)
    return Run(source, description, times + start, q, truth.gain * torque, v=v)


def generate_pair(
    robot: SerialChain, rng: np.random.Generator, truth: Truth, payload: Array = PAYLOAD, **more: Any
) -> tuple[Run, Run]:
    """Generates runs of one motion, with an empty hand and with a payload."""
    empty, loaded = (generate_run(robot, pi, truth=truth, rng=rng, **more) for pi in (None, payload))
    return empty, loaded


def record(
    robot: SerialChain,
    rng: np.random.Generator,
    payload: Array | None,
    kind: SignalKind = SignalKind.CURRENT,
    **more: Any,
) -> Run:
    """Generates a run at 50 Hz, with gains, friction and errors of its kind."""
    truths = {
        SignalKind.CURRENT: Truth(gain=0.1, load_friction=0.05, friction=(1.0, 0.5, 0.2), noise_sd=0.1),
        SignalKind.WRENCH: Truth(noise_sd=0.3, friction=(0.0, 0.0, 4.0)),
    }
    truth = truths.get(kind, Truth(noise_sd=0.1))
    return generate_run(robot, payload, truth=truth, rng=rng, kind=kind, rate=50.0, **more)


def build_likelihood(Y: Array, signal: Array, variance: float, gain_sd: float = 0.0) -> PayloadLikelihood:
    """The likelihood of torques without friction, with regressors Y, (N, C, 10), and signals, (N, C)."""
    zero, num = np.zeros_like(signal), signal.shape[1]
    samples = ChannelSamples(Y, zero, zero, zero, zero, zero, signal, np.ones(signal.shape, dtype=bool))
    covariance = np.tile(np.diag([gain_sd**2, 0.0]), (num, 1, 1))
    no_friction = np.zeros((num, 3))
    prior = ChannelPrior(np.tile([1.0, 0.0], (num, 1)), covariance, no_friction, no_friction)
    return PayloadLikelihood(compute_statistics(samples, 10), prior, np.full(num, variance))


def rename(run: Run, **changes: object) -> Run:
    """The run with another description."""
    return replace(run, description=replace(run.description, **changes))  # type: ignore[arg-type]


def _move(num_joints: int, times: Array, seed: int, speed: float) -> tuple[Array, Array, Array]:
    """A sum of slow sines, as robots are moved for identification."""
    rng = np.random.default_rng(seed)
    q, v, vdot = (np.zeros((len(times), num_joints)) for _ in range(3))
    for harmonic in range(1, 5):
        omega = 2.0 * np.pi * 0.1 * speed * harmonic
        a, b = rng.normal(0.0, 0.5 / harmonic, (2, num_joints))
        s, c = np.sin(omega * times)[:, None], np.cos(omega * times)[:, None]
        q += a * s + b * c
        v += omega * (a * c - b * s)
        vdot -= omega**2 * (a * s + b * c)
    return q, v, vdot
