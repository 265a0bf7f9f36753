"""Writing a folder of models for an imported arm: arm, posture, meshes, and tasks that it can do."""

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from affordance.exceptions import BadValueError
from affordance.files.atomic import write_text
from affordance.files.model_folder import MODELS
from affordance.files.yaml_reader import read_yaml
from affordance.plant.arm import ARM, load_arm
from affordance.robots.arm_file import write_arm, write_directives
from affordance.robots.changes import Change, apply_changes
from affordance.robots.fitting import Fit, fit_blow, fit_objects, fit_path
from affordance.robots.importer import ImportedArm
from affordance.robots.meshes import draw_arm

# What is taken over from the models that come with the program.
_TASK_FILES = ("package.xml", "materials.yaml", "faults.yaml", "nail.yaml", "tools", "paths")
# Where tasks name the posture that they start from.
_STARTS = (("paths/reach.yaml", "start"), ("paths/mash.yaml", "start"), ("nail.yaml", "blow.start"))
_STUCK_JOINT = "stuck_sensor.stuck_joint"


class Fitted(NamedTuple):
    """What became of the tasks.

    Attributes:
        changes: Values that differ from those the tasks came with.
        lacks: Why a task cannot be done, by its name: ``objects``, ``path`` or ``blow``.
    """

    changes: tuple[Change, ...]
    lacks: dict[str, str]


def write_folder(imported: ImportedArm, folder: Path, *, source: str, with_meshes: bool = True) -> Sequence[str]:
    """Writes the arm, and the tasks that come with the program as they are.

    Args:
        imported: The arm.
        folder: Receives the files; must not exist, or be empty.
        source: What it was made of, in words.
        with_meshes: Whether the robot's meshes are drawn, where they are available.

    Returns: What could not be drawn as the file has it.

    Raises:
        BadValueError: The folder holds something already, or cannot be made.
        ModelFileError: The strict program does not take the arm.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BadValueError("--out", "", f"is {str(folder)!r}, which is not an empty folder")
    appearance = draw_arm(imported.arm, imported.tree.description, with_meshes=with_meshes)
    # Whole or not at all: made beside its place, and then moved there.
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        making = Path(tempfile.mkdtemp(prefix=".importing.", dir=folder.parent))
    except OSError as error:
        raise BadValueError("--out", "", f"is {str(folder)!r}, which cannot be made: {error.strerror}") from error
    try:
        for name in _TASK_FILES:
            copy = shutil.copytree if (MODELS / name).is_dir() else shutil.copyfile
            copy(MODELS / name, making / name)
        write_text(making / "arm.sdf", write_arm(imported.arm, appearance.visuals, source))
        write_text(making / ARM.name, write_directives(imported.home_angles, imported.X_WB))
        for name, text in appearance.meshes.items():
            write_text(making / "meshes" / name, text)
        apply_changes(making, [_name_stuck_joint(imported), *_list_strange_starts(making, imported)])
        load_arm(making / ARM.name)
        making.chmod(0o755)
        if folder.exists():
            folder.rmdir()
        making.replace(folder)
    finally:
        shutil.rmtree(making, ignore_errors=True)
    return appearance.remarks


def fit_tasks(models: Path) -> Fitted:
    """Changes the tasks of a folder of models to what its arm can do; what it cannot do at all stays as it is."""
    changes: tuple[Change, ...] = ()
    lacks: dict[str, str] = {}
    for name, fit in (("objects", fit_objects), ("path", fit_path), ("blow", fit_blow)):
        if "objects" in lacks:
            break  # an arm that cannot hold them cannot move them
        found: Fit = fit(models)
        apply_changes(models, found.changes)
        changes += found.changes
        if found.lack:
            lacks[name] = found.lack
    return Fitted(changes, lacks)


def _list_strange_starts(models: Path, imported: ImportedArm) -> Iterator[Change]:
    """Start postures of tasks, by joints that this arm does not have: its tasks start in its home posture."""
    for file, key in _STARTS:
        value = read_yaml(models / file)
        for part in key.split("."):
            value = value.get(part, {})
        if not set(value) <= set(imported.arm.joint_names):
            yield Change(file, key, value, None, "this arm's tasks start in its home posture")


def _name_stuck_joint(imported: ImportedArm) -> Change:
    """The fault of a stuck sensor is that of the joint which carries most at home."""
    arm, statics = imported.arm, imported.home
    joint = imported.weakest if statics.load else arm.joint_names[0]
    return Change("faults.yaml", _STUCK_JOINT, "shoulder_elevation", joint, "a joint of this arm")
