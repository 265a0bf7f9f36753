"""The objects from which Simulations II to IV learn: two honest ones of equal mass, and a decoy."""

from pathlib import Path

import numpy as np

from affordance.exceptions import BadValueError
from affordance.experiments.shared.checks import (
    check_colours_differ,
    check_tools_are_honest,
    check_tools_have_one_grip,
)
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_materials, load_tools
from affordance.objects.tool import Tool

# Masses that differ by less than this fraction are equal: what is left is rounding.
SAME_MASS = 1e-9
# Centres of mass closer than this are not different, [m].
_APART = 1e-3


def load_learning_objects(models: Path = MODELS) -> tuple[Tool, Tool, Tool]:
    """Reads the three objects from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
    """
    path = models / "tools" / "com.yaml"
    tools = load_tools(path, load_materials(models / "materials.yaml"))
    if len(tools) != 3:
        raise BadValueError(path, "tools", f"has {len(tools)} entries, must have 3: two objects and the decoy")
    first, second, decoy = tools
    check_tools_have_one_grip(path, tools)
    check_colours_differ(path, tools)
    check_tools_are_honest(path, (first, second))
    for tool in (second, decoy):
        if abs(tool.mass - first.mass) > SAME_MASS * first.mass:
            problem = f"weighs {tool.mass:.9g} kg, must weigh the same as {first.name}, {first.mass:.9g} kg"
            raise BadValueError(path, f"tools: {tool.name}", problem)
    if decoy.appearance != first.appearance:
        raise BadValueError(path, f"tools: {decoy.name}", f"looks unlike {first.name}, must look the same")
    if not np.allclose(decoy.parameters, second.parameters, rtol=SAME_MASS, atol=SAME_MASS):
        raise BadValueError(path, f"tools: {decoy.name}", f"is made unlike {second.name}, must have the same inertia")
    if np.linalg.norm(first.p_TTcm - second.p_TTcm) < _APART:
        problem = f"has its centre of mass within {_APART:g} m of that of {first.name}, must have it elsewhere"
        raise BadValueError(path, f"tools: {second.name}", problem)
    return first, second, decoy
