"""Comparison of an imported arm with MuJoCo, which compiles the robot's file itself."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

from affordance.extensions.robots.home import plant_arm
from affordance.extensions.robots.reduced_arm import ReducedArm
from affordance.plant.arm_model import ArmModel

_STATES = 50


def compare_with_mujoco(path: Path, arm: ReducedArm) -> float:
    """Computes the largest difference from MuJoCo's inverse dynamics at 50 states, relative to the largest torque.

    Joints that are frozen in the arm have the same fixed positions in MuJoCo. Friction, damping and constraints are
    left out, and gravity is that of the earth. If meshes are missing, MuJoCo compiles the model without them.
    """
    model = _compile(path)
    data: Any = mujoco.MjData(model)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.dof_damping[:] = 0.0
    joints = [model.joint(name) for name in arm.joint_names]
    rows, places = [int(j.dofadr[0]) for j in joints], [int(j.qposadr[0]) for j in joints]
    ours, rng, differences, largest = ArmModel(plant_arm(arm)), np.random.default_rng(5), [], 0.0
    for name, value in arm.frozen.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    frozen = data.qpos.copy()
    for _ in range(_STATES):
        q, v, a = rng.uniform(-2.0, 2.0, (3, len(rows)))
        data.qpos[:], data.qvel[:], data.qacc[:] = frozen, 0.0, 0.0
        data.qpos[places], data.qvel[rows], data.qacc[rows] = q, v, a
        mujoco.mj_inverse(model, data)
        ours.set_state(np.concatenate([q, v]))
        tau = ours.compute_inverse_dynamics(a)
        differences.append(float(np.abs(tau - data.qfrc_inverse[rows]).max()))
        largest = max(largest, float(np.abs(tau).max()))
    return max(differences) / largest


def _compile(path: Path) -> Any:
    """Compiles a model, without its meshes if they are missing."""
    try:
        return mujoco.MjSpec.from_file(str(path)).compile()  # MjModel would log warnings to a file here
    except ValueError:
        root = ElementTree.parse(path).getroot()
        for parent in [*root.iter()]:
            for child in [*parent]:
                if child.tag in ("mesh", "texture", "hfield", "skin") or "mesh" in child.attrib:
                    parent.remove(child)
        return mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode")).compile()
