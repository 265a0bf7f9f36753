"""Plans swings from rest to a strike with minimum joint acceleration.

Of all motions of duration D from rest at q_0 to angles q_1 with rates v_1, a cubic in time minimises the integral of
|vdot|^2. The minimum is

    12 |d|^2 / D^3 - 12 d^T v_1 / D^2 + 4 |v_1|^2 / D,    d = q_1 - q_0

The strike determines position and velocity of the striking point, and requires that the face is perpendicular to the
blow. The remaining degrees of freedom of (q_1, v_1) minimise the integral within the joint limits. The cubic also has
minimum acceleration between any two of its points, so a controller that minimises acceleration follows it exactly.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.solvers import MathematicalProgram, SnoptSolver

from affordance.arrays import Array
from affordance.exceptions import AffordanceError
from affordance.objects.tool import PosedShape
from affordance.plant.arm import JointLimits
from affordance.plant.arm_model import ArmModel
from affordance.plant.serial_chain import cross

# Times at which angle and rate limits are enforced, as fractions of the duration. Between them, a joint that
# accelerates with 50 rad/s^2 exceeds an angle limit by at most a milliradian.
_CHECKED = np.linspace(0.02, 1.0, 50)
# Scales of the optimisation: costs are in units of 100 rad^2/s^3, errors in decimetres and m/s.
_COST_SCALE, _PLACE_SCALE = 1e-2, 10.0
_MAX_MISS = 1e-5
# Distance to a limit below which a swing is treated as touching it, [rad] or [rad/s].
_TOUCH = 1e-3
# Time from the first contact until the arm begins to return, [s]. For effective masses of 0.15 to 2.4 kg, found for
# the arms of twenty robots, the nail is at rest within 13 ms. If rotors increase the mass to 6 kg, it takes 20 ms;
# the demanded force is still reached.
FOLLOW_THROUGH = 0.015
# Margin of swings to angle limits, [rad]. A controller with steps of 20 ms deviates from a swing by about a degree.
_MARGIN = np.radians(1.0)
# Rotation of a joint after the strike divided by its rate at the strike, [s]. A joint keeps its rate while the nail
# is driven, and then brakes uniformly within 0.1 s, less than half of the controller's horizon.
COASTING_TIME = FOLLOW_THROUGH + 0.5 * 0.1
# Half the breadth of a hand, [m]. The hand covers faces with a smaller x coordinate (models/README.md).
HAND = 0.044
# Cosine above which a face points along the blow (within 60 degrees). The search for a strike constrains the face
# only if it does not point along the blow at the start.
ALONG = 0.5


class Swing(NamedTuple):
    """Cubic joint motion from rest to a strike."""

    q_start: Array  # joint angles at the beginning, shape (num_joints,), [rad]
    q_end: Array  # joint angles at the strike, shape (num_joints,), [rad]
    v_end: Array  # joint velocities at the strike, shape (num_joints,), [rad/s]
    duration: float  # time from rest to the strike, [s]

    def evaluate(self, times: Array) -> tuple[Array, Array, Array]:
        """Computes angles, rates and accelerations, (N, num_joints) each, at any N times, [s]."""
        D = self.duration
        u = np.asarray(times)[:, None] / D
        d = self.q_end - self.q_start
        square, cube = 3.0 * d - D * self.v_end, D * self.v_end - 2.0 * d
        q = self.q_start + square * u**2 + cube * u**3
        return q, (2.0 * square * u + 3.0 * cube * u**2) / D, (2.0 * square + 6.0 * cube * u) / D**2


class Target(NamedTuple):
    """Target of a blow, and the striking point S of the tool."""

    q_start: Array  # joint angles at the start of the swing, shape (num_joints,), [rad]
    p_TS: Array  # position of S in the tool, shape (3,), [m]
    normal_T: Array  # outward normal of the tool at S, expressed in T, shape (3,)
    radius: float  # radius of curvature of the tool at S; infinite for a flat face, [m]
    p_WS: Array  # position of S at the strike, shape (3,), [m]
    direction_W: Array  # unit vector of the blow and of the tool's normal at the strike, shape (3,)


class StrikeCondition:
    """Constraints on angles and rates at a strike, z = (q_1, v_1).

    A face that is perpendicular to the blow could point away from the target. If it does not point along the blow at
    the start, the cosine between its normal and the blow is therefore constrained to be positive.
    """

    def __init__(self, model: ArmModel, target: Target, speed: float) -> None:
        """Stores the constraints.

        Args:
            model: Model of the arm; its state is changed by each evaluation.
            target: Target of the blow.
            speed: Tip speed, [m/s].
        """
        self._model = model
        self._target = target
        self._velocity_W = speed * target.direction_W
        self._across = np.linalg.svd(target.direction_W[None])[2][1:]  # two directions perpendicular to the blow
        model.set_posture(target.q_start)
        turned = [] if target.direction_W @ self._compute_normal() > ALONG else [np.inf]
        self.lower: Array = np.zeros(8 + len(turned))  # bounds of each entry, (8,) or (9,)
        self.upper: Array = np.array([0.0] * 8 + turned)

    def compute(self, z: Array) -> Array:
        """Computes errors of position, velocity and direction of the face, (8,) or (9,).

        The ninth value is the cosine between the face's normal and the blow, if it is constrained.

        Args:
            z: Angles and rates at the strike, (2 num_joints,).
        """
        model, target, n = self._model, self._target, len(z) // 2
        model.set_posture(z[:n])
        p_WS, J = model.compute_point_position(target.p_TS), model.compute_point_jacobian(target.p_TS)
        normal_W = self._compute_normal()
        along = J @ z[n:] - self._velocity_W
        facing = [*(self._across @ normal_W), target.direction_W @ normal_W]
        return np.concatenate([_PLACE_SCALE * (p_WS - target.p_WS), along, facing])[: len(self.lower)]

    def _compute_normal(self) -> Array:
        """Computes the normal of the striking face in W, (3,)."""
        normal_W: Array = self._model.compute_hand_pose().rotation().matrix() @ self._target.normal_T
        return normal_W

    def compute_with_gradient(self, z: Array) -> Array:
        """Computes the errors with their exact gradient, for Drake's AutoDiff.

        Joint i rotates all links beyond it about its axis w_i; w_i = 0 for a prismatic joint. The derivative of
        column J_j of the Jacobian of S by angle i is therefore w_i x J_j for j >= i and w_j x J_i for j < i.
        """
        value = ExtractValue(z).ravel()
        n = len(value) // 2
        missed = self.compute(value)  # also sets the model to these angles
        R_WT = self._model.compute_hand_pose().rotation().matrix()
        w, of_hand = np.split(self._model.compute_hand_jacobian().T, 2, axis=1)  # (n, 3) each
        J = of_hand + cross(w, R_WT @ self._target.p_TS)
        rates = value[n:, None]
        beyond = np.cumsum((rates * J)[::-1], axis=0)[::-1]
        before = np.cumsum(rates * w, axis=0) - rates * w
        turned = cross(w, R_WT @ self._target.normal_T)
        facing = np.vstack([self._across, self._target.direction_W])[: len(missed) - 6]
        jacobian = np.zeros((len(missed), 2 * n))
        jacobian[:3, :n] = _PLACE_SCALE * J.T
        jacobian[3:6, :n] = (cross(w, beyond) + cross(before, J)).T
        jacobian[3:6, n:] = J.T
        jacobian[6:, :n] = facing @ turned.T
        with_gradient: Array = InitializeAutoDiff(missed, jacobian @ ExtractGradient(z)).ravel()
        return with_gradient

    def is_met(self, z: Array) -> bool:
        """Returns True if the strike is within tolerances and the face points to the target."""
        is_near = bool(np.abs(self.compute(z)[:8]).max() <= _MAX_MISS)
        return is_near and bool(self._target.direction_W @ self._compute_normal() > 0.0)


def find_target(
    model: ArmModel, parts: Sequence[PosedShape], *, q_start: Array, offset_W: Array, direction_W: Array
) -> Target:
    """Finds the striking point of a tool and its target.

    The striking point is the centre of the striking face with the largest x coordinate in the hand frame. A tool
    without a striking face strikes with the point of its free part that is furthest along the blow in the start
    posture.

    Args:
        model: Model of the arm; it is set to rest in the start posture.
        parts: Parts of the tool, posed relative to the hand.
        q_start: Joint angles at the start, (num_joints,), [rad].
        offset_W: Position of the target relative to the striking point at the start, (3,), [m].
        direction_W: Direction of the blow, a unit vector, (3,).
    """
    model.set_posture(q_start)
    faces = [
        (*face.express(part.X_TE), part.shape.compute_curvature_radius(face.normal_E))
        for part in parts
        for face in part.strikes
    ]
    if faces:
        p_TS, normal_T, radius = max(faces, key=lambda each: float(each[0][0]))
        return Target(q_start, p_TS, normal_T, radius, model.compute_point_position(p_TS) + offset_W, direction_W)
    normal_T = model.compute_hand_pose().rotation().matrix().T @ direction_W
    free = max(parts, key=lambda part: float(part.X_TE[0, 3]))
    R_TE, p_TE = free.X_TE[:3, :3], free.X_TE[:3, 3]
    normal_E = R_TE.T @ normal_T
    p_TS = p_TE + R_TE @ free.shape.find_support(normal_E)
    radius = free.shape.compute_curvature_radius(normal_E)
    return Target(q_start, p_TS, normal_T, radius, model.compute_point_position(p_TS) + offset_W, direction_W)


def plan_swing(
    model: ArmModel, target: Target, *, speed: float, duration: float, guess: Swing | None = None
) -> Swing:
    """Plans a swing from rest to a strike.

    Args:
        model: Model of the arm; its state is changed.
        target: Target of the blow.
        speed: Tip speed at the strike, [m/s].
        duration: Time from rest to the strike, [s].
        guess: Swing from which the search starts; None for the start posture.

    Raises:
        AffordanceError: No swing within the limits of angle and rate strikes as demanded.
    """
    q_start, D = target.q_start, duration
    limits = model.arm.shrink_limits(_MARGIN, q_start)
    n = len(q_start)
    condition = StrikeCondition(model, target, speed)
    program = MathematicalProgram()
    z = program.NewContinuousVariables(2 * n, "z")  # q_1 and v_1
    program.SetInitialGuess(z, _guess_end(model, target, speed) if guess is None else np.hstack(guess[1:3]))
    of_joint = _COST_SCALE * np.array([[24.0 / D**3, -12.0 / D**2], [-12.0 / D**2, 8.0 / D]])
    curvature = np.asarray(np.kron(of_joint, np.eye(n)), dtype=float)
    from_start = np.concatenate([q_start, np.zeros(n)])
    program.AddQuadraticCost(curvature, -curvature @ from_start, z, is_convex=True)
    program.AddConstraint(condition.compute_with_gradient, condition.lower, condition.upper, z)
    bounds = _bound_motion(q_start, D, limits)
    # Most joints are far from their limits. The limits of a joint are added if the guess touches or the swing
    # violates one of them. If no swing is found, all limits are added.
    entered = np.zeros(n, dtype=bool)
    entering = entered if guess is None else ~bounds.find_within(np.hstack(guess[1:3]), _TOUCH)
    while True:
        rows = np.tile(entering, len(bounds.lower) // n)
        if entering.any():
            program.AddLinearConstraint(bounds.matrix[rows], bounds.lower[rows], bounds.upper[rows], z)
        entered = entered | entering
        found = _solve(program, z, condition)
        entering = ~entered if found is None else ~entered & ~bounds.find_within(found, 0.0)
        if not entering.any():
            break
    if found is None:
        raise AffordanceError(f"no swing of {duration:g} s within the joints' limits strikes with {speed:.3g} m/s")
    return Swing(q_start, found[:n], found[n:], D)


class _Bounds(NamedTuple):
    """Linear bounds on the angles and rates of a swing, lower <= matrix z <= upper with z = (q_1, v_1)."""

    matrix: Array
    lower: Array
    upper: Array

    def find_within(self, z: Array, margin: float) -> NDArray[np.bool_]:
        """Returns a mask of joints that keep a margin to all of their bounds, (num_joints,)."""
        value = self.matrix @ z
        within = (value - self.lower >= margin) & (self.upper - value >= margin)
        return within.reshape(-1, len(z) // 2).all(axis=0)


def _bound_motion(q_start: Array, duration: float, limits: JointLimits) -> _Bounds:
    """Builds bounds on angles and rates during a swing, and on the angles after it."""
    u, D, each = _CHECKED[:, None], duration, np.eye(len(q_start))
    of_q, of_v = [3.0 * u**2 - 2.0 * u**3, D * (u**3 - u**2)], [6.0 * (u - u**2) / D, 3.0 * u**2 - 2.0 * u]
    of_start = [1.0 - 3.0 * u**2 + 2.0 * u**3, 6.0 * (u**2 - u) / D, np.zeros((1, 1))]
    fixed = np.kron(np.vstack(of_start), each) @ q_start
    matrix = np.kron(np.vstack([np.hstack(of_q), np.hstack(of_v), [1.0, COASTING_TIME]]), each)
    count = len(_CHECKED)
    lower, upper = (
        np.concatenate([np.tile(q, count), np.tile(v, count), q]) - fixed
        for q, v in ((limits.q_lower, -limits.v_max), (limits.q_upper, limits.v_max))
    )
    return _Bounds(matrix, lower, upper)


def _solve(program: MathematicalProgram, z: Array, condition: StrikeCondition) -> Array | None:
    """Searches the optimal strike (q_1, v_1). Returns None if the search fails."""
    result = SnoptSolver().Solve(program)
    found: Array = result.GetSolution(z)
    return found if result.is_success() and condition.is_met(found) else None


def _guess_end(model: ArmModel, target: Target, speed: float) -> Array:
    """Returns initial values for angles and rates at the strike, (2 num_joints,).

    These are the start angles, and the smallest rates that give S the required velocity.
    """
    model.set_posture(target.q_start)
    J = model.compute_point_jacobian(target.p_TS)
    return np.concatenate([target.q_start, np.linalg.pinv(J) @ (speed * target.direction_W)])
