"""Importing once: a folder of models that is kept for a robot's file, what it takes in, and what was asked of it."""

import hashlib
import json
import shutil
from dataclasses import asdict
from pathlib import Path

from affordance.arguments import StrPath, check_kind, check_path
from affordance.files.bounded import MESH, read_bytes
from affordance.files.model_files import list_model_files
from affordance.files.model_folder import MODELS
from affordance.reporting.formatting import format_number
from affordance.robots.folder import fit_tasks, write_folder
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
        path: The robot's file.
        options: What is said of the arm.
        folder: Receives the files; must not exist, or be empty.
        with_meshes: Whether the robot's meshes are drawn.
        fits_tasks: Whether path, blow and objects are changed to what the arm can do.

    Returns: Lines for the user: what was taken, what to beware of, what was changed, and what the arm cannot do.

    Raises:
        BadValueError: The file, or an option, does not say what an arm needs; nothing was written.
        ModelFileError: The file cannot be parsed, or the arm finds no posture; nothing was written.
    """
    path, folder = check_path("path", path), check_path("folder", folder)
    check_kind("options", options, ImportOptions, "ImportOptions(tip=NAME) makes some")
    imported = extract_arm(path, options)
    looks = write_folder(imported, folder, source=f"{path.name}, tip {options.tip}", with_meshes=with_meshes)
    fitted = fit_tasks(folder) if fits_tasks else None
    write_lacks(folder, fitted.lacks if fitted is not None else {})
    write_report(folder, imported, options, fitted, looks)
    lines = [
        f"{len(imported.arm.links)} joints from {imported.arm.base} to {options.tip}; at home it bears "
        f"{format_number(imported.payload)} kg, then {imported.weakest} gives way"
    ]
    lines += [f"beware: {warning}" for warning in list_notes(imported, options).warnings]
    if fitted is not None:
        lines += [f"changed: {change}" for change in fitted.changes]
        lines += [f"cannot do: {name}: {why}" for name, why in fitted.lacks.items()]
    return lines


def import_kept(path: Path, options: ImportOptions, root: Path) -> Path:
    """Returns the folder of models of an arm, importing it if that was not done before.

    The folder is named by the content of the file and of those that it includes, the options, the tasks that come
    with the program and the program that imports, so that it always holds what importing anew would give; meshes
    count by the names that the file has.

    Args:
        path: The robot's file.
        options: What is said of the arm.
        root: Where such folders are kept.

    Raises:
        BadValueError: The file, or an option, does not say what an arm needs.
        ModelFileError: The file cannot be parsed, or the arm finds no posture.
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
