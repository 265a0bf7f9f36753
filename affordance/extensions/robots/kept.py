"""Imports arms into model folders, and caches them by file, included files and options."""

import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from affordance.arguments import check_kind
from affordance.exceptions import BadValueError
from affordance.extensions.robots.arm_file import write_arm, write_directives
from affordance.extensions.robots.fitting import Change, apply_changes, fit_tasks
from affordance.extensions.robots.home import HomePosture
from affordance.extensions.robots.importer import ImportOptions, extract_arm
from affordance.extensions.robots.meshes import draw_arm
from affordance.extensions.robots.reader import read_robot
from affordance.extensions.robots.reduced_arm import ReducedArm
from affordance.extensions.robots.report import (
    describe_payload,
    describe_roll,
    list_couplings,
    list_warnings,
    write_report,
)
from affordance.files.atomic import quarantine, write_text
from affordance.files.bounded import MESH, SETTINGS, read_bytes, read_text, read_yaml, suggest_file
from affordance.files.constraints import StrPath, check_path
from affordance.files.lacks import write_lacks
from affordance.files.model_files import list_model_files
from affordance.files.model_folder import MODELS
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.robot import Robot
from affordance.simulation.blow import describe_blow_fault
from affordance.simulation.rollout import describe_path_fault

# Hint about import options in error messages.
_OPTIONS = "ImportOptions(tip=NAME) makes some"
_PROGRAM = Path(__file__).resolve().parent
# Files and folders copied from the program's own models.
_TASK_FILES = ("package.xml", "materials.yaml", "faults.yaml", "nail.yaml", "tools", "paths", "tasks")
# Files and keys of start postures.
_STARTS = (
    ("paths/reach.yaml", "start"),
    ("paths/mash.yaml", "start"),
    ("nail.yaml", "blow.start"),
    ("tasks/carry.yaml", "start"),
)
# File with a digest of all other files of a cached import. It is written last.
_SEAL = "sha256.txt"
_STUCK_JOINT = "stuck_sensor.stuck_joint"


def import_arm(
    path: StrPath,
    options: ImportOptions,
    folder: StrPath,
    *,
    with_meshes: bool = True,
    fits_tasks: bool = True,
    tell: Callable[[str], None] = lambda step: None,
) -> list[str]:
    """Imports an arm into a model folder and writes a report.

    Args:
        path: File of the robot.
        options: Options of the import.
        folder: Destination; must not exist, or be empty.
        with_meshes: True to draw the robot's meshes.
        fits_tasks: True to adapt paths, blow and objects to what the arm can do.
        tell: Function that is called with a description of each step before the step.

    Returns: Lines for the user: the extracted arm, warnings, changes, and infeasible tasks.

    Raises:
        BadValueError: The file or an option is invalid or incomplete; nothing was written.
        ModelFileError: The file cannot be parsed, or no home posture was found; nothing was written.
    """
    path, folder = check_path("path", path), check_path("folder", folder)
    check_kind("options", options, ImportOptions, _OPTIONS)
    tell(f"{path.name}: finding a posture")
    arm, home = extract_arm(path, options)
    tell(f"{path.name}: converting meshes")
    looks = write_folder(arm, home, folder, source=f"{path.name}, tip {arm.options.tip}", with_meshes=with_meshes)
    fitted = fit_tasks(folder, describe_path_fault, describe_blow_fault, tell) if fits_tasks else None
    tell(f"{path.name}: writing the report")
    write_lacks(folder, fitted.lacks if fitted is not None else {})
    write_report(folder, arm, home, fitted, looks)
    lines = [f"{len(arm.links)} joints from {arm.base} to {arm.options.tip}; {describe_payload(home)}"]
    lines += [arm.why_tip] if arm.why_tip else []
    lines.append(describe_roll(arm))
    lines += [f"left out: {coupling}" for coupling in list_couplings(arm)]
    lines += [f"warning: {warning}" for warning in list_warnings(arm, home)]
    if fitted is not None:
        lines += [f"changed: {change}" for change in fitted.changes]
        lines += [f"infeasible: {name}: {why}" for name, why in fitted.lacks.items()]
    return lines


def import_kept(path: Path, options: ImportOptions, root: Path) -> Path:
    """Returns the cached model folder of an arm, after importing it if necessary.

    The folder's name contains a digest of the file and its includes, the options, the program's own tasks and the
    importer's code, so the folder equals a new import. Only the names of meshes enter the digest. A changed or
    damaged folder is renamed, and the arm is imported again.
    """
    digest = hashlib.sha256(json.dumps(asdict(options), sort_keys=True).encode())
    files = [
        path,
        *read_robot(path, options.xacro, options.packages).sources,
        *sorted(_PROGRAM.glob("*.py")),
        *list_model_files(MODELS),
    ]
    for file in (*files, *sorted((MODELS / "tasks").glob("*.yaml"))):
        digest.update(file.name.encode())
        digest.update(read_bytes(file, MESH))
    folder = root / f"{path.stem}-{options.tip or 'arm'}-{digest.hexdigest()[:12]}".replace("/", "_")
    seal = folder / _SEAL
    if folder.exists() and seal.is_file() and _digest(folder) != read_text(seal, SETTINGS):
        quarantine(folder, "was changed since it was imported")
    if not seal.is_file():  # missing if an import was interrupted
        if folder.exists():
            shutil.rmtree(folder)
        import_arm(path, options, folder)
        write_text(seal, _digest(folder))
    return folder


def _digest(folder: Path) -> str:
    """Computes a digest of all files in a folder except the digest file."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name != _SEAL:
            digest.update(str(path.relative_to(folder)).encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def open_robot(path: StrPath | None, options: ImportOptions, root: StrPath) -> Robot:
    """Opens a robot from a model folder or a robot's file. A file is imported once and cached.

    Args:
        path: Folder from ``import_arm``, or URDF, SDF or MJCF file; None for the paper's arm.
        options: Import options for a robot's file; must be the defaults, ``ImportOptions("")``, for a folder.
        root: Folder of the cached imports.

    Raises:
        BadValueError: The path is neither a folder nor a file, the folder contains no arm, the file or an option is
            invalid or incomplete, or an option is given without a file.
        ModelFileError: The file cannot be parsed, or no home posture was found.
    """
    path = None if path is None else check_path("path", path)
    check_kind("options", options, ImportOptions, _OPTIONS)
    if path is not None and path.is_file():
        return Robot.load(import_kept(path, options, check_path("root", root)))
    if path is not None and not path.is_dir():
        raise BadValueError(
            "--robot", "", f"is {str(path)!r}, which is neither a folder nor a robot's file{suggest_file(path)}"
        )
    if options != ImportOptions():
        name, instead = (
            "--tip" if options.tip else "options",
            "" if path is None else f" in place of the folder {path}",
        )
        raise BadValueError(name, "", f"applies to a robot's file only, which --robot must name{instead}")
    return Robot() if path is None else Robot.load(path)


def write_folder(
    arm: ReducedArm, home: HomePosture, folder: Path, *, source: str, with_meshes: bool = True
) -> Sequence[str]:
    """Writes the arm and a copy of the program's own tasks to a new or empty folder.

    Returns: Remarks on shapes that could not be drawn as in the file.

    Raises:
        BadValueError: The folder is not empty or cannot be created.
        ModelFileError: Strict parsing rejects the arm.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BadValueError("--out", "", f"is {str(folder)!r}, which is not an empty folder")
    appearance = draw_arm(arm, with_meshes=with_meshes)
    # Files are written to a temporary folder next to the destination and then moved, so that no partial folder
    # remains.
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        making = Path(tempfile.mkdtemp(prefix=".importing.", dir=folder.parent))
    except OSError as error:
        raise BadValueError("--out", "", f"is {str(folder)!r}, which cannot be created: {error.strerror}") from error
    try:
        for name in _TASK_FILES:
            copy = shutil.copytree if (MODELS / name).is_dir() else shutil.copyfile
            copy(MODELS / name, making / name)
        write_text(making / "arm.sdf", write_arm(arm, appearance.visuals, source))
        write_text(making / ARM.name, write_directives(arm, home.q))
        for name, text in appearance.meshes.items():
            write_text(making / "meshes" / name, text)
        stuck = home.weakest if home.load else arm.joint_names[0]
        fault = Change("faults.yaml", _STUCK_JOINT, "shoulder_elevation", stuck, "a joint of this arm")
        apply_changes(making, [fault, *_list_strange_starts(making, arm)])
        load_arm(making / ARM.name)
        making.chmod(0o755)
        if folder.exists():
            folder.rmdir()
        making.replace(folder)
    finally:
        shutil.rmtree(making, ignore_errors=True)
    return appearance.remarks


def _list_strange_starts(models: Path, arm: ReducedArm) -> Iterator[Change]:
    """Lists changes that remove start postures with joints of other arms. The tasks then start at home."""
    for file, key in _STARTS:
        value = read_yaml(models / file)
        for part in key.split("."):
            value = value.get(part, {})
        if not set(value) <= set(arm.joint_names):
            yield Change(file, key, value, None, "this arm's tasks start in its home posture")
