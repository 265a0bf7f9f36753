"""The stick in both of its grips, for tests of blows."""

from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials

STICK, *_ = load_tools(MODELS / "tools" / "novel.yaml", load_materials(MODELS / "materials.yaml"))
HELD = {grip.name: STICK.gripped_by(grip) for grip in STICK.grips}
PI = {grip: tool.parameters for grip, tool in HELD.items()}
