"""The tools of models/workshop, for tests."""

from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from studies.tools.data_set import load_known_materials

MATERIALS = load_known_materials(MODELS)
HAMMERS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "tools.yaml", MATERIALS)}
BLANKS = {tool.name: tool for tool in load_tools(MODELS / "workshop" / "blanks.yaml", MATERIALS)}
