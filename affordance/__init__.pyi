# What the package offers at its top; __init__.py reads it.
from .belief.density_belief import DensityBelief, PointEstimate, Prior
from .belief.material_memory import MaterialMemory
from .choice.hammer import Hammer, load_hammer
from .choice.observed_options import list_options
from .choice.options import Option
from .choice.ranking import RankedOption, Ranking, rank
from .choice.reach import Reach
from .control.timed_path import TimedPath, load_path
from .exceptions import AffordanceError, BadValueError, ModelFileError
from .files.model_folder import MODELS
from .identification.gains import Gains, read_gains, write_gains
from .identification.identify import Runs, identify
from .identification.payload_belief import PayloadBelief
from .identification.run import Run, RunDescription
from .identification.run_file import read_run
from .objects.load import load_materials, load_tools
from .objects.tool import Material, Tool
from .proprioception.torque_noise import WeberNoise, WhiteNoise
from .robots.recorded_arm import load_robot
from .settings import Settings
from .simulation.trial import TrialRecord, TrialRunner
from .version import __version__ as __version__

__all__ = [
    "MODELS",
    "AffordanceError",
    "BadValueError",
    "DensityBelief",
    "Gains",
    "Hammer",
    "Material",
    "MaterialMemory",
    "ModelFileError",
    "Option",
    "PayloadBelief",
    "PointEstimate",
    "Prior",
    "RankedOption",
    "Ranking",
    "Reach",
    "Run",
    "RunDescription",
    "Runs",
    "Settings",
    "TimedPath",
    "Tool",
    "TrialRecord",
    "TrialRunner",
    "WeberNoise",
    "WhiteNoise",
    "identify",
    "list_options",
    "load_hammer",
    "load_materials",
    "load_path",
    "load_robot",
    "load_tools",
    "rank",
    "read_gains",
    "read_run",
    "write_gains",
]
