"""Studies one arm: imports and measures it, runs all experiments on it, and stores the results."""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from affordance.exceptions import AffordanceError
from affordance.experiments.observers import Setup
from affordance.experiments.suite import run_suite
from affordance.files.atomic import write_text
from affordance.files.model_folder import MODELS
from affordance.named_settings import change_settings
from affordance.plant.arm import ARM
from affordance.robots.arm_file import write_arm, write_directives
from affordance.robots.importer import extract_arm
from affordance.robots.kept import import_kept
from affordance.runs.repeats import compute_key
from affordance.settings import Settings
from studies.arms.measure import measure_sag
from studies.arms.parity import compute_parity
from studies.arms.robots import Robot
from studies.study import keep_result

OK = "ok"
EXPERIMENTS = ("weight", "com", "reach", "hammer")
# Rotor inertias that are tried at every joint, in addition to zero, for robots whose file gives none, [kg m^2].
ROTORS = (0.03, 0.1, 0.3)
# Index of the heaviest object of Simulation I, which is the most likely to make the arm reach limits.
_HEAVIEST = 3
# Results of experiments that the paper's claims depend on.
_OUTCOMES = {
    "weight": ("drop_m", "decoy_lift_m", "decoy_rises", "periods_limited"),
    "com": ("mass_error", "com_error_m", "height_extreme_m"),
    "reach": ("p_correct", "correct_grip", "energy_ratio_true"),
    "hammer": ("p_correct", "correct_grip", "energy_ratio_true", "force_demanded_N", "force_measured_N"),
}
_CHANGED = "# Changed by affordance import-arm: "


@dataclass(frozen=True)
class RunConfig:
    """Configuration of the runs of an arm."""

    seed: int = 0  # root of every random draw
    repeats: int = 20  # number of observers of each experiment
    changes: tuple[tuple[str, Any], ...] = ()  # settings that differ from their defaults, by name


def study_robot(robot: Robot, robots: Path, config: RunConfig, out: Path, jobs: int) -> dict[str, Any]:
    """Studies one robot from its file in the folder of robots.

    Returns:
        Numbers for other programs in ``metrics``, and further numbers that explain them.
    """
    path = robots / robot.file
    try:
        models = import_kept(path, robot.options, out / "imported")
    except AffordanceError as error:
        return {"metrics": _fail(str(error).replace(str(path), path.name)), "required": robot.required}

    def compute() -> dict[str, Any]:
        arm, home = extract_arm(path, robot.options)
        try:
            parity: float | None = compute_parity(path, robot.options, config.seed).largest
        except ImportError:
            parity = None
        ran, measured = _run_and_measure(models, config, out / robot.name, jobs)
        metrics = {
            "loads": True,
            "joints": len(arm.links),
            "frozen_joints": len(arm.frozen),
            "parity_error": parity,
            "payload_kg": home.payload,
            "home_torque_ratio": home.load,
            "experiments": {name: OK if isinstance(found, dict) else found for name, found in ran.items()},
            "real_time_factor": measured["sag"]["real_time_factor"],
            "changed": _list_changed(models),
        }
        return {
            "required": robot.required,
            "metrics": metrics,
            **measured,
            "sag_with_rotors": {
                str(rotor): _measure_with_rotors(path, robot, rotor, models, config, out) for rotor in ROTORS
            },
            "arm_mass_kg": arm.mass,
            "empty_load": home.empty_load,
        }

    return keep_result(out / robot.name / "summary.json", compute_key((robot.name, config), models, _ALL), compute)


def study_ours(config: RunConfig, out: Path, jobs: int) -> dict[str, Any]:
    """Measures the arm that comes with the program, for comparison."""
    key = compute_key(("ours", config), MODELS, _ALL)
    return keep_result(
        out / "ours" / "summary.json", key, lambda: _run_and_measure(MODELS, config, out / "ours", jobs)[1]
    )


_ALL = Path(__file__).parents[1]


def run_program(name: str, models: Path, out: Path, config: RunConfig, jobs: int = 1) -> dict[str, Any] | str:
    """Runs an experiment into a folder; observers whose results are stored there are not simulated again.

    Returns:
        Metrics, with the claims in ``claims``; or, in one line, the reason why the experiment cannot run.
    """
    try:
        settings = change_settings(Settings(arm=models / ARM.name), dict(config.changes))
        run_suite([name], Setup(config.repeats, config.seed, jobs, models, out, settings))
    except AffordanceError as error:
        return str(error).replace(f"{models}/", "")
    metrics, section = (
        json.loads((out / name / file).read_text(encoding="utf-8")) for file in ("metrics.json", "section.json")
    )
    return {**metrics, "claims": {claim["text"]: claim["met"] for claim in section["claims"]}}


def _run_and_measure(
    models: Path, config: RunConfig, out: Path, jobs: int
) -> tuple[dict[str, dict[str, Any] | str], dict[str, Any]]:
    """Runs every possible experiment, and measures the sag with the first and the heaviest object.

    Returns:
        Metrics of each experiment, or the reason why it cannot run; and the numbers to store.
    """
    changes = dict(config.changes)
    ran = {name: run_program(name, models, out, config, jobs) for name in EXPERIMENTS}
    done = {name: one for name, one in ran.items() if isinstance(one, dict)}
    return ran, {
        "sag": measure_sag(models, changes=changes)._asdict(),
        "heavy": measure_sag(models, tool_index=_HEAVIEST, changes=changes)._asdict(),
        "claims": {name: one["claims"] for name, one in done.items()},
        **{name: {key: one.get(key) for key in _OUTCOMES[name]} for name, one in done.items()},
    }


def _measure_with_rotors(
    path: Path, robot: Robot, rotor: float, models: Path, config: RunConfig, out: Path
) -> dict[str, Any]:
    """Measures the sag of the first hold when every joint has a given rotor inertia."""
    arm, home = extract_arm(path, dataclasses.replace(robot.options, rotor_inertia={"": rotor}))
    folder = out / "imported" / "with_rotors"
    write_text(folder / "arm.sdf", write_arm(arm, {}, path.name))
    write_text(folder / ARM.name, write_directives(arm, home.q))
    write_text(folder / "package.xml", (models / "package.xml").read_text(encoding="utf-8"))
    return measure_sag(folder, task_models=models, changes=dict(config.changes))._asdict()


def _list_changed(models: Path) -> list[str]:
    """Lists the values of the tasks that differ from ours, each with its old value, new value and reason."""
    files = [
        models / "nail.yaml",
        *(path for name in ("paths", "tools") for path in sorted((models / name).glob("*.yaml"))),
    ]
    lines = [line for file in files for line in file.read_text(encoding="utf-8").splitlines()]
    return [line.removeprefix(_CHANGED) for line in lines if line.startswith(_CHANGED)]


def _fail(reason: str) -> dict[str, Any]:
    unknown = ("joints", "frozen_joints", "parity_error", "payload_kg", "home_torque_ratio", "real_time_factor")
    return {
        "loads": False,
        **dict.fromkeys(unknown),
        "experiments": dict.fromkeys(EXPERIMENTS, reason),
        "changed": [],
    }
