"""Plans swings of least work under arm and tool dynamics.

The swings are compared with minimum acceleration.

The motion is a spline of degree five in joint space, from rest at the start of the given swing to the same strike.
Time, place, velocity of the tip, squareness of the face, and room to come to rest are the same. Among such motions
that keep the limits of angle, velocity and torque, the search minimises the absolute work,

    integral of sum_i |tau_i v_i| dt,

with tau from inverse dynamics at Gauss-Lobatto nodes, using the exact gradient. The problem is not convex, so the
result is a local optimum near the start of the search (docs/decisions/0013-nail.md).
"""

from typing import NamedTuple, cast

import numpy as np
from numpy.polynomial.legendre import Legendre
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import BsplineBasis, KnotVectorType
from pydrake.solvers import MathematicalProgram, SnoptSolver
from pydrake.trajectories import BsplineTrajectory, Trajectory

from affordance.arrays import Array
from affordance.control.swing import COASTING_TIME, StrikeCondition, Swing, Target
from affordance.exceptions import AffordanceError
from affordance.plant.arm_model import ArmModel
from studies.robustness.inverse_dynamics import InverseDynamics

_ORDER = 6  # degree five, for which torques are as smooth as cubic splines
_NODES_A_PIECE = 6  # number of nodes per piece, exact for polynomials of degree nine
# Work has a kink wherever a joint comes to rest or a torque changes sign. The kink is smoothed, first with the larger
# value, then with the smaller one, which is a hundredth of the power of a blow, [W].
_ROUNDING = (1.0, 0.1)
# Scale of the control points for the search, [rad].
_ANGLE_SCALE = 0.1
# Relative violation of the torque limits that is accepted at the nodes.
_TORQUE_TOLERANCE = 1e-4
# Number of times at which motions are reported: every 0.5 to 1 ms for swings of 0.4 to 0.8 s.
_NUM_TIMES = 801


class OptimalSwing(NamedTuple):
    """Motion from rest to a strike, with its torques and work."""

    times: Array  # times, (T,), [s]
    q: Array  # joint angles, (T, num_joints), [rad]
    v: Array  # joint rates, (T, num_joints), [rad/s]
    vdot: Array  # joint accelerations, (T, num_joints), [rad/s^2]
    tau: Array  # torques, (T, num_joints), [N m]
    work: float  # absolute work of the joints, [J]
    converged: bool  # true if the search ended at an optimum, or there was no search


class SwingSearch:
    """Search for splines with the same strike as a given swing.

    Attributes:
        start: Control points of the given swing, (num_pieces + 5, num_joints), [rad].
    """

    def __init__(self, model: ArmModel, target: Target, swing: Swing, pi: Array, *, num_pieces: int = 4) -> None:
        """Builds basis and nodes.

        The search changes the model's state and payload.

        The tool's inertial parameters pi, (10,), are about To, expressed in T.
        """
        self._limits = model.arm.limits
        self._dynamics = InverseDynamics(model, pi)
        num_points = num_pieces + _ORDER - 1
        basis = BsplineBasis(_ORDER, num_points, KnotVectorType.kClampedUniform, 0.0, swing.duration)
        # The value of this spline at a given time is the row of the control points' weights; the same holds for its
        # derivatives.
        weights = BsplineTrajectory(basis, list(np.eye(num_points)[:, :, None]))
        rates = cast(BsplineTrajectory, weights.MakeDerivative(1))
        self._splines: tuple[Trajectory, ...] = (weights, rates, weights.MakeDerivative(2))
        # Maps control points of the angles to those of the velocities, except the first, which is zero.
        self._rate_hull = np.array(rates.control_points())[1:, :, 0]  # (num_points - 2, num_points)
        self._nodes, self._quadrature = _build_lobatto(swing.duration, num_pieces)
        self._at_nodes = self._evaluate_basis(self._nodes)  # (3, N, num_points)
        self._times = np.linspace(0.0, swing.duration, _NUM_TIMES)
        self._q_start = swing.q_start
        self.start = self.fit(swing.evaluate(self._times)[0])
        model.set_state(np.concatenate([swing.q_end, swing.v_end]))
        speed = target.direction_W @ model.compute_point_jacobian(target.p_TS) @ swing.v_end
        self._condition = StrikeCondition(model, target, float(speed))
        self._last: tuple[bytes, Array, Array, Array] | None = None

    def fit(self, q: Array) -> Array:
        """Fits control points of a motion from rest to given angles, by least squares.

        The angles are at the reported times.

        Returns:
            Control points, shape (num_pieces + 5, num_joints), [rad].
        """
        points: Array = np.linalg.lstsq(self._evaluate_basis(self._times)[0], q)[0]
        points[:2] = self._q_start  # at rest
        return points

    def find_least_work(self) -> OptimalSwing:
        """Searches for the motion of least work, starting from the given swing.

        Raises:
            AffordanceError: No motion that keeps the limits was found.
        """
        points, converged = self.start, True
        for rounding in _ROUNDING:
            points, converged = self._minimise(rounding, points)
        return self.measure(points, converged)

    def measure(self, points: Array, converged: bool = True) -> OptimalSwing:
        """Computes torques and work of the motion with given control points."""
        q, v, vdot = self._evaluate_basis(self._times) @ points
        return measure_motion(self._dynamics, self._times, q, v, vdot, converged=converged)

    def compute_cost(self, rounding: float, points: Array) -> tuple[float, Array]:
        """Computes the smoothed work of a motion, [J], and its gradient, (m,).

        The gradient is by the free control points.
        """
        tau, v, by_points = self._compute_torques(points)
        value, by_tau, by_v = compute_rounded_power(rounding, tau, v)
        w = self._quadrature
        # (points, joints): derivative through the torques, and derivative through the velocities.
        gradient = np.einsum("k,ki,kijl->jl", w, by_tau, by_points)
        gradient += np.einsum("k,kj,kl->jl", w, self._at_nodes[1][:, 2:], by_v)
        return float(w @ value), gradient.ravel()

    def _minimise(self, rounding: float, start: Array) -> tuple[Array, bool]:
        """Searches for optimal control points from a start.

        Returns them, and True if the search converged.
        """
        n, num_free = start.shape[1], len(start) - 2
        q_lower, q_upper, v_max, tau_max = self._limits
        program = MathematicalProgram()
        c = program.NewContinuousVariables(num_free, n, "c")
        program.SetInitialGuess(c, start[2:])
        z = c.ravel()
        for variable in z:
            program.SetVariableScaling(variable, _ANGLE_SCALE)

        def complete(value: Array) -> Array:
            return np.vstack([start[:2], value.reshape(-1, n)])

        first, _ = self.compute_cost(rounding, start)

        def compute_cost(z: Array) -> Array:
            cost, gradient = self.compute_cost(rounding, complete(ExtractValue(z)))
            slope = gradient[None] / first @ ExtractGradient(z)
            with_gradient: Array = InitializeAutoDiff(np.array([cost / first]), slope)
            scalar: Array = with_gradient[0, 0]
            return scalar

        def compute_torques(z: Array) -> Array:
            tau, _, by_points = self._compute_torques(complete(ExtractValue(z)))
            jacobian = (by_points / tau_max[:, None, None]).reshape(tau.size, -1)
            with_gradient: Array = InitializeAutoDiff((tau / tau_max).ravel(), jacobian @ ExtractGradient(z)).ravel()
            return with_gradient

        program.AddCost(compute_cost, z)
        ones = np.ones(len(self._nodes) * n)
        program.AddConstraint(compute_torques, -ones, ones, z)
        # A spline stays within the hull of its control points, and its velocity within that of the velocity's control
        # points.
        program.AddBoundingBoxConstraint(np.tile(q_lower, num_free), np.tile(q_upper, num_free), z)
        for row in self._rate_hull:
            chosen = np.flatnonzero(row[2:])
            matrix = np.kron(row[2:][chosen], np.eye(n))
            fixed = row[:2] @ start[:2]
            program.AddLinearConstraint(matrix, -v_max - fixed, v_max - fixed, c[chosen].ravel())
        # At the end the angles are the last control point, and velocities follow from the difference of the last two.
        rate = self._rate_hull[-1, -1]
        end = np.kron([[0.0, 1.0], [-rate, rate]], np.eye(n))  # (2 n, 2 n)
        last = c[-2:].ravel()
        program.AddConstraint(
            lambda z: self._condition.compute_with_gradient(end @ z),
            self._condition.lower,
            self._condition.upper,
            last,
        )
        program.AddLinearConstraint(end[:n] + COASTING_TIME * end[n:], q_lower, q_upper, last)
        result = SnoptSolver().Solve(program)
        found = complete(result.GetSolution(c))
        if not self._keeps_torques(found) or not self._condition.is_met(end @ found[-2:].ravel()):
            raise AffordanceError(
                f"no swing of {self._times[-1]:g} s within position, velocity and torque limits was found"
            )
        if self._keeps_torques(start) and self.compute_cost(rounding, found)[0] > first:
            return start, False
        return found, result.is_success()

    def _keeps_torques(self, points: Array) -> bool:
        tau, _, _ = self._compute_torques(points)
        return bool((np.abs(tau) <= (1.0 + _TORQUE_TOLERANCE) * self._limits.tau_max).all())

    def _compute_torques(self, points: Array) -> tuple[Array, Array, Array]:
        """Computes torques and velocities at the nodes, and the torques' derivatives.

        Derivatives are by the free control points.

        Returns:
            Arrays (N, num_joints), (N, num_joints) and (N, num_joints, num_points - 2, num_joints).
        """
        key = points.tobytes()
        if self._last is None or self._last[0] != key:
            q, v, vdot = self._at_nodes @ points
            gradients = self._dynamics.compute_gradients(q, v, vdot)
            free = self._at_nodes[:, :, None, 2:, None]  # (3, N, 1, num_points - 2, 1)
            by_points = sum(weights * slope[:, :, None] for weights, slope in zip(free, gradients[1:], strict=True))
            self._last = key, gradients.tau, v, np.asarray(by_points)
        return self._last[1:]

    def _evaluate_basis(self, times: Array) -> Array:
        """Computes weights of control points in angle, velocity and acceleration, (3, N, num_points).

        There are N times.
        """
        return np.array([spline.vector_values(list(times)).T for spline in self._splines])


def compute_rounded_power(rounding: float, tau: Array, v: Array) -> tuple[Array, Array, Array]:
    """Computes the smoothed integrand of the work and its derivatives.

    It is sum_i sqrt((tau_i v_i)^2 + e^2) - e.
    """
    power = tau * v
    root = np.sqrt(power**2 + rounding**2)
    share = power / root
    return np.sum(root - rounding, axis=1), share * v, share * tau


def measure_motion(
    dynamics: InverseDynamics, times: Array, q: Array, v: Array, vdot: Array, *, converged: bool
) -> OptimalSwing:
    """Computes torques and work of a motion.

    Angles, velocities and accelerations are (T, num_joints).
    """
    tau = dynamics.compute(q, v, vdot)
    work = np.trapezoid(np.abs(tau * v).sum(axis=1), times)
    return OptimalSwing(times, q, v, vdot, tau, float(work), converged)


def _build_lobatto(duration: float, num_pieces: int) -> tuple[Array, Array]:
    """Computes nodes and weights of the Gauss-Lobatto rule on equal pieces, (N,) each.

    Pieces share their ends.
    """
    last = _NODES_A_PIECE - 1
    legendre = Legendre.basis(last)
    inner = np.sort(legendre.deriv().roots().real)
    places = np.concatenate([[-1.0], inner, [1.0]])
    weights = 2.0 / (_NODES_A_PIECE * last * legendre(places) ** 2)
    half = 0.5 * duration / num_pieces
    nodes, total = np.zeros(num_pieces * last + 1), np.zeros(num_pieces * last + 1)
    for piece in range(num_pieces):
        chosen = slice(piece * last, piece * last + _NODES_A_PIECE)
        nodes[chosen] = half * (2 * piece + 1 + places)
        total[chosen] += half * weights
    return nodes, total
