"""What every experiment checks before it writes anything."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from affordance.exceptions import BadValueError
from affordance.settings import Settings
from affordance.static_hold import StaticHold
from affordance.tools import Tool
from affordance.trial import get_runner


def check_tools_can_be_held(path: Path, tools: Sequence[Tool], settings: Settings) -> None:
    """Builds every Diagram, and compares every static torque of the home posture with its limit.

    Args:
        path: The file the tools are from.
        tools: All that will be held.
        settings: Those of the experiment.

    Raises:
        BadValueError: A tool is too heavy for a joint.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    for tool in tools:
        arm = get_runner(settings).get_diagram(tool).arm
        hold = StaticHold(arm)
        tau = np.abs(hold.tau_arm + hold.Y @ tool.parameters)
        worst = int(np.argmax(tau / arm.limits.tau_max))
        if tau[worst] > arm.limits.tau_max[worst]:
            raise BadValueError(
                path,
                f"tools: {tool.name}",
                f"weighs {tool.mass:.3g} kg and loads {arm.joint_names[worst]} with {tau[worst]:.3g} N m in the home "
                f"posture, must be at most {arm.limits.tau_max[worst]:.3g} N m",
            )
