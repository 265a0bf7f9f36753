"""Generated tables of held postures, with known truth: of a wrist sensor, and of joint torques."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.plant.serial_chain import SerialChain

_OF_WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


def draw_postures(num: int, rng: np.random.Generator) -> Array:
    """Draws joint angles, shape (num, 6)."""
    return rng.uniform(-1.5, 1.5, (num, 6))


def generate_wrench(
    robot: SerialChain, q: Array, pi: Array, rng: np.random.Generator, tilt_deg: float = 1.0
) -> Array:
    """Generates forces and moments of a sensor with offsets, gains off by 1 %, and a base that is not level."""
    tilt = Rotation.from_rotvec([np.radians(tilt_deg), 0.0, 0.0])
    true = robot.with_gravity(tilt.apply(robot.gravity_W))
    rest = np.zeros_like(q)
    wrench = true.compute_wrench_regressors(q, rest, rest)[:, [3, 4, 5, 0, 1, 2]] @ pi
    offset = np.concatenate([rng.normal(0.0, 5.0, 3), rng.normal(0.0, 0.3, 3)])
    noise = np.repeat([0.15, 0.01], 3) * rng.standard_normal(wrench.shape)
    return wrench * (1.0 + rng.normal(0.0, 0.01, 6)) + offset + noise


def generate_torques(
    robot: SerialChain, q: Array, loads: tuple[Array, ...], rng: np.random.Generator
) -> tuple[Array, ...]:
    """Generates torques with each load, of sensors with offsets that drift, gains off by 1 %, links off by 10 %."""
    links = robot.link_parameters * (1.0 + 0.1 * rng.standard_normal((6, 1)))
    gain, rest = 1.0 + rng.normal(0.0, 0.01, 6), np.zeros_like(q)
    arm = robot.compute_link_regressors(q, rest, rest) @ links.ravel()
    Y = robot.compute_payload_regressors(q, rest, rest)
    noise = np.repeat([0.3, 0.1], 3)
    return tuple(
        gain * (arm + Y @ pi) + rng.normal(0.0, 0.1, 6) + noise * rng.standard_normal(arm.shape) for pi in loads
    )


def write_table(
    path: Path, q: Array, signal: Array, *, is_wrench: bool, more: str = "", time: Array | None = None
) -> Path:
    """Writes a table and its description, which has some more lines."""
    n = q.shape[1]
    of_signal = _OF_WRENCH if is_wrench else [f"tau_{i + 1}" for i in range(n)]
    names = [*([] if time is None else ["time"]), *(f"q_{i + 1}" for i in range(n)), *of_signal]
    values = np.hstack([*([] if time is None else [time[:, None]]), q, signal])
    np.savetxt(path, values, delimiter=",", fmt="%.6f", header=",".join(names), comments="")
    joints = ", ".join(f"joint_{i + 1}" for i in range(n))
    kind = "wrench" if is_wrench else "joint_torque"
    path.with_suffix(".yaml").write_text(f"joints: [{joints}]\nsignal: {kind}\ntip: flange\n{more}")
    return path
