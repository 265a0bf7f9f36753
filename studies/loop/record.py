"""Recordings of pieces of stock on disk, as a user's logs.

For each piece two CSV files, the motion with an empty hand and with the piece, and a YAML file that describes them.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.files.atomic import write_text
from affordance.files.model_folder import MODELS
from affordance.identification.recording.run import Run
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.load import HAND_FRAME
from affordance.robots.robot import Robot
from affordance.settings import DEFAULT_SETTINGS
from studies.loop.lives import draw_truth
from studies.loop.recordings import Signals, build_recorder

STOCK = MODELS / "workshop" / "blanks.yaml"


class Recorded(NamedTuple):
    """Recorded piece of stock."""

    mass: float  # true mass, [kg]
    empty: Path  # recording of the empty hand
    loaded: Path  # recording with the piece


def record_stock(robot: Robot, folder: Path, signals: Signals, seed: int) -> dict[str, Recorded]:
    """Writes the recordings of all pieces of stock; returns what was recorded of each, by its name."""
    rng = np.random.default_rng(seed)
    recorder = build_recorder(robot, signals, rng)
    files = {}
    for piece in load_tools(STOCK, load_materials()):
        truth = draw_truth(piece, DEFAULT_SETTINGS.prior.deviation_sd, rng)
        runs = recorder.record(truth.parameters, rng, piece.name)
        stem = piece.name.replace(" ", "_")
        files[piece.name] = Recorded(
            float(truth.parameters[0]),
            _write(folder / f"{stem}_empty.csv", runs.empty[0]),
            _write(folder / f"{stem}.csv", runs.loaded),
        )
    return files


def _write(path: Path, run: Run) -> Path:
    assert run.v is not None
    joints = run.description.joint_names
    header = ",".join(["time", *(f"{kind}_{i + 1}" for kind in ("q", "v", "tau") for i in range(len(joints)))])
    rows = np.hstack([run.times[:, None], run.q, run.v, run.signal])
    lines = [header, *(",".join(f"{value:.6g}" for value in row) for row in rows)]
    write_text(path, "\n".join(lines) + "\n")
    text = f"joints: [{', '.join(joints)}]\nsignal: {run.description.kind.value}\ntip: {HAND_FRAME}\n"
    write_text(path.with_suffix(".yaml"), text)
    return path


def print_recorded(robot: Path, folder: Path, signals: Signals, seed: int) -> int:
    """Records the stock on the robot in a folder of models, and prints true masses; returns exit status 0."""
    for name, piece in record_stock(Robot.load(robot), folder, signals, seed).items():
        print(f"{name}: truly {piece.mass:.3f} kg: {piece.loaded}")
    return 0
