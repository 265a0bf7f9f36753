"""The tools of models/workshop, for tests."""

from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools, load_workshop_materials

MATERIALS = load_workshop_materials()
HAMMERS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "tools.yaml", MATERIALS)}
UNCOMMON = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "uncommon.yaml", MATERIALS)}
BLANKS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "blanks.yaml", MATERIALS)}
