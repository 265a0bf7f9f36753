"""What a controller plans: the settings of its horizon, and the goal at the horizon's end."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array


class MpcSettings(NamedTuple):
    """What the controller is free to choose; the same for all tasks.

    Attributes:
        horizon: T, [s].
        num_steps: N.
        goal_weight: Weight of missing the goal against acceleration, dimensionless.
    """

    horizon: float
    num_steps: int
    goal_weight: float = 1e6


class TerminalGoal(NamedTuple):
    """Linear goal at the end of the horizon: C_q q_N = d_q and C_v v_N = d_v.

    Attributes:
        C_q: Shape (m_q, num_joints).
        d_q: Shape (m_q,).
        C_v: Shape (m_v, num_joints).
        d_v: Shape (m_v,).
    """

    C_q: Array
    d_q: Array
    C_v: Array
    d_v: Array


def compute_responses(settings: MpcSettings) -> tuple[Array, Array]:
    """Angles and velocities after each step (rows) per unit acceleration in each step (columns), (N, N) each."""
    N = settings.num_steps
    h = settings.horizon / N
    steps = np.arange(1, N + 1)
    return h**2 * np.tri(N) * (steps[:, None] - steps + 0.5), h * np.tri(N)
