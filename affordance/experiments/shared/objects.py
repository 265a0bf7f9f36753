"""Loads objects from a model folder, and checks that they fit an experiment."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from affordance.control.task import Start
from affordance.exceptions import BadValueError, InfeasibleError, ModelFileError
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, Material, load_materials
from affordance.objects.tool import Tool
from affordance.plant.arm import Arm
from affordance.plant.load import load_arm, parse_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import Settings


def read_tools(models: Path, name: str) -> tuple[Tool, ...]:
    """Loads tools from a file of a model folder, with the materials of this folder."""
    return load_tools(models / name, load_materials(models / MATERIALS.name))


def list_looks(tools: Sequence[Tool]) -> list[Material]:
    """Lists the apparent materials of all parts, without duplicates."""
    return list(dict.fromkeys(part.looks_like for tool in tools for part in tool.components))


def check_no_grips(file: Path, tools: Sequence[Tool]) -> None:
    """Checks that no object has grips.

    Raises:
        BadValueError: An object has grips.
    """
    for tool in tools:
        if tool.grips:
            names = ", ".join(grip.name for grip in tool.grips)
            raise BadValueError(file, f"tools: {tool.name}.grips", f"are {names}, must not be given here")


def check_honest(file: Path, tools: Sequence[Tool]) -> None:
    """Checks that each part looks like its material.

    Raises:
        BadValueError: A part looks like another material.
    """
    for tool in tools:
        for i, part in enumerate(tool.components):
            if part.looks_like != part.material:
                problem = f"is {part.looks_like.name!r}, must be what it is made of, {part.material.name!r}"
                raise BadValueError(file, f"tools: {tool.name}.components[{i}].looks_like", problem)


def check_can_be_held(file: Path, tools: Sequence[Tool], settings: Settings, start: Start = ()) -> None:
    """Checks that the arm can hold each tool at rest in a posture.

    Args:
        file: File of the tools, for error messages.
        tools: Tools.
        settings: Settings with the arm.
        start: Start posture of the task; the home posture if empty.

    Raises:
        InfeasibleError: A tool is too heavy for a joint.
        ModelFileError: The arm cannot be loaded, or is too weak for its own weight.
        AffordanceError: The start posture has an unknown joint or violates joint limits.
    """
    arm = load_arm(settings.arm)
    _load_shapes(arm, settings.arm)
    static = StaticHold(arm, arm.find_posture(dict(start)))
    posture = "start" if start else "home"
    for tool in tools:
        # The empty hand is checked first, because an error in the arm's model must not be attributed to the tool.
        for joint, torque, bound in arm.find_overloads(static.tau_arm):
            problem = f"loads {joint} with {torque:.3g} N m in the {posture} posture with an empty hand"
            raise ModelFileError(settings.arm, f"{problem}, must be at most {bound:.3g} N m")
        overloads = arm.find_overloads(static.tau_arm + static.Y @ tool.parameters)
        if overloads:
            joint, torque, bound = max(overloads, key=lambda each: each.torque / each.bound)
            problem = f"weighs {tool.mass:.3g} kg and loads {joint} with {torque:.3g} N m in the {posture} posture"
            raise InfeasibleError(file, f"tools: {tool.name}", f"{problem}, must be at most {bound:.3g} N m")


@lru_cache(maxsize=16)
def _load_shapes(arm: Arm, directives: Path) -> None:
    """Loads an arm's shapes, so that errors in them are found before the replay."""
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    parse_arm(plant, directives)
