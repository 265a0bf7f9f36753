"""Swings that the arm's and the tool's dynamics make cheapest, to compare swings of minimum acceleration with.

The motion is a spline of degree five in joint space, from rest where that starts, that strikes as the swing it is
compared with does: at the same time and place, with the same velocity of the tip and as squarely, and with the same
room to come to rest in. Of such motions that keep the limits of angle, rate and torque, one is sought that needs
least

    effort  integral of |tau|^2 dt,    or    absolute work  integral of sum_i |tau_i v_i| dt,

with tau from inverse dynamics at nodes of Gauss and Lobatto's rule, and its exact gradient. Neither is convex: what
is found is the best near where the search began, not the best there is
(docs/decisions/0017-dynamically-consistent-swing.md).
"""

from collections.abc import Callable
from functools import partial
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
from affordance.plant.inverse_dynamics import InverseDynamics

# Of torques and rates at the nodes, (N, num_joints) each: what is integrated, (N,), and its derivatives by both.
Integrand = Callable[[Array, Array], tuple[Array, Array, Array]]

_ORDER = 6  # degree five: torques are then as smooth as cubic splines
_NODES_A_PIECE = 6  # exact for polynomials of degree nine
# Work has a kink wherever a joint comes to rest or a torque turns around: first it is rounded off by so much, then by
# less, which is a hundredth of the power of a blow, [W].
_ROUNDING = (1.0, 0.1)
# Points of the angles that the search takes for steps of about one, [rad].
_ANGLE_SCALE = 0.1
# By which torques at the nodes may exceed their limits, relative to them.
_TORQUE_TOLERANCE = 1e-4
# Of the grid on which motions are reported: half a millisecond to a millisecond for swings of 0.4 to 0.8 s.
_NUM_TIMES = 801


class OptimalSwing(NamedTuple):
    """A motion from rest to a strike, and what it takes.

    Attributes:
        times: (T,), [s].
        q: Joint angles, (T, num_joints), [rad].
        v: Joint rates, the same shape, [rad/s].
        vdot: Joint accelerations, the same shape, [rad/s^2].
        tau: Torques, the same shape, [N m].
        work: Absolute work of the joints, [J].
        effort: Integral of |tau|^2 dt, [N^2 m^2 s].
        converged: Whether the search ended at an optimum; true where there was none.
    """

    times: Array
    q: Array
    v: Array
    vdot: Array
    tau: Array
    work: float
    effort: float
    converged: bool


class SwingComparison(NamedTuple):
    """One blow, swung in three ways."""

    least_acceleration: OptimalSwing
    least_effort: OptimalSwing
    least_work: OptimalSwing


def measure_swing(model: ArmModel, swing: Swing, pi: Array) -> OptimalSwing:
    """Computes what a swing of minimum acceleration takes with a tool of inertial parameters pi, (10,)."""
    times = np.linspace(0.0, swing.duration, _NUM_TIMES)
    return _measure(InverseDynamics(model, pi), times, *swing.evaluate(times), converged=True)


def compare_swings(
    model: ArmModel, target: Target, swing: Swing, pi: Array, *, num_pieces: int = 4
) -> SwingComparison:
    """Computes what a blow takes by minimum acceleration, and at the least by effort and by work.

    Args:
        model: The arm; its state and payload are set.
        target: What is struck, and with which point.
        swing: The swing of minimum acceleration, from which both searches start.
        pi: The tool's inertial parameters about To, expressed in T, shape (10,).
        num_pieces: Of the splines.

    Raises:
        AffordanceError: No motion that keeps the limits was found.
    """
    search = SwingSearch(model, target, swing, pi, num_pieces=num_pieces)
    return SwingComparison(measure_swing(model, swing, pi), search.find_least_effort(), search.find_least_work())


class SwingSearch:
    """Searches splines that do what a given swing does.

    Attributes:
        start: Control points of the given swing, (num_pieces + 5, num_joints), [rad].
    """

    def __init__(self, model: ArmModel, target: Target, swing: Swing, pi: Array, *, num_pieces: int = 4) -> None:
        """Builds basis and nodes; arguments are those of ``compare_swings``."""
        self._limits = model.arm.limits
        self._dynamics = InverseDynamics(model, pi)
        num_points = num_pieces + _ORDER - 1
        basis = BsplineBasis(_ORDER, num_points, KnotVectorType.kClampedUniform, 0.0, swing.duration)
        # Its value at a time is the row of weights of the control points; and so for the derivatives.
        weights = BsplineTrajectory(basis, list(np.eye(num_points)[:, :, None]))
        rates = cast(BsplineTrajectory, weights.MakeDerivative(1))
        self._splines: tuple[Trajectory, ...] = (weights, rates, weights.MakeDerivative(2))
        # Control points of the rates but the first, which is zero, from those of the angles.
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
        """Control points of the motion from rest that comes closest to angles at the times of reports.

        Args:
            q: Angles, as in ``OptimalSwing``.

        Returns: Shape (num_pieces + 5, num_joints), [rad].
        """
        points: Array = np.linalg.lstsq(self._evaluate_basis(self._times)[0], q)[0]
        points[:2] = self._q_start  # at rest
        return points

    def find_least_effort(self, start: Array | None = None) -> OptimalSwing:
        """Searches the motion of least effort.

        Args:
            start: Control points from which to search; those of the given swing if None.

        Raises:
            AffordanceError: No motion that keeps the limits was found.
        """
        points, converged = self._minimise(compute_squared_torque, self.start if start is None else start)
        return self.measure(points, converged)

    def find_least_work(self, start: Array | None = None) -> OptimalSwing:
        """Searches the motion of least work; the rest as in ``find_least_effort``."""
        points, converged = self.start if start is None else start, True
        for rounding in _ROUNDING:
            points, converged = self._minimise(partial(compute_rounded_power, rounding), points)
        return self.measure(points, converged)

    def measure(self, points: Array, converged: bool = True) -> OptimalSwing:
        """Computes what the motion of some control points takes."""
        q, v, vdot = self._evaluate_basis(self._times) @ points
        return _measure(self._dynamics, self._times, q, v, vdot, converged=converged)

    def compute_cost(self, integrand: Integrand, points: Array) -> tuple[float, Array]:
        """Computes an integral of a motion, and its gradient by the control points that are free, (m,)."""
        tau, v, by_points = self._compute_torques(points)
        value, by_tau, by_v = integrand(tau, v)
        w = self._quadrature
        # (points, joints): through the torques and, where the integrand has them, through the rates.
        gradient = np.einsum("k,ki,kijl->jl", w, by_tau, by_points)
        gradient += np.einsum("k,kj,kl->jl", w, self._at_nodes[1][:, 2:], by_v)
        return float(w @ value), gradient.ravel()

    def _minimise(self, integrand: Integrand, start: Array) -> tuple[Array, bool]:
        """Searches control points from some; returns them, and whether they are an optimum."""
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

        first, _ = self.compute_cost(integrand, start)

        def compute_cost(z: Array) -> Array:
            cost, gradient = self.compute_cost(integrand, complete(ExtractValue(z)))
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
        # A spline stays within the hull of its control points, and its rate within that of theirs.
        program.AddBoundingBoxConstraint(np.tile(q_lower, num_free), np.tile(q_upper, num_free), z)
        for row in self._rate_hull:
            chosen = np.flatnonzero(row[2:])
            matrix = np.kron(row[2:][chosen], np.eye(n))
            fixed = row[:2] @ start[:2]
            program.AddLinearConstraint(matrix, -v_max - fixed, v_max - fixed, c[chosen].ravel())
        # The end: angles are the last control point, rates its difference from the one before.
        rate = self._rate_hull[-1, -1]
        end = np.kron([[0.0, 1.0], [-rate, rate]], np.eye(n))  # (2 n, 2 n)
        last = c[-2:].ravel()
        program.AddConstraint(
            lambda z: self._condition.compute_with_gradient(end @ z), np.zeros(8), np.zeros(8), last
        )
        program.AddLinearConstraint(end[:n] + COASTING_TIME * end[n:], q_lower, q_upper, last)
        result = SnoptSolver().Solve(program)
        found = complete(result.GetSolution(c))
        if not self._keeps_torques(found) or not self._condition.is_met(end @ found[-2:].ravel()):
            raise AffordanceError(
                f"no swing of {self._times[-1]:g} s within position, velocity and torque limits was found"
            )
        if self._keeps_torques(start) and self.compute_cost(integrand, found)[0] > first:
            return start, False
        return found, result.is_success()

    def _keeps_torques(self, points: Array) -> bool:
        tau, _, _ = self._compute_torques(points)
        return bool((np.abs(tau) <= (1.0 + _TORQUE_TOLERANCE) * self._limits.tau_max).all())

    def _compute_torques(self, points: Array) -> tuple[Array, Array, Array]:
        """Torques and rates at the nodes, and derivatives of torques by the free control points.

        Returns: Shapes (N, num_joints), (N, num_joints), (N, num_joints, num_points - 2, num_joints).
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
        """Weights of the control points in angles, rates and accelerations at N times, (3, N, num_points)."""
        return np.array([spline.vector_values(list(times)).T for spline in self._splines])


def compute_squared_torque(tau: Array, v: Array) -> tuple[Array, Array, Array]:
    """Integrand of the effort."""
    return np.sum(tau**2, axis=1), 2.0 * tau, np.zeros_like(v)


def compute_rounded_power(rounding: float, tau: Array, v: Array) -> tuple[Array, Array, Array]:
    """Integrand of the work, sum_i sqrt((tau_i v_i)^2 + e^2) - e."""
    power = tau * v
    root = np.sqrt(power**2 + rounding**2)
    share = power / root
    return np.sum(root - rounding, axis=1), share * v, share * tau


def _measure(
    dynamics: InverseDynamics, times: Array, q: Array, v: Array, vdot: Array, *, converged: bool
) -> OptimalSwing:
    tau = dynamics.compute(q, v, vdot)
    work = np.trapezoid(np.abs(tau * v).sum(axis=1), times)
    effort = np.trapezoid((tau**2).sum(axis=1), times)
    return OptimalSwing(times, q, v, vdot, tau, float(work), float(effort), converged)


def _build_lobatto(duration: float, num_pieces: int) -> tuple[Array, Array]:
    """Nodes and weights of Gauss and Lobatto's rule on equal pieces, which share their ends; (N,) each."""
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
