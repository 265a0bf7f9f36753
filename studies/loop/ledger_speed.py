"""Ledger under load: times of recall and append, losses when writers are killed, and traces left after forgetting."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from unittest import mock

import numpy as np
from tqdm import tqdm

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.files.model_folder import MODELS
from affordance.memory.ledger import open_memory
from affordance.memory.stored_trials import Selection
from affordance.memory.trial_evidence import TrialEvidence, show_time
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.torque_noise import WeberNoise
from affordance.vision.eye import measure_drawing
from affordance.vision.systems import measure_geometry

_ROOT = Path(__file__).parents[2]
# Number of trials that are appended one by one, of timed recalls, and of trials acknowledged before a writer is
# killed.
_SINGLE, _RECALLS, _ACKNOWLEDGED = 200, 10, 50
_BATCH = 2000
_BEGIN = datetime(2026, 1, 1, tzinfo=UTC)


def measure_ledger(count: int) -> dict[str, float]:
    """Measures a ledger with ``count`` trials.

    Returns:
        Values for ``memory`` in metrics.json: ``first_recall_s_1e5`` and ``recall_s_1e5``, the time to open the
        ledger and recall, for the first time and as the median of later ones, [s]; ``appends_per_s``; ``lost`` and
        ``double``, numbers of trials; ``forget_error``, relative; and ``trials``.
    """
    with tempfile.TemporaryDirectory() as folder, mock.patch.dict(os.environ, XDG_CACHE_HOME=folder):
        place = Path(folder) / "ledger.sqlite"
        with open_memory(place) as ledger:
            first = make_trials(0, min(_BATCH, count))
            ledger.append(first)
            for start in tqdm(range(_BATCH, count, _BATCH), desc="ledger: trials", unit="batch", disable=None):
                ledger.append(make_trials(start, min(_BATCH, count - start)))
            first_recall, *times = [_time_recall(place) for _ in range(1 + _RECALLS)]
            more = make_trials(count, _SINGLE)
            begin = time.perf_counter()
            for trial in more:
                ledger.append([trial])
            appends_per_s = _SINGLE / (time.perf_counter() - begin)
            forget_error = _measure_forgetting(Path(folder), first[: min(500, count)])
        lost, double = _kill_writer(Path(folder))
    return {
        "trials": count,
        "first_recall_s_1e5": first_recall,
        "recall_s_1e5": float(np.median(times)),
        "appends_per_s": appends_per_s,
        "lost": lost,
        "double": double,
        "forget_error": forget_error,
    }


def make_trials(start: int, count: int) -> list[TrialEvidence]:
    """Builds trials, numbered from ``start``, in which pieces of stock are held in the arm's home posture."""
    pieces = load_tools(MODELS / "workshop" / "blanks.yaml", load_materials())
    static, noise = StaticHold(load_arm(ARM)), WeberNoise()
    made = []
    for piece in pieces:
        features = measure_drawing(piece)
        geometry = measure_geometry(features, range(len(features)), len(features))
        nothing = noise.compute_features(static.tau_arm, static.tau_arm, static.Y)
        parts = tuple(part.appearance for part in features)
        made.append(TrialEvidence(piece.name, parts, geometry, noise, nothing, 10, len(static.tau_arm), "arm"))
    trials = []
    for number in range(start, start + count):
        kind = number % len(pieces)
        rng = np.random.default_rng([31, number])
        tau = static.tau_arm + static.Y @ pieces[kind].parameters
        tau = tau + noise.compute_sd(tau) * rng.standard_normal(len(tau))
        moment = show_time(_BEGIN + timedelta(seconds=number))
        # Each object is held ten times.
        name = f"{pieces[kind].name} {number // (10 * len(pieces))}"
        felt = noise.compute_features(tau, static.tau_arm, static.Y)
        trials.append(replace(made[kind], object_name=name, features=felt, time=moment))
    return trials


def _time_recall(place: Path) -> float:
    begin = time.perf_counter()
    with open_memory(place, create=False) as ledger:
        ledger.recall()
    return time.perf_counter() - begin


def _measure_forgetting(folder: Path, trials: Sequence[TrialEvidence]) -> float:
    """Computes the largest relative difference of a belief after forgetting from one that never had the evidence."""
    with open_memory(folder / "forgets.sqlite") as ledger, open_memory(folder / "never.sqlite") as never:
        ledger.append(trials)
        forgotten = trials[-1].object_name
        ledger.forget(Selection(object_name=forgotten))
        never.append([trial for trial in trials if trial.object_name != forgotten])
        one, other = (each.recall(prior=Prior()) for each in (ledger, never))
        assert isinstance(one, MaterialMemory)
        differences = [
            np.abs(a - b).max() / np.abs(b).max()
            for a, b in (
                (one.belief.precision, other.belief.precision),
                (one.belief.information_vector, other.belief.information_vector),
            )
        ]
        return float(max(differences))


def _kill_writer(folder: Path) -> tuple[int, int]:
    """Kills one of two processes that append trials; returns the numbers of trials lost and counted twice."""
    place = folder / "killed.sqlite"

    def append(start: int, count: int) -> subprocess.Popen[str]:
        program = (
            f"from studies.loop.ledger_speed import append_slowly; append_slowly({str(place)!r}, {start}, {count})"
        )
        return subprocess.Popen([sys.executable, "-c", program], cwd=_ROOT, stdout=subprocess.PIPE, text=True)

    with append(0, 1_000_000) as killed, append(500_000, 50) as other:
        assert killed.stdout is not None
        assert other.stdout is not None
        acknowledged = [killed.stdout.readline().strip() for _ in range(_ACKNOWLEDGED)]
        killed.kill()
        acknowledged += killed.stdout.read().split()
        acknowledged += other.stdout.read().split()
    with open_memory(place) as ledger:
        ledger.append(make_trials(0, _ACKNOWLEDGED))  # like a writer that heard of no success and tries again
        trials = ledger.list_trials()
    return len(set(acknowledged) - {trial.id for trial in trials}), count_double(trials)


def count_double(trials: Sequence[TrialEvidence]) -> int:
    """Counts trials that are stored twice, recognised by their times (unique to each trial), not their ids."""
    return len(trials) - len({trial.time for trial in trials})


def append_slowly(place: str, start: int, count: int) -> None:
    """Appends trials one by one, and prints each id once its trial is stored."""
    with open_memory(place) as ledger:
        for number in range(start, start + count):
            (trial,) = make_trials(number, 1)
            ledger.append([trial])
            print(trial.id, flush=True)
