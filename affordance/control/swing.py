"""Swing of a blow: from rest to a strike with a given velocity, by minimum angular acceleration.

Among all motions of duration D from rest at q_0 to angles q_1 with rates v_1, the integral of |vdot|^2 is least for
the cubic in time, and is then

    12 |d|^2 / D^3 - 12 d^T v_1 / D^2 + 4 |v_1|^2 / D,    d = q_1 - q_0

The degrees of freedom of (q_1, v_1) that remain once the striking point has its position and velocity and meets the
target squarely are chosen to minimise this, within the joints' limits. A cubic is the motion of minimum acceleration
between any two of its own points, so that a controller that plans by minimum acceleration to points of it follows it
exactly.
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

# Times of a swing at which position and velocity limits are enforced, as fractions of its duration: between them a
# joint of 50 rad/s^2 violates them by a milliradian.
_CHECKED = np.linspace(0.02, 1.0, 50)
# Scales of the optimisation: costs count in hundreds of rad^2/s^3, misses in decimetres and m/s.
_COST_SCALE, _PLACE_SCALE = 1e-2, 10.0
_MAX_MISS = 1e-5
# Distance from a limit at which a swing counts as touching it, [rad], [rad/s].
_TOUCH = 1e-3
# The nail is at rest within 13 ms of the first touch for effective masses of 0.15 to 2.4 kg, as on arms of twenty
# robots; then the arm begins to return. If rotors make it 6 kg the nail takes 20 ms, and the force is reached too,
# [s].
FOLLOW_THROUGH = 0.015
# A controller that plans in steps of 20 ms deviates from a swing's angles by about a degree; swings keep this margin
# to the limits, [rad].
_MARGIN = np.radians(1.0)
# Time of coasting to rest: a joint keeps its rate while the nail is driven and is then braked evenly within 0.1 s,
# less than half of the controller's horizon. Angles must be free for this time beyond the strike, [s].
COASTING_TIME = FOLLOW_THROUGH + 0.5 * 0.1
# A face closer than half of a hand's breadth lies under the hand (models/README.md), [m].
_HAND = 0.044
# Cosine from which on a face looks along the blow, within 60 degrees of it: the search for a strike stays there.
ALONG = 0.5


class Swing(NamedTuple):
    """Swing from rest, a cubic in time."""

    q_start: Array  # joint angles at the beginning, shape (num_joints,), [rad]
    q_end: Array  # joint angles at the strike, shape (num_joints,), [rad]
    v_end: Array  # joint velocities at the strike, shape (num_joints,), [rad/s]
    duration: float  # time from rest to the strike, [s]

    def evaluate(self, times: Array) -> tuple[Array, Array, Array]:
        """Computes angles, rates and accelerations at N times, (N, num_joints) each, also beyond the ends."""
        D = self.duration
        u = np.asarray(times)[:, None] / D
        d = self.q_end - self.q_start
        square, cube = 3.0 * d - D * self.v_end, D * self.v_end - 2.0 * d
        q = self.q_start + square * u**2 + cube * u**3
        return q, (2.0 * square * u + 3.0 * cube * u**2) / D, (2.0 * square + 6.0 * cube * u) / D**2


class Target(NamedTuple):
    """Target of a blow, with the striking point S on the tool's surface."""

    q_start: Array  # joint angles at the start of the swing, shape (num_joints,), [rad]
    p_TS: Array  # position of S in the tool, shape (3,), [m]
    normal_T: Array  # outward normal of the tool at S, expressed in T, shape (3,)
    radius: float  # radius of the tool's curvature at S; infinite where the tool is flat, [m]
    p_WS: Array  # position of S at the strike, shape (3,), [m]
    direction_W: Array  # direction of the blow, and of the tool's normal at the strike, a unit vector, shape (3,)


class StrikeCondition:
    """Condition of a strike on angles and velocities, stacked to z = (q_1, v_1): its miss is zero at the strike.

    A face that is square to the blow may also look away from the target, which the tool would have to go through.
    Where the face does not look along the blow at the start, the cosine between them is bounded too.
    """

    def __init__(self, model: ArmModel, target: Target, speed: float) -> None:
        """Stores the model of the arm, whose state each use changes, the target, and the tip's speed, [m/s]."""
        self._model = model
        self._target = target
        self._velocity_W = speed * target.direction_W
        self._across = np.linalg.svd(target.direction_W[None])[2][1:]  # two directions across the blow
        model.set_posture(target.q_start)
        turned = [] if target.direction_W @ self._compute_normal() > ALONG else [np.inf]
        self.lower: Array = np.zeros(8 + len(turned))  # least and largest value of each entry, (8,) or (9,)
        self.upper: Array = np.array([0.0] * 8 + turned)

    def compute(self, z: Array) -> Array:
        """Computes the miss of position, velocity and squareness, and the cosine; (8,) or (9,), z (2 num_joints,)."""
        model, target, n = self._model, self._target, len(z) // 2
        model.set_posture(z[:n])
        p_WS, J = model.compute_point_position(target.p_TS), model.compute_point_jacobian(target.p_TS)
        normal_W = self._compute_normal()
        along = J @ z[n:] - self._velocity_W
        facing = [*(self._across @ normal_W), target.direction_W @ normal_W]
        return np.concatenate([_PLACE_SCALE * (p_WS - target.p_WS), along, facing])[: len(self.lower)]

    def _compute_normal(self) -> Array:
        """Normal of the face in W, at the model's state, shape (3,)."""
        normal_W: Array = self._model.compute_hand_pose().rotation().matrix() @ self._target.normal_T
        return normal_W

    def compute_with_gradient(self, z: Array) -> Array:
        """Computes the miss for Drake's AutoDiff, with its exact gradient.

        Turning joint i turns all that lies beyond it about its axis w_i, with w_i = 0 for a sliding joint: a column
        J_j of the Jacobian of S changes by w_i x J_j for j >= i and by w_j x J_i for j < i.
        """
        value = ExtractValue(z).ravel()
        n = len(value) // 2
        missed = self.compute(value)  # leaves the model at these angles
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
        """Returns whether the miss is within the tolerance and the face looks along the blow."""
        is_near = bool(np.abs(self.compute(z)[:8]).max() <= _MAX_MISS)
        return is_near and bool(self._target.direction_W @ self._compute_normal() > 0.0)


def find_target(
    model: ArmModel, parts: Sequence[PosedShape], *, q_start: Array, offset_W: Array, direction_W: Array
) -> Target:
    """Finds the striking point of a tool, and leaves the model at rest at the start, q_start, (num_joints,), [rad].

    The striking point is the middle of the striking face furthest ahead of the hand. A tool without a striking face
    clear of the hand strikes with the point of its free part that lies furthest along the blow, a unit vector, at its
    start. The target is at an offset, (3,), [m], from the striking point at the start.
    """
    model.set_posture(q_start)
    ahead = []
    for part in parts:
        for face in part.strikes:
            p_TS, normal_T = face.express(part.X_TE)
            if p_TS[0] > _HAND:
                ahead.append((p_TS, normal_T, part.shape.compute_curvature_radius(face.normal_E)))
    if ahead:
        p_TS, normal_T, radius = max(ahead, key=lambda each: float(each[0][0]))
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
    """Plans a swing from rest, searched from a guess or from the start posture, and changes the model's state.

    The speed at the strike is in [m/s], the time until then in [s]. An AffordanceError is raised where no swing
    within position and velocity limits strikes so.
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
    # Most joints come near no limit. Those of a joint enter the program where the guess touches or the swing violates
    # one, and all of them where there is no swing otherwise.
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
    """Bounds of angles and velocities over a swing, linear in z = (q_1, v_1): lower <= matrix z <= upper."""

    matrix: Array
    lower: Array
    upper: Array

    def find_within(self, z: Array, margin: float) -> NDArray[np.bool_]:
        """Returns for each joint whether it is within its bounds by more than a margin, (num_joints,)."""
        value = self.matrix @ z
        within = (value - self.lower >= margin) & (self.upper - value >= margin)
        return within.reshape(-1, len(z) // 2).all(axis=0)


def _bound_motion(q_start: Array, duration: float, limits: JointLimits) -> _Bounds:
    """Bounds angles and velocities at the checked times, and angles where the joints have coasted to rest."""
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
    """Solves for (q_1, v_1); None if the search fails or what it finds does not strike."""
    result = SnoptSolver().Solve(program)
    found: Array = result.GetSolution(z)
    return found if result.is_success() and condition.is_met(found) else None


def _guess_end(model: ArmModel, target: Target, speed: float) -> Array:
    """Returns the start angles, with the least rates that give S its velocity there, (2 num_joints,)."""
    model.set_posture(target.q_start)
    J = model.compute_point_jacobian(target.p_TS)
    return np.concatenate([target.q_start, np.linalg.pinv(J) @ (speed * target.direction_W)])
