"""The tools of models/workshop, for tests."""

import functools

from affordance.choice.inner_simulation import Choice
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.pricing import plan_options
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools, select_known
from affordance.objects.materials import load_materials
from affordance.robot import Robot
from affordance.settings import DEFAULT_SETTINGS

MATERIALS = select_known(load_materials(), ())
HAMMERS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "tools.yaml", MATERIALS)}
BLANKS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "blanks.yaml", MATERIALS)}


@functools.cache
def plan_reach() -> Choice:
    """Plans to reach with the paper's arm and each grip of one hammer, drawn."""
    options = list_drawn_options([HAMMERS["machinist hammer"]])
    return plan_options(options, Robot().load_task("reach"), DEFAULT_SETTINGS)
