"""Home posture: hand level and pointing away from the shoulder, far from singularities and limits.

The arm reaches out by nine tenths of its length, or less where it could not support objects there. The direction of
reach is free, as the base is turned instead. Frames: H the hand, S the origin of the second joint (the shoulder).
"""

import itertools
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.solvers import SnoptSolver

from affordance.arrays import Array
from affordance.exceptions import ModelFileError
from affordance.robots.arm_file import BASE, write_arm
from affordance.robots.reduced_arm import ReducedArm

# Distances of the hand as fractions of the arm's length, tried from far to near.
_REACHES = (0.9, 0.8, 0.7, 0.6, 0.5)
# Payload at which postures are compared, as heavy as the heavier objects, and its distance from the hand, [kg, m].
TEST_MASS, TEST_DISTANCE = 0.8, 0.125
# The first reach that loads no joint beyond this fraction of its torque limit is taken; the rest is for motion.
_ENOUGH = 0.8
# The hand points away from the shoulder within the first of these cones, or, where no posture does, the second;
# joints keep this clearance from their limits, [rad].
_CONES, _CLEARANCE = np.radians([20.0, 60.0]), np.radians(10.0)
# Least singular value of the hand's Jacobian, as a fraction of the arm's length; below it the arm is nearly singular.
_LEAST_SINGULAR = 0.03
# Weight of the mean square distance of joints from the middle of their range, relative to the load.
_OFF_CENTRE = 0.1
_STARTS, _SAMPLES, _SEED = 16, 1500, 0
# Joints needed for a position and a level direction of the hand; arms with fewer find a posture only by their build.
_FEWEST_FREE = 5
# Half the range of a joint without limits, [rad].
_ENDLESS = np.pi


class HomePosture(NamedTuple):
    """Home posture for holding objects.

    Attributes:
        q: Joint angles, (num_joints,), [rad].
        load: Largest fraction of a torque limit, with TEST_MASS in the hand.
        empty_load: Largest fraction of a torque limit with an empty hand.
        payload: Largest mass supported at rest, centred at TEST_DISTANCE, [kg].
        weakest: Joint that limits the payload.
        reach: Distance from shoulder to hand, as a fraction of the arm's length.
        length: Length of the arm from the shoulder, [m].
        smallest_singular_value: Least singular value of the Jacobian of the hand's position, [m/rad].
    """

    q: Array
    load: float
    empty_load: float
    payload: float
    weakest: str
    reach: float
    length: float
    smallest_singular_value: float


class ArmStatics:
    """Kinematics and static torques of an arm as it will be written, its base placed as in the robot's file."""

    def __init__(self, arm: ReducedArm) -> None:
        """Builds the plant of the arm alone."""
        self.arm, self.plant = arm, MultibodyPlant(0.0)
        parser = Parser(self.plant)
        parser.SetStrictParsing()
        parser.AddModelsFromString(write_arm(arm, {}, "itself"), "sdf")
        self.plant.WeldFrames(self.plant.world_frame(), self.plant.GetFrameByName(BASE), arm.X_WB)
        self.plant.Finalize()
        self.hand = self.plant.GetFrameByName("hand_grip")
        # The second joint, or the only one.
        self.shoulder = self.plant.GetJointByName(arm.joint_names[:2][-1]).frame_on_parent()
        self.efforts = np.array([link.effort for link in arm.links])
        self.context = self.plant.CreateDefaultContext()

    def compute_hand(self, q: Array) -> Array:
        """Computes the pose of the hand, X_WH, (4, 4)."""
        self.plant.SetPositions(self.context, q)
        return self.hand.CalcPoseInWorld(self.context).GetAsMatrix4()

    def compute_shoulder(self) -> Array:
        """Computes the position of the shoulder in the posture last set, (3,), [m]."""
        return self.shoulder.CalcPoseInWorld(self.context).translation()

    def compute_jacobian(self, q: Array, p_HQ: Array) -> Array:
        """Computes the Jacobian of the velocity of a point of the hand, (3, num_joints)."""
        self.plant.SetPositions(self.context, q)
        world = self.plant.world_frame()
        return self.plant.CalcJacobianTranslationalVelocity(
            self.context, JacobianWrtVariable.kV, self.hand, p_HQ, world, world
        )

    def compute_torques(self, q: Array, mass: float) -> Array:
        """Computes static torques with a mass in the hand, centred at TEST_DISTANCE, (num_joints,), [N m]."""
        J = self.compute_jacobian(q, np.array([TEST_DISTANCE, 0.0, 0.0]))
        gravity = self.plant.gravity_field().gravity_vector()
        own = -self.plant.CalcGravityGeneralizedForces(self.context)
        return own - J.T @ (mass * gravity)

    def compute_payload(self, q: Array) -> tuple[float, str]:
        """Finds the largest mass held at rest, centred at TEST_DISTANCE, [kg], and the limiting joint."""
        own = self.compute_torques(q, 0.0)
        each = self.compute_torques(q, 1.0) - own
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(each == 0.0, np.inf, (np.sign(each) * -own + self.efforts) / np.abs(each))
        worst = int(np.argmin(room))
        return max(0.0, float(room[worst])), self.arm.joint_names[worst]


def find_home(statics: ArmStatics, given: Mapping[str, float]) -> HomePosture:
    """Finds the home posture; given joints stay fixed, and no search is needed if all are given.

    Raises:
        ModelFileError: The arm has no length, or no posture with the hand level and pointing outwards was found.
    """
    arm, rng = statics.arm, np.random.default_rng(_SEED)
    lower, upper = (np.array([getattr(link, name) for link in arm.links]) for name in ("lower", "upper"))
    fixed = np.array([given.get(name, np.nan) for name in arm.joint_names])
    low = np.where(np.isfinite(lower), lower, -_ENDLESS)
    high = np.where(np.isfinite(upper), upper, _ENDLESS)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    clear = np.minimum(_CLEARANCE, half)
    bounds = np.where(np.isnan(fixed), low + clear, fixed), np.where(np.isnan(fixed), high - clear, fixed)
    length = _measure_length(statics, low, high, rng)
    if not length > 0.0:
        raise ModelFileError("the arm", "has its tip on its first joint's axis, must have a length")

    def measure(q: Array) -> HomePosture:
        X_WH = statics.compute_hand(q)
        reach = float(np.linalg.norm(X_WH[:3, 3] - statics.compute_shoulder())) / length
        load, empty = (
            float(np.max(np.abs(statics.compute_torques(q, mass)) / statics.efforts)) for mass in (TEST_MASS, 0.0)
        )
        least = float(np.linalg.svd(statics.compute_jacobian(q, np.zeros(3)), compute_uv=False)[-1])
        return HomePosture(q, load, empty, *statics.compute_payload(q), reach, length, least)

    if not np.isnan(fixed).any():
        return measure(fixed)
    best: tuple[float, HomePosture] | None = None
    singular: tuple[float, HomePosture] | None = None
    for cone, reach in itertools.product(_CONES, _REACHES):
        if cone > _CONES[0] and (best or singular) is not None:
            break
        for start in range(_STARTS):
            guess = middle if start == 0 else rng.uniform(*bounds)
            q = _solve(statics, guess, bounds=bounds, middle=middle, half=half, distance=reach * length, cone=cone)
            if q is None:
                continue
            posture = measure(q)
            cost = posture.load + _OFF_CENTRE * float(np.mean(((q - middle) / half) ** 2))
            if posture.smallest_singular_value < _LEAST_SINGULAR * length:
                if singular is None or cost < singular[0]:
                    singular = cost, posture
            elif best is None or cost < best[0]:
                best = cost, posture
        if best is not None and best[1].load <= _ENOUGH:
            break
    best = best or singular
    if best is None:
        joints = f"its {len(arm.links)} joints ({', '.join(arm.joint_names)})"
        problem = f"finds no posture of {joints} with the hand level and pointing away from the shoulder"
        more = "" if len(arm.links) >= _FEWEST_FREE else ", or more joints with --base or another --tip"
        raise ModelFileError("arm", f"{problem}; give one with --posture, or another --out-axis{more}")
    return best[1]


def _measure_length(statics: ArmStatics, low: Array, high: Array, rng: np.random.Generator) -> float:
    """Estimates the arm's length: the 99.9th percentile of shoulder-hand distances over random postures, [m]."""
    distances = []
    for q in rng.uniform(low, high, (_SAMPLES, len(low))):
        p_WH = statics.compute_hand(q)[:3, 3]
        distances.append(np.linalg.norm(p_WH - statics.compute_shoulder()))
    return float(np.quantile(distances, 0.999))


def _solve(
    statics: ArmStatics,
    guess: Array,
    *,
    bounds: tuple[Array, Array],
    middle: Array,
    half: Array,
    distance: float,
    cone: float,
) -> Array | None:
    """Solves for the posture nearest to mid-range with the hand at a distance, level and pointing outwards."""
    world, hand, shoulder = statics.plant.world_frame(), statics.hand, statics.shoulder
    solver = InverseKinematics(statics.plant, statics.context, with_joint_limits=False)
    program, q = solver.get_mutable_prog(), solver.q()
    program.AddBoundingBoxConstraint(*bounds, q)
    program.AddQuadraticErrorCost(np.diag(1.0 / half**2), middle, q)
    origin, ahead = np.zeros(3), np.array([1.0, 0.0, 0.0])
    up, level = np.array([0.0, 0.0, 1.0]), 0.5 * np.pi
    solver.AddAngleBetweenVectorsConstraint(world, up, hand, ahead, level, level)
    solver.AddPointToPointDistanceConstraint(shoulder, origin, hand, origin, distance, distance)
    # Looking back along the hand, the shoulder must be within the cone.
    solver.AddGazeTargetConstraint(hand, origin, -ahead, shoulder, origin, cone)
    result = SnoptSolver().Solve(program, guess)
    return result.GetSolution(q) if result.is_success() else None
