"""Two tools, the grips of the stick, a path and beliefs about their materials, for tests of choices."""

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.reach import Reach
from affordance.control.timed_path import load_path
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools

STICK, HAMMER, *_ = load_tools(MODELS / "tools" / "novel.yaml")
HELD = {grip.name: STICK.gripped_by(grip) for grip in STICK.grips}
PI = {grip: tool.parameters for grip, tool in HELD.items()}
WOOD, STEEL = (part.looks_like.colour for part in STICK.components)
REACH = Reach(load_path(MODELS / "paths" / "reach.yaml"))


def believe(wood, steel, sd):
    """A memory of both materials."""
    return MaterialMemory.from_belief(
        (WOOD, STEEL), DensityBelief.from_moments(np.array([wood, steel], float), sd**2 * np.eye(2))
    )
