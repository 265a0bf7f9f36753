"""Common methods on the same samples: least squares, without bounds and with a positive semidefinite pseudo-inertia.

Both assume exact gains, and errors that are white and equal at all joints. As is common practice, friction
(direction, velocity, offset) of each joint is fitted together with the ten parameters.
"""

from typing import NamedTuple

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram

from affordance.arrays import Array
from affordance.exceptions import AffordanceError
from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.gains import Gains
from affordance.objects.inertia import NUM_PARAMETERS, pseudo_inertia_from_parameters

# Half-width of a normal 90 % interval, in standard deviations.
TO_90 = 1.645


class PointPayload(NamedTuple):
    """Estimated payload."""

    parameters: Array  # inertial parameters, shape (10,)
    mass_sd: float  # standard deviation of the mass under the assumption of white errors, [kg]


def solve_least_squares(evidence: Evidence, gains: Gains, *, with_load_friction: bool = False) -> PointPayload:
    """Estimates the ten parameters by ordinary least squares, optionally with friction that grows with the load."""
    A, b = _stack(evidence, gains, with_load_friction=with_load_friction)
    solution, *_ = np.linalg.lstsq(A, b, rcond=None)
    residual = b - A @ solution
    variance = float(residual @ residual) / max(len(b) - A.shape[1], 1)
    covariance = variance * np.linalg.pinv(A.T @ A)
    return PointPayload(solution[:NUM_PARAMETERS], float(np.sqrt(covariance[0, 0])))


def solve_semidefinite(evidence: Evidence, gains: Gains) -> PointPayload:
    """Estimates the ten parameters under a positive semidefinite pseudo-inertia, with Clarabel; mass_sd is NaN.

    Raises:
        AffordanceError: The solver fails.
    """
    W, y = eliminate_friction(evidence, gains)
    program = MathematicalProgram()
    pi = program.NewContinuousVariables(NUM_PARAMETERS, "pi")
    scale = float(np.trace(W.T @ W)) / NUM_PARAMETERS
    program.AddQuadraticCost(2.0 * W.T @ W / scale, -2.0 * W.T @ y / scale, pi, is_convex=True)
    units = pseudo_inertia_from_parameters(np.eye(NUM_PARAMETERS))
    program.AddLinearMatrixInequalityConstraint([np.zeros((4, 4)), *units], pi)
    result = ClarabelSolver().Solve(program)
    if not result.is_success():
        raise AffordanceError(f"the semidefinite program fails: {result.get_solution_result()}")
    return PointPayload(result.GetSolution(pi), float("nan"))


def eliminate_friction(evidence: Evidence, gains: Gains, *, with_load_friction: bool = False) -> tuple[Array, Array]:
    """Stacks the rows of all joints after eliminating friction, which is unconstrained, to shrink the problem."""
    A, b = _stack(evidence, gains, with_load_friction=with_load_friction)
    friction, _ = np.linalg.qr(A[:, NUM_PARAMETERS:])
    W = A[:, :NUM_PARAMETERS] - friction @ (friction.T @ A[:, :NUM_PARAMETERS])
    y = b - friction @ (friction.T @ b)
    return W, y


def _stack(evidence: Evidence, gains: Gains, *, with_load_friction: bool = False) -> tuple[Array, Array]:
    """Stacks the rows of all joints, [N m]; columns are ten for the payload, then three for friction per joint."""
    samples = evidence.samples
    num_joints = samples.signal.shape[1]
    rows, right = [], []
    for j in range(num_joints):
        used = samples.used[:, j]
        friction = np.zeros((used.sum(), 3 * num_joints))
        friction[:, 3 * j : 3 * j + 3] = np.column_stack(
            [samples.direction[used, j], samples.velocity[used, j], np.ones(used.sum())]
        )
        share = gains.load_friction[j] * samples.load_sign[used, j, None] if with_load_friction else 0.0
        rows.append(np.hstack([(1.0 + share) * samples.Y[used, j], friction]))
        right.append(samples.signal[used, j] / gains.mean[j, 0])
    return np.vstack(rows), np.concatenate(right)
