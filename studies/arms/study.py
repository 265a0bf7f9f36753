"""Study of the paper's claims on many robots' arms: each is imported, measured, and run through all experiments."""

import dataclasses
import json
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from affordance.exceptions import AffordanceError, BadValueError
from affordance.files.atomic import write_json, write_text
from affordance.files.model_folder import MODELS
from affordance.plant.arm import ARM
from affordance.robots.arm_file import write_arm, write_directives
from affordance.robots.importer import ImportOptions, extract_arm
from affordance.robots.kept import import_kept
from affordance.runs.repeats import compute_key
from studies.arms.figure import draw_study
from studies.arms.measure import Sag, measure_sag
from studies.arms.parity import compute_parity
from studies.arms.programs import NAMES, OK, run_program
from studies.arms.robots import ROBOTS, Robot, find_folder
from studies.arms.section import describe_study
from studies.study import Findings, write_findings

_LOG = logging.getLogger(__name__)
NAME = "arms"
# Rotor inertias given to every joint in addition to none, [kg m^2], for robots whose maker's file has none.
ROTORS = (0.03, 0.1, 0.3)
# Details behind the figure, and the numbers that other programs rely on.
DETAILS, METRICS = "study.json", "metrics.json"


@dataclass(frozen=True)
class StudyConfig:
    """Configuration of the study.

    Attributes:
        robots: Folder of the robots' files.
        seed: Root of every random draw.
        repeats: Number of observers of each experiment on each arm.
        jobs: Number of processes.
        only: Names of the robots; all if empty.
        changes: Settings that differ from their defaults, by name.
    """

    robots: Path
    seed: int = 0
    repeats: int = 20
    jobs: int = 1
    only: tuple[str, ...] = ()
    changes: tuple[tuple[str, Any], ...] = ()


def check_config(config: StudyConfig) -> list[Robot]:
    """Lists the robots to study.

    Raises:
        BadValueError: The folder has no robot's file, or a name is unknown.
    """
    names = [robot.name for robot in ROBOTS]
    unknown = [name for name in config.only if name not in names]
    if unknown:
        raise BadValueError("--only", "", f"is {unknown[0]!r}, must be of {', '.join(names)}")
    folder = find_folder(config.robots)
    chosen = [robot for robot in ROBOTS if not config.only or robot.name in config.only]
    if not any((folder / robot.file).is_file() for robot in chosen):
        problem = f"is {str(config.robots)!r}, which has none of the robots' files, such as {chosen[0].file}"
        wheel = "pip install --target FOLDER --no-deps example-robot-data==6.0.0 puts them into FOLDER"
        raise BadValueError("--robots", "", f"{problem}; {wheel}")
    return chosen


def run_study(config: StudyConfig, out: Path) -> Path:
    """Studies all robots; results of a robot are cached and not computed again.

    Returns: Path of the file of metrics.

    Raises:
        BadValueError: The folder of robots is wrong, or that of results cannot be written to.
    """
    chosen = check_config(config)
    out.mkdir(parents=True, exist_ok=True)
    found = {}
    for robot in chosen:
        _LOG.info("%s", robot.name)
        found[robot.name] = study_robot(robot, config, out)
        write_results(found, _study_ours(config, out), out)
    return out / METRICS


def study_robot(robot: Robot, config: StudyConfig, out: Path) -> dict[str, Any]:
    """Studies one robot.

    Returns: Numbers that other programs rely on, under ``metrics``; and further numbers that explain them.
    """
    path = find_folder(config.robots) / robot.file
    options = robot.options
    try:
        models = import_kept(path, options, out / "imported")
    except AffordanceError as error:
        return {"metrics": _fail(str(error).replace(str(path), path.name)), "required": robot.required}
    kept = out / robot.name / "summary.json"
    key = compute_key(dataclasses.replace(config, jobs=1, only=(), robots=Path(robot.name)), models)
    if kept.exists():
        summary: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        if summary["key"] == key:
            return summary
    imported = extract_arm(path, options)
    try:
        parity: float | None = compute_parity(path, options, config.seed).largest
    except ImportError:
        parity = None
    ran = _run_all(models, config, out / robot.name)
    sag = measure_sag(models, changes=dict(config.changes))
    summary = {
        "key": key,
        "required": robot.required,
        "metrics": {
            "loads": True,
            "joints": len(imported.arm.links),
            "frozen_joints": len(imported.arm.frozen),
            "parity_error": parity,
            "payload_kg": imported.home.payload,
            "home_torque_ratio": imported.home.load,
            "experiments": {name: OK if isinstance(found, dict) else found for name, found in ran.items()},
            "real_time_factor": sag.real_time_factor,
            "changed": _list_changed(models),
        },
        "sag": asdict_of(sag),
        "sag_with_rotors": {
            str(rotor): _measure_with_rotors(path, options, rotor, models, config, out) for rotor in ROTORS
        },
        "heavy": asdict_of(_measure_heavy(models, config)),
        "arm_mass_kg": imported.arm.mass,
        "empty_load": imported.home.empty_load,
        **_pick_outcomes(ran),
    }
    write_json(kept, summary)
    return summary


def write_results(found: dict[str, dict[str, Any]], ours: dict[str, Any], out: Path) -> None:
    """Writes metrics, details, the figure, and the study's section of the report."""
    details = {"robots": {name: {k: v for k, v in one.items() if k != "metrics"} for name, one in found.items()}}
    numbers = {"robots": {name: one["metrics"] for name, one in found.items()}}
    findings = Findings(
        numbers,
        figures={"arms": lambda: draw_study(found, ours)},
        writers=(lambda folder: write_json(folder / DETAILS, {**details, "ours": ours}),),
    )
    write_findings(findings, out, describe_study(found, ours))


def _study_ours(config: StudyConfig, out: Path) -> dict[str, Any]:
    """Measures the arm that comes with the program, for comparison."""
    kept = out / "ours" / "summary.json"
    key = compute_key(dataclasses.replace(config, jobs=1, only=(), robots=Path("ours")), MODELS)
    if kept.exists():
        summary: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        if summary["key"] == key:
            return summary
    ran = _run_all(MODELS, config, out / "ours")
    sag, heavy = measure_sag(MODELS, changes=dict(config.changes)), _measure_heavy(MODELS, config)
    summary = {"key": key, "sag": asdict_of(sag), "heavy": asdict_of(heavy), **_pick_outcomes(ran)}
    write_json(kept, summary)
    return summary


def _run_all(models: Path, config: StudyConfig, out: Path) -> dict[str, dict[str, Any] | str]:
    """Runs every experiment that can be run."""
    ran: dict[str, dict[str, Any] | str] = {}
    for name in NAMES:
        ran[name] = run_program(
            name,
            models,
            out,
            seed=config.seed,
            repeats=config.repeats,
            jobs=config.jobs,
            changes=dict(config.changes),
        )
    return ran


def _measure_heavy(models: Path, config: StudyConfig) -> Sag:
    """Measures the sag with the heaviest object of Simulation I, where limits are most at risk."""
    return measure_sag(models, tool_index=3, changes=dict(config.changes))


def _measure_with_rotors(
    path: Path, options: ImportOptions, rotor: float, models: Path, config: StudyConfig, out: Path
) -> dict[str, Any]:
    """Measures the sag of the first hold with a rotor inertia at every joint."""
    imported = extract_arm(path, dataclasses.replace(options, rotor_inertia={"": rotor}))
    folder = out / "imported" / "with_rotors"
    write_text(folder / "arm.sdf", write_arm(imported.arm, {}, path.name))
    write_text(folder / ARM.name, write_directives(imported.home_angles, imported.X_WB))
    write_text(folder / "package.xml", (models / "package.xml").read_text(encoding="utf-8"))
    return asdict_of(measure_sag(folder, task_models=models, changes=dict(config.changes)))


def _list_changed(models: Path) -> list[str]:
    """Lists the values of the tasks that differ from ours, each with old value, new value and reason."""
    mark = "# Changed by affordance import-arm: "
    files = [
        models / "nail.yaml",
        *sorted((models / "paths").glob("*.yaml")),
        *sorted((models / "tools").glob("*.yaml")),
    ]
    lines = [line for file in files for line in file.read_text(encoding="utf-8").splitlines()]
    return [line.removeprefix(mark) for line in lines if line.startswith(mark)]


def _pick_outcomes(ran: dict[str, dict[str, Any] | str]) -> dict[str, Any]:
    """Selects the outcomes that the paper's claims are about, of the experiments that were run."""
    picked: dict[str, Any] = {"claims": {name: one["claims"] for name, one in ran.items() if isinstance(one, dict)}}
    wanted = {
        "weight": ("drop_m", "decoy_lift_m", "decoy_rises", "periods_limited"),
        "com": ("mass_error", "com_error_m", "height_extreme_m"),
        "reach": ("p_correct", "correct_grip", "energy_ratio_true"),
        "hammer": ("p_correct", "correct_grip", "energy_ratio_true", "force_demanded_N", "force_measured_N"),
    }
    for name, keys in wanted.items():
        one = ran.get(name)
        if isinstance(one, dict):
            picked[name] = {key: one.get(key) for key in keys}
    return picked


def _fail(reason: str) -> dict[str, Any]:
    """Returns the metrics of a robot that could not be imported."""
    return {
        "loads": False,
        "joints": None,
        "frozen_joints": None,
        "parity_error": None,
        "payload_kg": None,
        "home_torque_ratio": None,
        "experiments": dict.fromkeys(NAMES, reason),
        "real_time_factor": None,
        "changed": [],
    }


def asdict_of(sag: Sag) -> dict[str, Any]:
    """Converts a measurement to plain data."""
    return {
        name: value if isinstance(value, str) else float(np.float64(value)) for name, value in sag._asdict().items()
    }


__all__: Sequence[str] = ("StudyConfig", "run_study")
