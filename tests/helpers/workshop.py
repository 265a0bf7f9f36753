"""The tools of models/workshop, for tests."""

from affordance.files.model_folder import MODELS
from affordance.objects.load import load_materials, load_tools

MATERIALS = load_materials(MODELS / "workshop" / "materials.yaml")
HAMMERS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "tools.yaml", MATERIALS)}
UNCOMMON = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "uncommon.yaml", MATERIALS)}
BLANKS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "blanks.yaml", MATERIALS)}
