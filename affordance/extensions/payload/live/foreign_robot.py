"""Simulates a robot that moves, picks up and puts down objects, for demonstrations and tests.

This file imports nothing from the project and runs in a separate process. MuJoCo simulates one of two arms. The true
masses, centres of mass and inertias of the links, and the true gains and friction, differ from the robot's file. The
controller uses only the file. The true load is written to standard error, never to the stream.

    python foreign_robot.py fr3 --model fr3.xml
    python foreign_robot.py fr3 --script "move 5, pick 1.2, move 12, put, move 4" | affordance live fr3.xml ...
"""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

STEP, RATE = 1e-3, 250.0  # time step of the simulation, [s], and rate of the reports, [Hz]
_RADIUS = 0.08  # radius of balls whose moments of inertia the links have, [m]; makers publish none
_HARMONICS, _SLOWEST = np.arange(1, 6), 0.08  # harmonics of the motion, and its fundamental frequency, [Hz]
_ERROR = 0.05  # relative error of the links' masses in the file
_STOP, _GRIP, _GRIPPED = 0.6, 0.8, 0.3  # time to stop, to move the fingers, and to grip an object, [s]


@dataclass(frozen=True)
class Arm:
    """Arm with published parameters."""

    joints: tuple[str, ...]
    signal: str  # kind of the reported signal, as in a description
    place: tuple[
        tuple[float, float, float, float], ...
    ]  # position of each joint in the preceding link, [m], and rotation about x, [deg]
    flange: tuple[float, float, float, float]
    links: tuple[tuple[float, float, float, float], ...]  # mass, [kg], and centre of mass, [m], per link
    home: tuple[float, ...]
    span: tuple[float, ...]  # largest distance from home, [rad]
    coulomb: tuple[float, ...]  # friction, [N m]
    viscous: tuple[float, ...]  # [N m s]
    rotor: tuple[float, ...]  # rotor inertia reflected to the joints, [kg m^2]
    stiffness: tuple[float, ...]  # controller stiffness, [N m/rad]
    gain: tuple[float, ...]  # signal per torque
    load_friction: float
    gain_sd: float
    offset_sd: float
    noise: float
    quantum: float  # resolution of the reported signal


ARMS = {
    # Kinematics: Franka's table of Denavit-Hartenberg parameters (Craig's form). Masses and centres of mass: Gaz,
    # Cognetti, Oliva, Robuffo Giordano and De Luca 2019, IEEE RA-L 4:4147-4154. Reports link-side torques.
    "fr3": Arm(
        tuple(f"fr3_joint{i}" for i in range(1, 8)),
        "joint_torque",
        (
            (0, 0, 0.333, 0),
            (0, 0, 0, -90),
            (0, -0.316, 0, 90),
            (0.0825, 0, 0, 90),
            (-0.0825, 0.384, 0, -90),
            (0, 0, 0, 90),
            (0.088, 0, 0, 90),
        ),
        (0, 0, 0.107, 0),
        (
            (4.970684, 0.003875, 0.002081, -0.04762),
            (0.646926, -0.003141, -0.02872, 0.003495),
            (3.228604, 0.027518, 0.039252, -0.066502),
            (3.587895, -0.05317, 0.104419, 0.027454),
            (1.225946, -0.011953, 0.041065, -0.038437),
            (1.666555, 0.060149, -0.014117, -0.010517),
            (0.735522, 0.010517, -0.004252, 0.061597),
        ),
        (0, -0.2, 0, -1.9, 0, 1.9, 0.6),
        (0.5, 0.4, 0.5, 0.4, 0.7, 0.6, 0.9),
        (0.5, 0.5, 0.4, 0.4, 0.3, 0.3, 0.2),
        (1.0,) * 7,
        (0.1,) * 7,
        (900.0, 900.0, 900.0, 900.0, 400.0, 400.0, 400.0),
        (1.0,) * 7,
        load_friction=0.0,
        gain_sd=0.01,
        offset_sd=0.2,
        noise=0.08,
        quantum=0.005,
    ),
    # Kinematics, masses and centres of mass: Universal Robots, "DH parameters for calculations of kinematics and
    # dynamics". Gains, friction and rotors: of the size found for a UR10e, scaled. Reports motor currents.
    "ur5e": Arm(
        (
            "shoulder_pan_joint",
            "shoulder_lift_joint",
            "elbow_joint",
            "wrist_1_joint",
            "wrist_2_joint",
            "wrist_3_joint",
        ),
        "current",
        (
            (0, 0, 0, 0),
            (0, 0, 0.1625, 90),
            (-0.425, 0, 0, 0),
            (-0.3922, 0, 0, 0),
            (0, 0, 0.1333, 90),
            (0, 0, 0.0997, -90),
        ),
        (0, 0, 0.0996, 0),
        (
            (3.761, 0, -0.00193, 0.13689),
            (8.058, -0.2125, 0, 0.11336),
            (2.846, -0.2422, 0, 0.0265),
            (1.37, 0, -0.01634, 0.1315),
            (1.3, 0, 0.01634, 0.1015),
            (0.365, 0, 0, 0.09844),
        ),
        (0, -1.3, 1.5, -1.5, -1.2, 0.3),
        (0.6, 0.5, 0.5, 0.7, 0.8, 1.0),
        (7.0, 7.0, 5.0, 1.6, 1.6, 1.3),
        (8.0, 9.0, 6.0, 1.2, 1.2, 1.0),
        (1.0, 1.0, 1.0, 0.3, 0.3, 0.3),
        (3000.0, 3000.0, 3000.0, 800.0, 800.0, 800.0),
        (0.085, 0.085, 0.09, 0.115, 0.115, 0.12),
        load_friction=0.06,
        gain_sd=0.08,
        offset_sd=0.03,
        noise=0.04,
        quantum=0.01,
    ),
}


@dataclass(frozen=True)
class Sample:
    """Report of the robot: time stamp, [s], joint angles, velocities and signal."""

    time: float
    q: np.ndarray
    v: np.ndarray
    signal: np.ndarray


@dataclass(frozen=True)
class Truth:
    """True load from a time on: mass, [kg], and centre of mass at the flange, [m]."""

    time: float
    mark: str
    mass: float
    com: np.ndarray


def write_model(name: str) -> str:
    """Writes the robot's file as an MJCF model with the site ``flange``, which carries the payload."""
    arm, lines, pad = ARMS[name], [], "  "
    for joint, place, (mass, *centre) in zip(arm.joints, arm.place, arm.links, strict=True):
        moment = 0.4 * mass * _RADIUS**2
        lines += [
            f'{pad}<body name="{joint}_link" {_place(place)}>',
            f'{pad}  <joint name="{joint}" axis="0 0 1" range="-6.28 6.28"/>',
            f'{pad}  <inertial pos="{_list(centre)}" mass="{mass}" diaginertia="{_list([moment] * 3)}"/>',
        ]
        pad += "  "
    lines.append(f'{pad}<site name="flange" {_place(arm.flange)}/>')
    lines += [f"{pad[: -2 * (i + 1)]}</body>" for i in range(len(arm.joints))]
    body = "\n".join(lines)
    head = f'<mujoco model="{name}">\n<compiler angle="radian" autolimits="true"/>\n<worldbody>'
    return f"{head}\n{body}\n</worldbody>\n</mujoco>\n"


def _list(values: Any) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _place(place: tuple[float, float, float, float]) -> str:
    half = np.deg2rad(place[3]) / 2.0
    return f'pos="{_list(place[:3])}" quat="{_list([np.cos(half), np.sin(half), 0, 0])}"'


class _Motion:
    """Fourier motion about the home posture, which can be slowed down to a stop."""

    def __init__(self, arm: Arm, rng: np.random.Generator) -> None:
        self._home, self._w = np.array(arm.home), 2.0 * np.pi * _SLOWEST * _HARMONICS
        A, B = rng.normal(size=(2, len(arm.home), len(_HARMONICS))) / np.sqrt(_HARMONICS)
        phase = np.linspace(0.0, 1.0 / _SLOWEST, 400)[:, None] * self._w
        size = np.abs(np.cos(phase) @ A.T + np.sin(phase) @ B.T).max(axis=0)
        self._A, self._B = ((np.array(arm.span) / size)[:, None] * each for each in (A, B))

    def at(self, phase: float, speed: float, change: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Computes angles, velocities and accelerations at a phase, given its two time derivatives."""
        c, s, w = np.cos(phase * self._w), np.sin(phase * self._w), self._w
        first = self._B @ (w * c) - self._A @ (w * s)
        second = -(self._A @ (w**2 * c) + self._B @ (w**2 * s))
        return self._home + self._A @ c + self._B @ s, first * speed, second * speed**2 + first * change


def _draw_body(rng: np.random.Generator, mass: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Draws a box in front of the flange. Returns its mass, centre of mass, and moments about the latter."""
    size = np.array([0.04, 0.04, 0.06]) * rng.uniform(0.6, 1.6, 3) * mass ** (1.0 / 3.0)
    centre = np.array([*rng.uniform(-0.03, 0.03, 2), rng.uniform(0.03, 0.12)])
    return mass, centre, mass / 3.0 * ((size**2).sum() - size**2)


def simulate(name: str, script: str, seed: int, arm_seed: int = 7) -> Iterator[Sample | Truth]:
    """Simulates the robot while it follows a script. Yields its reports and true loads.

    Args:
        name: Name of the arm.
        script: Steps such as "hold 2.5, move 10, pick 2.0, move 30, put, move 10", with times, [s], and masses, [kg].
        seed: Seed of the motion, the noise, the friction of this run and the held body.
        arm_seed: Seed of the differences between the arm and its file.
    """
    import mujoco

    arm, rng, own = ARMS[name], np.random.default_rng([1, seed]), np.random.default_rng([2, arm_seed])
    spec = mujoco.MjSpec.from_string(write_model(name))
    site = spec.sites[0]
    held = site.parent.add_body(name="payload", pos=site.pos, quat=site.quat)
    nothing = (1e-6, np.zeros(3), np.full(3, 1e-9))
    held.mass, held.inertia, held.explicitinertial = nothing[0], nothing[2], True
    model, nominal, n = spec.compile(), spec.compile(), len(arm.joints)
    for each in (model, nominal):
        each.opt.timestep, each.jnt_limited[:] = STEP, 0
        each.dof_armature[:] = arm.rotor
    payload = model.body("payload").id
    for link in range(1, payload):  # the true arm differs from its file
        factor = 1.0 + _ERROR * own.normal()
        model.body_mass[link] *= factor
        model.body_inertia[link] *= factor * (1.0 + _ERROR * abs(own.normal()))
        model.body_ipos[link] += 0.1 * _ERROR * own.normal(size=3)
    data, plan = mujoco.MjData(model), mujoco.MjData(nominal)
    gain = np.array(arm.gain) * (1.0 + arm.gain_sd * own.normal(size=n)) * (1.0 + 0.003 * rng.normal(size=n))
    offset, today = arm.offset_sd * own.normal(size=n), 1.0 + 0.03 * rng.normal(size=n)
    coulomb, viscous = today * np.array(arm.coulomb), today * np.array(arm.viscous)
    motion, every, count = _Motion(arm, rng), round(1.0 / (RATE * STEP)), 0
    phase = speed = t = 0.0
    data.qpos[:] = motion.at(0.0, 0.0, 0.0)[0]

    def set_body(body: tuple[float, np.ndarray, np.ndarray]) -> None:
        model.body_mass[payload], model.body_ipos[payload], model.body_inertia[payload] = body

    for item in script.split(","):
        word, *value = item.split()
        body = _draw_body(rng, float(value[0])) if word in ("pick", "hold") else nothing
        if word == "hold":
            set_body(body)
            yield Truth(t, word, *body[:2])
            continue
        stages = [(1.0, float(value[0]))] if word == "move" else [(0.0, _STOP), (0.0, _GRIP)]
        for stage, (goal, length) in enumerate(stages):
            for k in range(round(length / STEP)):
                if stage == 1 and k == round(_GRIPPED / STEP):
                    set_body(body)
                    yield Truth(t, word, *body[:2])
                change = float(np.clip((goal - speed) / 0.15, -2.5, 2.5))
                speed, phase = speed + change * STEP, phase + speed * STEP
                q, v, vdot = motion.at(phase, speed, change)
                plan.qpos[:], plan.qvel[:], plan.qacc[:] = data.qpos, data.qvel, vdot + 20.0 * (v - data.qvel)
                mujoco.mj_inverse(nominal, plan)
                torque = plan.qfrc_inverse + np.array(arm.stiffness) * (q - data.qpos)
                friction = (coulomb + arm.load_friction * np.abs(data.qfrc_bias)) * np.tanh(data.qvel / 0.005)
                friction += viscous * data.qvel
                motor = torque + 0.9 * friction  # the controller compensates most of the friction
                data.qfrc_applied[:] = motor - friction
                mujoco.mj_step(model, data)
                t, count = t + STEP, count + 1
                if count % every == 0:
                    true = motor
                    if arm.signal == "joint_torque":
                        true = motor - friction - np.array(arm.rotor) * data.qacc
                    signal = gain * true + offset + arm.noise * rng.normal(size=n)
                    yield Sample(
                        round(t, 6),
                        np.round(data.qpos + 2e-5 * rng.normal(size=n), 6),
                        np.round(data.qvel + 0.003 * rng.normal(size=n), 5),
                        np.round(np.round(signal / arm.quantum) * arm.quantum, 5),
                    )


def spoil(
    stream: Iterator[Sample | Truth], *, lose: float = 0.0, jitter: float = 0.0, seed: int = 5
) -> Iterator[Sample | Truth]:
    """Drops a share of the reports, and delays their time stamps by |N(0, jitter)|, [s]."""
    rng = np.random.default_rng(seed)
    for each in stream:
        if isinstance(each, Truth):
            yield each
        elif rng.random() >= lose:
            late = jitter * abs(rng.normal())
            yield Sample(round(each.time + late, 6), each.q, each.v, each.signal)


def main() -> None:
    """Writes the robot's file, a recording with its description, or a stream of JSON lines."""
    parser = argparse.ArgumentParser(description="a foreign robot")
    parser.add_argument("arm", choices=list(ARMS))
    parser.add_argument("--model", type=Path)
    parser.add_argument("--record", type=Path)
    parser.add_argument("--script", default="move 5, pick 1.2, move 12, put, move 4")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    arm = ARMS[arguments.arm]
    if arguments.model is not None:
        arguments.model.write_text(write_model(arguments.arm), encoding="utf-8")
        return
    rows = []
    for each in simulate(arguments.arm, arguments.script, arguments.seed):
        if isinstance(each, Truth):
            truth = {"time": each.time, "mark": each.mark, "mass_kg": each.mass, "com_m": each.com.tolist()}
            print(json.dumps(truth), file=sys.stderr, flush=True)
            continue
        if arguments.record is not None:
            rows.append([each.time, *each.q, *each.v, *each.signal])
            continue
        names = {"name": arm.joints, "position": each.q.tolist(), "velocity": each.v.tolist()}
        print(json.dumps({"time": each.time, **names, "effort": each.signal.tolist()}))
    if arguments.record is not None:
        unit = "current" if arm.signal == "current" else "tau"
        header = ["time", *(f"{what}_{i + 1}" for what in ("q", "v", unit) for i in range(len(arm.joints)))]
        lines = [",".join(header), *(",".join(f"{x:.9g}" for x in row) for row in rows)]
        arguments.record.write_text("\n".join(lines) + "\n", encoding="utf-8")
        description = f"joints: [{', '.join(arm.joints)}]\nsignal: {arm.signal}\ntip: flange\n"
        arguments.record.with_suffix(".yaml").write_text(description, encoding="utf-8")


if __name__ == "__main__":
    main()
