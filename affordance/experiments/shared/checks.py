"""What every experiment checks before it writes anything."""

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from affordance.control.start_posture import Start
from affordance.exceptions import BadValueError, ModelFileError
from affordance.objects.colour import SAME_COLOUR, is_same_colour
from affordance.objects.tool import Tool
from affordance.plant.arm import add_arm, load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import Settings


def check_tools_are_honest(path: Path, tools: Sequence[Tool]) -> None:
    """Refuses tools that show what they are not made of.

    Raises:
        BadValueError: One does.
    """
    for tool in tools:
        for i, part in enumerate(tool.components):
            if part.looks_like != part.material:
                problem = f"is {part.looks_like.name!r}, must be what it is made of, {part.material.name!r}"
                raise BadValueError(path, f"tools: {tool.name}.components[{i}].looks_like", problem)


def check_colours_differ(path: Path, tools: Sequence[Tool]) -> None:
    """Refuses tools that show two materials an observer cannot tell apart.

    Raises:
        BadValueError: They do.
    """
    shown = {part.looks_like.name: part.looks_like for tool in tools for part in tool.components}
    for one, other in itertools.combinations(shown.values(), 2):
        if is_same_colour(one.colour, other.colour):
            problem = f"show {one.name} and {other.name}, whose colours must differ by more than {SAME_COLOUR:.2g}"
            raise BadValueError(path, "tools", f"{problem} of full in some channel")


def check_tools_have_one_grip(path: Path, tools: Sequence[Tool]) -> None:
    """Refuses grips where there is nothing to choose.

    Raises:
        BadValueError: A tool has grips.
    """
    for tool in tools:
        if tool.grips:
            names = ", ".join(grip.name for grip in tool.grips)
            raise BadValueError(path, f"tools: {tool.name}.grips", f"are {names}, must not be given here")


def check_tools_can_be_held(path: Path, tools: Sequence[Tool], settings: Settings, start: Start = ()) -> None:
    """Compares every static torque of the posture in which a task starts with its limit.

    Args:
        path: The file the tools are from.
        tools: All that will be held.
        settings: Those of the experiment.
        start: Where the task starts; the home posture if empty.

    Raises:
        AffordanceError: The arm cannot take the posture.
        BadValueError: A tool is too heavy for a joint.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm, or it cannot hold itself.
    """
    add_arm(DiagramBuilder(), settings.arm, tools[0])  # with shapes, which only a replay or a blow would miss
    arm = load_arm(settings.arm)
    hold = StaticHold(arm, arm.find_posture(dict(start)))
    posture = "start" if start else "home"
    for tool in tools:
        for name, torque, bound in zip(arm.joint_names, np.abs(hold.tau_arm), arm.limits.tau_max, strict=True):
            if torque > bound:  # else its own weight, in the wrong units perhaps, would be put down to the tool
                problem = f"loads {name} with {torque:.3g} N m in the {posture} posture with an empty hand"
                raise ModelFileError(settings.arm, f"{problem}, must be at most {bound:.3g} N m")
        tau = np.abs(hold.tau_arm + hold.Y @ tool.parameters)
        worst = int(np.argmax(tau / arm.limits.tau_max))
        if tau[worst] > arm.limits.tau_max[worst]:
            raise BadValueError(
                path,
                f"tools: {tool.name}",
                f"weighs {tool.mass:.3g} kg and loads {arm.joint_names[worst]} with {tau[worst]:.3g} N m in the "
                f"{posture} posture, must be at most {arm.limits.tau_max[worst]:.3g} N m",
            )
