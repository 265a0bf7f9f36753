"""Swings that minimise work given the dynamics of arm and tool.

The motion is a quintic spline in joint space that starts at rest and ends with the same strike as a given swing:
time, position and velocity of the tip, orientation of the face, and distance for stopping are equal. Subject to
limits of angles, velocities and torques, the search minimises the absolute work,

    integral of sum_i |tau_i v_i| dt,

with tau from inverse dynamics at Gauss-Lobatto nodes and exact gradients. The problem is not convex, so the result is
a local optimum near the initial guess (docs/decisions/0013-nail.md).
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

_ORDER = 6  # order of a quintic spline, for which torques are as smooth as a cubic spline
_NODES_A_PIECE = 6  # number of quadrature nodes per piece, which is exact for polynomials of degree nine
# Absolute power is not smooth where a velocity or torque changes sign. It is smoothed in two rounds, with these
# parameters, [W]. The second is a hundredth of the power of a blow.
_ROUNDING = (1.0, 0.1)
# Scale of control points in the search, [rad].
_ANGLE_SCALE = 0.1
# Largest relative violation of torque limits at the nodes.
_TORQUE_TOLERANCE = 1e-4
# Number of time steps in results: 0.5 to 1 ms each for swings of 0.4 to 0.8 s.
_NUM_TIMES = 801


class OptimalSwing(NamedTuple):
    """Motion from rest to a strike, with joint torques and work."""

    times: Array  # (T,), [s]
    q: Array  # joint angles, (T, num_joints), [rad]
    v: Array  # joint velocities, (T, num_joints), [rad/s]
    vdot: Array  # joint accelerations, (T, num_joints), [rad/s^2]
    tau: Array  # joint torques, (T, num_joints), [N m]
    work: float  # absolute work of the joints, [J]
    converged: bool  # True if the search converged, or if there was no search


class SwingSearch:
    """Optimisation of splines with the same strike as a given swing.

    Attributes:
        start: Control points of the given swing, (num_pieces + 5, num_joints), [rad].
    """

    def __init__(self, model: ArmModel, target: Target, swing: Swing, pi: Array, *, num_pieces: int = 4) -> None:
        """Builds spline basis and quadrature nodes.

        Args:
            model: Model of the arm, whose state and payload are changed.
            target: Required strike.
            swing: Given swing.
            pi: Inertial parameters of the tool about To, expressed in T, (10,).
            num_pieces: Number of pieces of the spline.
        """
        self._limits = model.arm.limits
        self._dynamics = InverseDynamics(model, pi)
        num_points = num_pieces + _ORDER - 1
        basis = BsplineBasis(_ORDER, num_points, KnotVectorType.kClampedUniform, 0.0, swing.duration)
        # Values of this spline are the weights of all control points at a given time, and its derivatives are the
        # weights for derivatives.
        weights = BsplineTrajectory(basis, list(np.eye(num_points)[:, :, None]))
        rates = cast(BsplineTrajectory, weights.MakeDerivative(1))
        self._splines: tuple[Trajectory, ...] = (weights, rates, weights.MakeDerivative(2))
        # Maps control points of angles to control points of velocities, except the first, which is zero.
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
        """Fits control points of a motion from rest to angles at the time steps of results, using least squares.

        Returns: Control points, (num_pieces + 5, num_joints), [rad].
        """
        points: Array = np.linalg.lstsq(self._evaluate_basis(self._times)[0], q)[0]
        points[:2] = self._q_start  # at rest
        return points

    def find_least_work(self) -> OptimalSwing:
        """Minimises work, starting from the given swing.

        Raises:
            AffordanceError: No motion within the limits was found.
        """
        points, converged = self.start, True
        for rounding in _ROUNDING:
            points, converged = self._minimise(rounding, points)
        return self.measure(points, converged)

    def measure(self, points: Array, converged: bool = True) -> OptimalSwing:
        """Computes joint torques and work of the motion with given control points."""
        q, v, vdot = self._evaluate_basis(self._times) @ points
        return measure_motion(self._dynamics, self._times, q, v, vdot, converged=converged)

    def compute_cost(self, rounding: float, points: Array) -> tuple[float, Array]:
        """Computes smoothed work, [J], and its gradient with respect to free control points, (m,)."""
        tau, v, by_points = self._compute_torques(points)
        value, by_tau, by_v = compute_rounded_power(rounding, tau, v)
        w = self._quadrature
        # Derivatives via torques and via velocities, (points, joints).
        gradient = np.einsum("k,ki,kijl->jl", w, by_tau, by_points)
        gradient += np.einsum("k,kj,kl->jl", w, self._at_nodes[1][:, 2:], by_v)
        return float(w @ value), gradient.ravel()

    def _minimise(self, rounding: float, start: Array) -> tuple[Array, bool]:
        """Optimises control points.

        Returns: Optimal control points, and True if the search converged.
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
        # Angles are within the convex hull of their control points, as are velocities.
        program.AddBoundingBoxConstraint(np.tile(q_lower, num_free), np.tile(q_upper, num_free), z)
        for row in self._rate_hull:
            chosen = np.flatnonzero(row[2:])
            matrix = np.kron(row[2:][chosen], np.eye(n))
            fixed = row[:2] @ start[:2]
            program.AddLinearConstraint(matrix, -v_max - fixed, v_max - fixed, c[chosen].ravel())
        # Final angles are the last control point. Final velocities follow from the last two control points.
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
        """Computes joint torques and velocities at N nodes, and derivatives of torques.

        Returns: Torques and velocities, (N, num_joints) each, and derivatives with respect to free control points,
            (N, num_joints, num_points - 2, num_joints).
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
        """Computes weights of control points for angle, velocity and acceleration at N times, (3, N, num_points)."""
        return np.array([spline.vector_values(list(times)).T for spline in self._splines])


def compute_rounded_power(rounding: float, tau: Array, v: Array) -> tuple[Array, Array, Array]:
    """Computes smoothed absolute power, sum_i sqrt((tau_i v_i)^2 + e^2) - e, and its derivatives."""
    power = tau * v
    root = np.sqrt(power**2 + rounding**2)
    share = power / root
    return np.sum(root - rounding, axis=1), share * v, share * tau


def measure_motion(
    dynamics: InverseDynamics, times: Array, q: Array, v: Array, vdot: Array, *, converged: bool
) -> OptimalSwing:
    """Computes torques and work of a motion, given angles, velocities and accelerations, (T, num_joints) each."""
    tau = dynamics.compute(q, v, vdot)
    work = np.trapezoid(np.abs(tau * v).sum(axis=1), times)
    return OptimalSwing(times, q, v, vdot, tau, float(work), converged)


def _build_lobatto(duration: float, num_pieces: int) -> tuple[Array, Array]:
    """Computes nodes and weights of the composite Gauss-Lobatto rule on equal pieces, (N,) each."""
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
