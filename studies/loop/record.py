"""Writes recordings of pieces of stock in the form of a user's logs, among them those that come with the package.

Each piece has two CSV files, one with an empty hand and one with the piece, and a YAML file that describes them.
"""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.cli import main as run_command
from affordance.commands.demo import EMPTY, LOADED, PIECE, STOCK, TRIALS
from affordance.files.atomic import write_text
from affordance.identification.recording.run import Run
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.load import HAND_FRAME
from affordance.robots.robot import Robot
from affordance.settings import DEFAULT_SETTINGS
from studies.loop.lives import draw_truth
from studies.loop.recordings import TORQUE_SENSORS, Signals, build_recorder

_SEED = 0
# Errors as fractions of the torque limits, smaller than a robot's. A human arm is strong for its weight, so errors
# that are a usual fraction of its limits would hide the load.
_SIGNALS = TORQUE_SENSORS._replace(friction=(0.0005, 0.0005, 0.0005), noise_sd=0.0005)
# Every second row of the first 8 s is written, which gives 50 Hz.
_ROWS, _STEP = 800, 2


class Recorded(NamedTuple):
    """Recorded piece of stock."""

    mass: float  # true mass, [kg]
    empty: Path  # recording of the empty hand
    loaded: Path  # recording with the piece


def record_stock(robot: Robot, folder: Path, signals: Signals, seed: int) -> dict[str, Recorded]:
    """Writes the recordings of all pieces of stock, and returns them by name of the piece."""
    rng = np.random.default_rng(seed)
    recorder = build_recorder(robot, signals, rng)
    files = {}
    for piece in load_tools(STOCK, load_materials()):
        pi = draw_truth(piece, DEFAULT_SETTINGS.prior.deviation, rng)
        runs = recorder.record(pi, rng, piece.name)
        stem = piece.name.replace(" ", "_")
        files[piece.name] = Recorded(
            float(pi[0]),
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
    """Records the stock on the robot in a folder of models, and prints the true masses; returns exit status 0."""
    for name, piece in record_stock(Robot.load(robot), folder, signals, seed).items():
        print(f"{name}: true mass {piece.mass:.3f} kg: {piece.loaded}")
    return 0


def write_demo() -> int:
    """Records stock on the paper's arm for ``identify --demo`` and ``rank --demo``; returns exit status 0."""
    with tempfile.TemporaryDirectory() as folder:
        memory = Path(folder) / "demo.sqlite"
        recorded = record_stock(Robot.load(), Path(folder), _SIGNALS, _SEED)
        for name, piece in recorded.items():
            words = ["--empty", piece.empty, "--loaded", piece.loaded, "--object", STOCK, "--object-name", name]
            words += ["--size-error", 0.02, "--unseen", 0.02, "--memory", memory]
            run_command(["identify", str(Robot.load().folder / "arm.dmd.yaml"), *map(str, words)])
        TRIALS.parent.mkdir(exist_ok=True)
        run_command(["memory", "export", str(memory), str(TRIALS)])
        for path, target in ((recorded[PIECE].empty, EMPTY), (recorded[PIECE].loaded, LOADED)):
            header, *rows = path.read_text(encoding="utf-8").splitlines()
            write_text(target, "\n".join([header, *rows[:_ROWS:_STEP]]) + "\n")
            write_text(target.with_suffix(".yaml"), path.with_suffix(".yaml").read_text(encoding="utf-8"))
        print(f"the true mass of the {PIECE} is {np.round(recorded[PIECE].mass, 3)} kg")
    return 0
