"""Visual inertial affordances: see an object, guess its inertia, hold it, feel it, guess better."""

from affordance.belief import DensityBelief, Point, Prior
from affordance.exceptions import AffordanceError, BadValueError, ModelFileError
from affordance.memory import MaterialMemory
from affordance.noise import WeberNoise, WhiteNoise
from affordance.settings import Settings
from affordance.tools import MODELS, Material, Tool, load_materials, load_tools
from affordance.trial import TrialRecord, TrialRunner

__all__ = [
    "MODELS",
    "AffordanceError",
    "BadValueError",
    "DensityBelief",
    "Material",
    "MaterialMemory",
    "ModelFileError",
    "Point",
    "Prior",
    "Settings",
    "Tool",
    "TrialRecord",
    "TrialRunner",
    "WeberNoise",
    "WhiteNoise",
    "load_materials",
    "load_tools",
]
