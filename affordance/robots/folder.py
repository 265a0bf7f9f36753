"""Writing a folder of models for an imported arm: arm, posture, meshes, and tasks."""

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from affordance.exceptions import BadValueError
from affordance.files.atomic import write_text
from affordance.files.model_folder import MODELS
from affordance.files.yaml_reader import read_yaml
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.robots.arm_file import write_arm, write_directives
from affordance.robots.changes import Change, apply_changes
from affordance.robots.importer import ImportedArm
from affordance.robots.meshes import draw_arm

# Files and folders copied from the models that come with the program.
_TASK_FILES = ("package.xml", "materials.yaml", "faults.yaml", "nail.yaml", "tools", "paths")
# Files and keys of the start postures of tasks.
_STARTS = (("paths/reach.yaml", "start"), ("paths/mash.yaml", "start"), ("nail.yaml", "blow.start"))
_STUCK_JOINT = "stuck_sensor.stuck_joint"


def write_folder(imported: ImportedArm, folder: Path, *, source: str, with_meshes: bool = True) -> Sequence[str]:
    """Writes the arm, and an unchanged copy of the tasks that come with the program.

    Args:
        imported: Imported arm.
        folder: Destination; must not exist, or be empty.
        source: Description of the arm's source, in words.
        with_meshes: True to draw the robot's meshes where they are available.

    Returns: Remarks on shapes that could not be drawn as in the file.

    Raises:
        BadValueError: The folder is not empty, or cannot be created.
        ModelFileError: Strict parsing rejects the arm.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BadValueError("--out", "", f"is {str(folder)!r}, which is not an empty folder")
    appearance = draw_arm(imported.arm, imported.tree.description, with_meshes=with_meshes)
    # Atomic: made in a temporary folder next to the destination, then moved there.
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


def _list_strange_starts(models: Path, imported: ImportedArm) -> Iterator[Change]:
    """Lists removals of start postures with joints that this arm lacks; such tasks start in its home posture."""
    for file, key in _STARTS:
        value = read_yaml(models / file)
        for part in key.split("."):
            value = value.get(part, {})
        if not set(value) <= set(imported.arm.joint_names):
            yield Change(file, key, value, None, "this arm's tasks start in its home posture")


def _name_stuck_joint(imported: ImportedArm) -> Change:
    """Assigns the stuck-sensor fault to the joint with the highest load at home."""
    arm, statics = imported.arm, imported.home
    joint = imported.weakest if statics.load else arm.joint_names[0]
    return Change("faults.yaml", _STUCK_JOINT, "shoulder_elevation", joint, "a joint of this arm")
