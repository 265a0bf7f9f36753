"""Planning problem of the controller: settings, and the goal at the end of the horizon."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.files.constraints import CheckedFields, Setting, Whole, Within


@dataclass(frozen=True)
class MpcSettings(CheckedFields):
    """Settings of the controller, shared by all tasks (docs/decisions/0005-controller.md).

    Attributes:
        horizon: Planning horizon, T, [s].
        num_steps: Number of steps of a plan, N.
        goal_weight: Weight of the goal error relative to acceleration, dimensionless.
        always_program: If True, the quadratic program computes every plan. If no limit is active, the closed form
            gives the same plan in at most a tenth of the time.
    """

    horizon: Annotated[
        float,
        Within(1e-3, 60.0),
        Setting("s", "one cycle of perceiving, deciding and moving in a correction (Card, Moran & Newell 1983)"),
    ] = 0.24
    num_steps: Annotated[
        int, Whole(1, 400), Setting("1", "steps of four control periods (docs/decisions/0005-controller.md)")
    ] = 12
    goal_weight: Annotated[
        float,
        Within(1e-6, 1e18),
        Setting("1", "the error is a millionth of the distance to the goal (docs/decisions/0005-controller.md)"),
    ] = 1e6
    always_program: Annotated[
        bool, Setting("", "the closed form gives the same plan (docs/decisions/0005-controller.md)")
    ] = False


class TerminalGoal(NamedTuple):
    """Linear goal at the end of the horizon: C_q q_N = d_q and C_v v_N = d_v."""

    C_q: Array  # matrix for the angles, shape (m_q, num_joints)
    d_q: Array  # right-hand side for the angles, shape (m_q,)
    C_v: Array  # matrix for the rates, shape (m_v, num_joints)
    d_v: Array  # right-hand side for the rates, shape (m_v,)


def compute_responses(settings: MpcSettings) -> tuple[Array, Array]:
    """Computes angles and rates after each step (rows) for unit acceleration in each step (columns), (N, N) each."""
    N = settings.num_steps
    h = settings.horizon / N
    steps = np.arange(1, N + 1)
    return h**2 * np.tri(N) * (steps[:, None] - steps + 0.5), h * np.tri(N)
