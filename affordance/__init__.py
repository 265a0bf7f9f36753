"""Visual inertial affordances: see an object, guess its inertia, hold it, feel it, guess better."""

from affordance.belief import DensityBelief, Point, Prior
from affordance.choice import Option, RankedOption, Ranking, list_options, rank
from affordance.exceptions import AffordanceError, BadValueError, ModelFileError
from affordance.memory import MaterialMemory
from affordance.noise import WeberNoise, WhiteNoise
from affordance.paths import TimedPath, load_path
from affordance.settings import Settings
from affordance.tasks.hammer import Hammer, load_hammer
from affordance.tasks.reach import Reach
from affordance.tools import MODELS, Material, Tool, load_materials, load_tools
from affordance.trial import TrialRecord, TrialRunner

__all__ = [
    "MODELS",
    "AffordanceError",
    "BadValueError",
    "DensityBelief",
    "Hammer",
    "Material",
    "MaterialMemory",
    "ModelFileError",
    "Option",
    "Point",
    "Prior",
    "RankedOption",
    "Ranking",
    "Reach",
    "Settings",
    "TimedPath",
    "Tool",
    "TrialRecord",
    "TrialRunner",
    "WeberNoise",
    "WhiteNoise",
    "list_options",
    "load_hammer",
    "load_materials",
    "load_path",
    "load_tools",
    "rank",
]
