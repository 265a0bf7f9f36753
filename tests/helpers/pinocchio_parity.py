"""Compares an imported arm with Pinocchio, which reads the robot's file and freezes joints independently."""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydrake.multibody.tree import MultibodyForces

from affordance.arrays import Array
from affordance.extensions.robots.home import plant_arm
from affordance.extensions.robots.importer import ImportOptions, read_arm
from affordance.extensions.robots.reduced_arm import ReducedArm

# Number of states, and largest joint velocities and accelerations in these, [rad/s, rad/s^2].
_STATES, _RATE, _ACCELERATION = 20, 2.0, 5.0


class ParityError(NamedTuple):
    """Largest differences over random states, each relative to the largest of the numbers compared."""

    mass_matrix: float
    gravity: float
    inverse_dynamics: float
    tip: float

    @property
    def largest(self) -> float:
        """Largest of the four differences."""
        return max(self)


def compute_parity(path: Path, options: ImportOptions, seed: int = 0) -> ParityError:
    """Compares an arm, whose other joints are frozen at random, with Pinocchio's reduced model from the same file.

    Damping is left out on our side, because Pinocchio's inverse dynamics leaves it out.

    Raises:
        ImportError: Pinocchio is not installed.
    """
    rng = np.random.default_rng(seed)
    frozen = draw_posture(read_arm(path, options), rng)
    imported = read_arm(path, replace(options, posture=frozen, damping=False))
    reduced = _build_reduced(path, imported)
    return _compare(imported, *reduced, rng)


def draw_posture(read: ReducedArm, rng: np.random.Generator) -> dict[str, float]:
    """Draws values of all joints except the arm's, within their limits, or within half a turn if they have none."""
    tree, chain = read.tree, set(read.joint_names)
    values = {}
    for joint in tree.joints_above.values():
        if joint.num_velocities() != 1 or joint.name() in chain or tree.note(joint).mimic is not None:
            continue
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        low, high = (low if np.isfinite(low) else -0.5 * np.pi), (high if np.isfinite(high) else 0.5 * np.pi)
        values[joint.name()] = float(rng.uniform(low, high))
    return values


def _build_reduced(path: Path, imported: ReducedArm) -> tuple[Any, int]:
    """Builds Pinocchio's model with the same joints frozen; returns it and the index of its frame at the tip."""
    import pinocchio

    if imported.tree.description.kind == "mjcf":
        model = pinocchio.buildModelFromMJCF(str(path))
    else:
        model = pinocchio.buildModelFromUrdf(str(path))
    q = pinocchio.neutral(model)
    kept = set(imported.joint_names)
    locked = []
    for number in range(1, model.njoints):
        name, joint = model.names[number], model.joints[number]
        if name in kept:
            continue
        locked.append(number)
        value = imported.frozen.get(name)
        if value is not None and joint.nq == 1:
            q[joint.idx_q] = value
        elif value is not None and joint.nq == 2:  # a continuous joint, whose value is a point on the unit circle
            q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
    reduced = pinocchio.buildReducedModel(model, locked, q)
    return reduced, reduced.getFrameId(imported.chain.tip.name(), pinocchio.FrameType.BODY)


def _compare(imported: ReducedArm, reduced: Any, tip: int, rng: np.random.Generator) -> ParityError:
    import pinocchio

    arm, n = plant_arm(imported), len(imported.links)
    plant, context, forces = arm.plant, arm.plant.CreateDefaultContext(), MultibodyForces(arm.plant)
    data = reduced.createData()
    R_TH = (
        imported.chain.tip.CalcPose(
            imported.tree.plant.CreateDefaultContext(), imported.chain.joints[-1].frame_on_child()
        )
        .rotation()
        .matrix()
        .T
        @ imported.X_LH.rotation().matrix()
    )
    found = []
    for _ in range(_STATES):
        q, v, vdot = (
            rng.uniform(-1.5, 1.5, n),
            rng.uniform(-_RATE, _RATE, n),
            rng.uniform(-1.0, 1.0, n) * _ACCELERATION,
        )
        q_pin = _write_angles(reduced, q)
        M = pinocchio.crba(reduced, data, q_pin)
        M = np.triu(M) + np.triu(M, 1).T
        gravity = pinocchio.computeGeneralizedGravity(reduced, data, q_pin).copy()
        tau = pinocchio.rnea(reduced, data, q_pin, v, vdot).copy()
        pinocchio.framesForwardKinematics(reduced, data, q_pin)
        X_WT = data.oMf[tip].homogeneous
        plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
        plant.CalcForceElementsContribution(context, forces)
        X_WH = arm.hand.CalcPoseInWorld(context).GetAsMatrix4()
        X_TH = np.eye(4)
        X_TH[:3, :3] = R_TH
        pairs = (
            (plant.CalcMassMatrix(context), M),
            (-plant.CalcGravityGeneralizedForces(context), gravity),
            (plant.CalcInverseDynamics(context, vdot, forces), tau),
            (X_WH, X_WT @ X_TH),
        )
        found.append([float(np.abs(ours - theirs).max() / np.abs(theirs).max()) for ours, theirs in pairs])
    return ParityError(*(float(value) for value in np.max(found, axis=0)))


def _write_angles(model: Any, q: Array) -> Array:
    """Converts angles to Pinocchio's configuration, in which continuous joints are points on the unit circle."""
    written = np.zeros(model.nq)
    for number, angle in enumerate(q, start=1):
        joint = model.joints[number]
        if joint.nq == 1:
            written[joint.idx_q] = angle
        else:
            written[joint.idx_q : joint.idx_q + 2] = np.cos(angle), np.sin(angle)
    return written
