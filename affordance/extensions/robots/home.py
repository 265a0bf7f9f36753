"""Finds a home posture with a level hand that points away from the shoulder, far from singularities and limits.

The arm reaches out to 90 % of its length, or less if it could not support objects there. The direction of reach is
free, because the base is rotated afterwards. Frames: H is the hand; S is the shoulder, at the second joint.
"""

import itertools
import operator
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, SpatialInertia
from pydrake.solvers import SnoptSolver

from affordance.arrays import Array
from affordance.exceptions import ModelFileError
from affordance.extensions.robots.arm_file import name_base, write_arm
from affordance.extensions.robots.reduced_arm import ReducedArm
from affordance.plant.arm import Arm, JointLimits, attach_body
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import HAND_FRAME
from affordance.plant.rank_loss import compute_mobility

# Distances of the hand from the shoulder as fractions of the arm's length, in the order of trial.
_REACHES = (0.9, 0.8, 0.7, 0.6, 0.5)
# Payload for comparing postures, typical of heavy objects, [kg], and its distance from the hand, [m].
TEST_MASS, TEST_DISTANCE = 0.8, 0.125
# Largest static load of a joint as a fraction of its torque limit; the remaining torque is for motion.
_ENOUGH = 0.8
# Half angles of cones within which the hand must point away from the shoulder, the second if the first contains no
# posture, and distance of joints from their limits, [rad].
_CONES, _CLEARANCE = np.radians([20.0, 60.0]), np.radians(10.0)
# A posture is nearly singular if the smallest singular value of the hand's Jacobian is below this fraction of the
# arm's length.
_LEAST_SINGULAR = 0.03
# Weight of the joints' mean squared distance from mid-range, relative to the load.
_OFF_CENTRE = 0.1
_STARTS, _SAMPLES, _SEED = 16, 1500, 0
# Angle between the hand's z and up within which the hand counts as upright, [rad].
UPRIGHT = np.radians(1.0)
# Least number of joints with which every arm reaches any position with a level hand.
_FEWEST_FREE = 5
# Half range assumed for a joint without limits, [rad].
_ENDLESS = np.pi


class HomePosture(NamedTuple):
    """Home posture for holding objects."""

    q: Array  # joint angles, (num_joints,), [rad]
    load: float  # largest fraction of a torque limit, with TEST_MASS in the hand
    empty_load: float  # largest fraction of a torque limit with an empty hand
    own: Array  # static torques due to the arm's own weight, (num_joints,), [N m]
    payload: float  # largest mass supported at rest, centred at TEST_DISTANCE from the hand, [kg]
    weakest: str  # joint that limits the payload
    payload_in_hand: float  # largest mass supported at rest, centred at the hand's origin, [kg]
    reach: float  # distance from shoulder to hand, as a fraction of the arm's length
    length: float  # length of the arm from the shoulder, [m]
    smallest_singular_value: float  # smallest singular value of the Jacobian of the hand's position, [m/rad]
    tilt: float  # angle between the hand's z and up, [rad]


def plant_arm(arm: ReducedArm) -> Arm:
    """Builds the plant of an extracted arm as it will be written. Invalid numbers raise Drake's RuntimeError."""
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.SetStrictParsing()
    parser.AddModelsFromString(write_arm(arm, {}, "itself"), "sdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(name_base(arm)), arm.X_WB)
    hand = plant.GetFrameByName(HAND_FRAME)
    tool = attach_body(plant, hand, SpatialInertia.Zero())
    plant.Finalize()
    names = ("lower", "upper", "velocity", "effort")
    limits = JointLimits(*(np.array([getattr(link, name) for link in arm.links]) for name in names))
    return Arm(arm.tree.description.path, plant, hand, tool, np.zeros(len(arm.links)), limits)


def get_shoulder(arm: Arm) -> Frame:
    """Returns the shoulder frame, at the second joint or, for a single joint, at that joint."""
    shoulder: Frame = arm.plant.GetJointByName(arm.joint_names[:2][-1]).frame_on_parent()
    return shoulder


def compute_static_torques(model: ArmModel, q: Array, mass: float, distance: float = TEST_DISTANCE) -> Array:
    """Computes static torques, (num_joints,), [N m], with a payload in front of the hand.

    The mass is in [kg], its distance from the hand in [m].
    """
    model.set_posture(q)
    J = model.compute_point_jacobian(np.array([distance, 0.0, 0.0]))
    return model.compute_inverse_dynamics(np.zeros(len(q))) - J.T @ (mass * model.gravity)


def _compute_payload(model: ArmModel, q: Array, own: Array, distance: float) -> tuple[float, str]:
    """Computes the largest mass, [kg], that an arm can hold at rest at a distance, [m], from the hand.

    ``own`` are the torques due to the arm's own weight, [N m].

    Returns: The mass, [kg], and the joint that limits it.
    """
    each = compute_static_torques(model, q, 1.0, distance) - own
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(each == 0.0, np.inf, (np.sign(each) * -own + model.arm.limits.tau_max) / np.abs(each))
    worst = int(np.argmin(room))
    return max(0.0, float(room[worst])), model.arm.joint_names[worst]


def compute_tilt(R_WH: Array) -> float:
    """Computes the angle between up and the hand's z, [rad], from its axes R_WH, (3, 3)."""
    return float(np.arccos(np.clip(R_WH[2, 2], -1.0, 1.0)))


def find_home(model: ArmModel, given: Mapping[str, float], *, is_rolled: bool = False) -> HomePosture:
    """Finds the home posture. Joints in ``given`` are fixed at these angles, [rad].

    If the hand's roll is known (``is_rolled``), postures with the hand's z up are searched first, then others.

    Raises:
        ModelFileError: The arm has no length, or no posture has a level hand that points away from the shoulder.
    """
    arm, rng, shoulder = model.arm, np.random.default_rng(_SEED), get_shoulder(model.arm)
    limits, fixed = arm.limits, np.array([given.get(name, np.nan) for name in arm.joint_names])
    low = np.where(np.isfinite(limits.q_lower), limits.q_lower, -_ENDLESS)
    high = np.where(np.isfinite(limits.q_upper), limits.q_upper, _ENDLESS)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    clear = np.minimum(_CLEARANCE, half)
    bounds = np.where(np.isnan(fixed), low + clear, fixed), np.where(np.isnan(fixed), high - clear, fixed)
    # Length of the arm: the 99.9th percentile over random postures.
    distances = [_compute_reach(model, shoulder, q) for q in rng.uniform(low, high, (_SAMPLES, len(low)))]
    length = float(np.quantile(distances, 0.999))
    if not length > 0.0:
        raise ModelFileError("the arm", "has its tip on its first joint's axis, must have a length")

    def measure(q: Array) -> HomePosture:
        reach = _compute_reach(model, shoulder, q) / length
        held, own = (compute_static_torques(model, q, mass) for mass in (TEST_MASS, 0.0))
        load, empty = (float(np.max(limits.compute_loads(torques))) for torques in (held, own))
        least = compute_mobility(model, q, np.zeros(3))
        model.set_posture(q)
        tilt = compute_tilt(model.compute_hand_pose().rotation().matrix())
        payload, in_hand = (_compute_payload(model, q, own, distance) for distance in (TEST_DISTANCE, 0.0))
        return HomePosture(q, load, empty, own, *payload, in_hand[0], reach, length, least, tilt)

    if not np.isnan(fixed).any():
        return measure(fixed)
    found: list[tuple[bool, float, HomePosture]] = []  # (is nearly singular, cost, posture)
    for z_is_up, cone in itertools.product((True, False) if is_rolled else (False,), _CONES):
        if found:
            break
        for reach in _REACHES:
            for start in range(_STARTS):
                guess = middle if start == 0 else rng.uniform(*bounds)
                placed = {"distance": reach * length, "cone": cone, "z_is_up": z_is_up}
                q = _solve(arm, guess, bounds=bounds, middle=middle, half=half, **placed)
                if q is None:
                    continue
                posture = measure(q)
                cost = posture.load + _OFF_CENTRE * float(np.mean(((q - middle) / half) ** 2))
                found.append((posture.smallest_singular_value < _LEAST_SINGULAR * length, cost, posture))
            found = [min(found, key=operator.itemgetter(0, 1))] if found else []
            if found and not found[0][0] and found[0][2].load <= _ENOUGH:
                break
    if not found:
        joints = f"its {arm.num_joints} joints ({', '.join(arm.joint_names)})"
        problem = f"has no posture of {joints} with the hand level and pointing away from the shoulder"
        more = "" if arm.num_joints >= _FEWEST_FREE else ", or more joints with --base or another --tip"
        raise ModelFileError("arm", f"{problem}; give one with --posture, or another --out-axis{more}")
    return found[0][2]


def _compute_reach(model: ArmModel, shoulder: Frame, q: Array) -> float:
    """Computes the distance of the hand from the shoulder, [m]."""
    model.set_posture(q)
    return float(np.linalg.norm(model.compute_hand_pose().translation() - model.compute_frame_position(shoulder)))


def _solve(
    arm: Arm,
    guess: Array,
    *,
    bounds: tuple[Array, Array],
    middle: Array,
    half: Array,
    distance: float,
    cone: float,
    z_is_up: bool,
) -> Array | None:
    """Finds the level, outward-pointing posture closest to mid-range, with the hand at a given distance.

    With ``z_is_up`` the hand's z must also point up. Returns None if the solver finds no such posture.
    """
    world, hand, shoulder = arm.plant.world_frame(), arm.hand, get_shoulder(arm)
    solver = InverseKinematics(arm.plant, arm.plant.CreateDefaultContext(), with_joint_limits=False)
    program, q = solver.get_mutable_prog(), solver.q()
    program.AddBoundingBoxConstraint(*bounds, q)
    program.AddQuadraticErrorCost(np.diag(1.0 / half**2), middle, q)
    origin, ahead = np.zeros(3), np.array([1.0, 0.0, 0.0])
    up, level = np.array([0.0, 0.0, 1.0]), 0.5 * np.pi
    solver.AddAngleBetweenVectorsConstraint(world, up, hand, ahead, level, level)
    if z_is_up:
        aside = np.array([0.0, 1.0, 0.0])
        solver.AddAngleBetweenVectorsConstraint(world, up, hand, aside, level, level)
        solver.AddAngleBetweenVectorsConstraint(world, up, hand, up, 0.0, level)
    solver.AddPointToPointDistanceConstraint(shoulder, origin, hand, origin, distance, distance)
    # Looking backwards along the hand, the shoulder must be within the cone.
    solver.AddGazeTargetConstraint(hand, origin, -ahead, shoulder, origin, cone)
    result = SnoptSolver().Solve(program, guess)
    return result.GetSolution(q) if result.is_success() else None
