# What the package offers at its top; __init__.py reads it. What else there is lies one level down (docs/python.md).
from .belief.density_belief import Prior
from .belief.learner import Learner
from .belief.material_memory import MaterialMemory, start_memory
from .choice.hammer import Hammer, load_hammer
from .choice.listed_options import list_options
from .choice.ranking import Ranking, rank
from .choice.reach import Reach
from .choice.tasks import load_task_file
from .control.timed_path import load_path
from .exceptions import AffordanceError, BadArgumentError, BadValueError, ModelFileError
from .experiments.shared.observers import Setup
from .experiments.shared.suite import run_suite
from .extensions.advice.expected_inertia import Expectation, expect
from .extensions.advice.next_hold import HoldAdvice, advise_hold
from .extensions.memory.ledger import Ledger, Selection, open_memory
from .extensions.memory.trial_evidence import TrialEvidence
from .extensions.payload.evidence.gains import Gains, read_gains, write_gains
from .extensions.payload.identify import Runs, identify
from .extensions.payload.live.live_identifier import LiveEvent, LiveIdentifier
from .extensions.payload.posterior.payload_belief import PayloadBelief
from .extensions.payload.recording.run import Run
from .extensions.payload.recording.run_file import read_run
from .extensions.robots.importer import ImportOptions
from .extensions.robots.kept import import_arm, open_robot
from .extensions.robots.recorded_arm import load_robot
from .files.model_folder import MODELS
from .named_settings import change_settings
from .objects.load import load_tools
from .objects.materials import Material, load_materials
from .objects.tool import Tool
from .proprioception.torque_noise import WeberNoise, WhiteNoise
from .robot import Robot
from .settings import Settings
from .simulation.trial import TrialRunner
from .simulation.trial_record import TrialRecord
from .version import __version__ as __version__

__all__ = [
    "MODELS",
    "AffordanceError",
    "BadArgumentError",
    "BadValueError",
    "Expectation",
    "Gains",
    "Hammer",
    "HoldAdvice",
    "ImportOptions",
    "Learner",
    "Ledger",
    "LiveEvent",
    "LiveIdentifier",
    "Material",
    "MaterialMemory",
    "ModelFileError",
    "PayloadBelief",
    "Prior",
    "Ranking",
    "Reach",
    "Robot",
    "Run",
    "Runs",
    "Selection",
    "Settings",
    "Setup",
    "Tool",
    "TrialEvidence",
    "TrialRecord",
    "TrialRunner",
    "WeberNoise",
    "WhiteNoise",
    "advise_hold",
    "change_settings",
    "expect",
    "identify",
    "import_arm",
    "list_options",
    "load_hammer",
    "load_materials",
    "load_path",
    "load_robot",
    "load_task_file",
    "load_tools",
    "open_memory",
    "open_robot",
    "rank",
    "read_gains",
    "read_run",
    "run_suite",
    "start_memory",
    "write_gains",
]
