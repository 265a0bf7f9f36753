"""Visual inertial affordances: see an object, guess its inertia, hold it, feel it, guess better."""

from affordance.belief.density_belief import DensityBelief, PointEstimate, Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import Hammer, load_hammer
from affordance.choice.options import Option, list_options
from affordance.choice.ranking import RankedOption, Ranking, rank
from affordance.choice.reach import Reach
from affordance.control.timed_path import TimedPath, load_path
from affordance.exceptions import AffordanceError, BadValueError, ModelFileError
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_materials, load_tools
from affordance.objects.tool import Material, Tool
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from affordance.settings import Settings
from affordance.simulation.trial import TrialRecord, TrialRunner

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
    "PointEstimate",
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
