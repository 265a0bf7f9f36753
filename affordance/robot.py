"""Robot with its arm, tasks and objects, all stored in one model folder."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from affordance.arrays import Array
from affordance.choice.inner_simulation import TaskCostModel
from affordance.choice.tasks import list_tasks, load_task
from affordance.exceptions import BadValueError
from affordance.files.constraints import StrPath, check_path
from affordance.files.model_folder import MODELS
from affordance.plant.arm import ARM, Arm, JointLimits, name_robot
from affordance.plant.chain_plant import build_unmounted_chain
from affordance.plant.load import load_arm
from affordance.plant.serial_chain import SerialChain


@dataclass(frozen=True)
class Robot:
    """Robot from a model folder, by default the paper's arm.

    ``import_arm`` writes such folders. ``identify``, ``rank`` and ``TrialRunner`` accept a Robot. Files are read when
    a property is first used.

    Attributes:
        folder: Model folder.

    Example:
        >>> from affordance import Robot
        >>> robot = Robot()
        >>> len(robot.joint_names), sorted(robot.tasks)
        (7, ['carry', 'hammer', 'hold', 'mash', 'reach'])
    """

    folder: Path = MODELS

    def __post_init__(self) -> None:
        """Checks the folder.

        Raises:
            BadValueError: The path is not a folder, or the folder contains no arm.
        """
        folder = check_path("folder", self.folder)
        if not folder.is_dir():
            raise BadValueError(folder, "", "is not a folder, must be one that import-arm wrote")
        if not (folder / ARM.name).is_file():
            raise BadValueError(folder, "", f"has no {ARM.name}, must be a folder that import-arm wrote")
        object.__setattr__(self, "folder", folder)

    @classmethod
    def load(cls, folder: StrPath = MODELS) -> "Robot":
        """Opens the robot of a model folder.

        Raises:
            BadValueError: The path is not a folder, or the folder contains no arm.
        """
        return cls(check_path("folder", folder))

    @property
    def name(self) -> str:
        """Name of the folder without a cache digest, or "the paper's arm"."""
        return name_robot(self.directives)

    @property
    def is_default(self) -> bool:
        """True for the paper's arm."""
        return self.folder.resolve() == MODELS.resolve()

    @property
    def directives(self) -> Path:
        """Path of the arm's Drake model directives, for ``Settings.arm``."""
        return self.folder / ARM.name

    @property
    def arm(self) -> Arm:
        """Plant of the arm, without geometry.

        Raises:
            ModelFileError: The arm cannot be loaded.
        """
        return load_arm(self.directives)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints from base to hand."""
        return tuple(self.arm.joint_names)

    @property
    def limits(self) -> JointLimits:
        """Limits of the joints, each of shape (num_joints,)."""
        return self.arm.limits

    @property
    def home(self) -> Array:
        """Joint angles of the home posture, (num_joints,), [rad]."""
        return self.arm.home

    @cached_property
    def chain(self) -> SerialChain:
        """Chain of joints and links up to the hand. ``identify`` uses it to identify payloads."""
        return build_unmounted_chain(self.arm)

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks in the folder."""
        return list_tasks(self.folder)

    def load_task(self, name: str) -> TaskCostModel:
        """Loads one of the robot's tasks.

        Raises:
            BadValueError: There is no such task, its file is invalid, or the arm cannot assume the task's posture.
        """
        return load_task(self.folder, name, self.arm)
