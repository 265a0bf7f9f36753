"""Import of an arm into a folder of models, cached by the file, everything it includes, and the options."""

import hashlib
import json
import shutil
from dataclasses import asdict
from pathlib import Path

from affordance.arguments import check_kind
from affordance.files.bounded import MESH, read_bytes
from affordance.files.constraints import StrPath, check_path
from affordance.files.model_files import list_model_files
from affordance.files.model_folder import MODELS
from affordance.reporting.formatting import format_number
from affordance.robots.fitting import fit_tasks
from affordance.robots.folder import write_folder
from affordance.robots.importer import ImportOptions, extract_arm
from affordance.robots.lacks import write_lacks
from affordance.robots.notes import list_notes
from affordance.robots.reader import read_robot
from affordance.robots.report import write_report

_PROGRAM = Path(__file__).resolve().parent


def import_arm(
    path: StrPath, options: ImportOptions, folder: StrPath, *, with_meshes: bool = True, fits_tasks: bool = True
) -> list[str]:
    """Imports an arm into a folder of models, with its report.

    Args:
        path: File of the robot.
        options: Options of the import.
        folder: Destination; must not exist, or be empty.
        with_meshes: True to draw the robot's meshes.
        fits_tasks: True to adapt path, blow and objects to what the arm can do.

    Returns: Lines for the user: the arm that was extracted, warnings, the changes, and infeasible tasks.

    Raises:
        BadValueError: The file or an option is invalid or incomplete; nothing was written.
        ModelFileError: The file cannot be parsed, or no home posture was found; nothing was written.
    """
    path, folder = check_path("path", path), check_path("folder", folder)
    check_kind("options", options, ImportOptions, "ImportOptions(tip=NAME) makes some")
    imported = extract_arm(path, options)
    looks = write_folder(imported, folder, source=f"{path.name}, tip {options.tip}", with_meshes=with_meshes)
    fitted = fit_tasks(folder) if fits_tasks else None
    write_lacks(folder, fitted.lacks if fitted is not None else {})
    write_report(folder, imported, options, fitted, looks)
    lines = [
        f"{len(imported.arm.links)} joints from {imported.arm.base} to {options.tip}; static payload at home "
        f"{format_number(imported.payload)} kg, limited by {imported.weakest}"
    ]
    lines += [f"warning: {warning}" for warning in list_notes(imported, options).warnings]
    if fitted is not None:
        lines += [f"changed: {change}" for change in fitted.changes]
        lines += [f"cannot do: {name}: {why}" for name, why in fitted.lacks.items()]
    return lines


def import_kept(path: Path, options: ImportOptions, root: Path) -> Path:
    """Returns the folder of models of an arm, importing it if necessary.

    The folder is named after a digest of the file and its includes, the options, the tasks that come with the program
    and the importer's code, so that it always holds what a new import would give. Meshes enter only by their names in
    the file.

    Args:
        path: File of the robot.
        options: Options of the import.
        root: Folder that holds the cached folders.

    Raises:
        BadValueError: The file or an option is invalid or incomplete.
        ModelFileError: The file cannot be parsed, or no home posture was found.
    """
    digest = hashlib.sha256(json.dumps(asdict(options), sort_keys=True).encode())
    program = sorted(_PROGRAM.glob("*.py"))
    for file in (path, *read_robot(path).sources, *program, *list_model_files(MODELS)):
        digest.update(file.name.encode())
        digest.update(read_bytes(file, MESH))
    folder = root / f"{path.stem}-{options.tip}-{digest.hexdigest()[:12]}".replace("/", "_")
    if not (folder / "report.html").exists():  # the last file to be written
        if folder.exists():
            shutil.rmtree(folder)
        import_arm(path, options, folder)
    return folder
