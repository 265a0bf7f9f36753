"""The tools of models/workshop, for tests."""

from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools, select_known
from affordance.objects.materials import load_materials

MATERIALS = select_known(load_materials(), (), MODELS)
HAMMERS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "tools.yaml", MATERIALS)}
BLANKS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "blanks.yaml", MATERIALS)}
