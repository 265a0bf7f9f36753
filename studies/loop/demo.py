"""Recordings of ``affordance identify --demo`` and trials of ``rank --demo``, which come with the package."""

import tempfile
from pathlib import Path

import numpy as np

from affordance.cli import main as run_command
from affordance.commands.demo import EMPTY, LOADED, PIECE, STOCK, TRIALS
from affordance.files.atomic import write_text
from affordance.robots.robot import Robot
from studies.loop.record import record_stock
from studies.loop.recordings import TORQUE_SENSORS

_SEED = 0
# Smaller errors than those of a robot, as shares of the torque limits: a human arm is strong for its weight, and
# errors in proportion to its limits would hide the load.
_SIGNALS = TORQUE_SENSORS._replace(friction=(0.0005, 0.0005, 0.0005), noise_sd=0.0005)
# Of the rows of the first 8 s every second one: 50 Hz.
_ROWS, _STEP = 800, 2


def write_demo() -> int:
    """Records all pieces of stock on the paper's arm, keeps one recording and what all taught; returns status 0."""
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
        print(f"the {PIECE} truly weighs {np.round(recorded[PIECE].mass, 3)} kg")
    return 0
