"""Files of trials as JSON Lines, to carry a memory elsewhere, and memories of earlier versions."""

import hashlib
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from affordance.belief.density_belief import EMPTY_BELIEF, Prior
from affordance.belief.memory_file import build_memory, find_taught
from affordance.exceptions import BadValueError
from affordance.files.atomic import write_text
from affordance.files.bounded import read_text
from affordance.memory.felt_models import MeanDensities
from affordance.memory.ledger import Ledger
from affordance.memory.stored_trials import parse_trial
from affordance.memory.tables import PROGRAM, SCHEMA, describe_schema
from affordance.memory.trial_evidence import TrialEvidence, show_time
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import NUM_PARAMETERS, Geometry

# Size of a file of trials: 10^5 of them.
_MOST = 1_000_000_000
# Share of the largest eigenvalue by which a precision may lie below that of the prior.
_ROUNDING = 1e-9
_EARLIER = "memory of an earlier version"


def export_trials(ledger: Ledger, path: Path) -> int:
    """Writes all trials to a file, one a line after a line about the file; returns their number."""
    trials = ledger.list_trials()
    lines = [{"program": PROGRAM, "schema": SCHEMA}, *(trial.to_dict() for trial in trials)]
    write_text(path, "".join(f"{json.dumps(line)}\n" for line in lines))
    return len(trials)


def read_trials(path: Path, prior: Prior) -> list[TrialEvidence]:
    """Reads a file of trials, or an earlier version's memory, less its prior; raises a BadValueError for others."""
    text = read_text(path, _MOST)
    lines = [(i, line) for i, line in enumerate(text.split("\n"), 1) if line.strip()]
    if not lines:
        raise BadValueError(path, "", "is empty, must be a memory that was exported")
    try:
        first = json.loads(lines[0][1])
    except (ValueError, RecursionError):
        first = None
    if not (isinstance(first, dict) and "schema" in first):
        return _read_earlier(path, text, prior)
    if first.get("program") != PROGRAM or first["schema"] != SCHEMA:
        problem = f"is {first['schema']!r} of {first.get('program')!r}, must be {SCHEMA!r} of {PROGRAM!r}"
        if first.get("program") == PROGRAM:
            problem = describe_schema(first["schema"])
        raise BadValueError(path, "line 1: schema", problem)
    return [parse_trial(path, f"line {i}", _parse(path, i, line)) for i, line in lines[1:]]


def _parse(path: Path, number: int, line: str) -> Any:
    try:
        return json.loads(line)
    except (ValueError, RecursionError) as error:
        raise BadValueError(path, f"line {number}", f"is not JSON: {error}") from error


def _read_earlier(path: Path, text: str, prior: Prior) -> list[TrialEvidence]:
    """Reads the memory of an earlier version as one trial, and each run that taught it as one without content."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadValueError(path, "", f"is not a memory: neither exported trials nor JSON: {error}") from error
    memory, taught = build_memory(path, content), find_taught(path, content)
    if not memory.colours:
        return []
    start = EMPTY_BELIEF.extend(prior, memory.belief.size)
    precision = memory.belief.precision - start.precision
    least, largest = np.linalg.eigvalsh(precision)[[0, -1]]
    if least < -_ROUNDING * max(largest, 0.0):
        raise BadValueError(path, "", f"is less certain than the prior, whose SD is {prior.sd:g} kg/m^3 (--set)")
    information = memory.belief.information_vector - start.information_vector
    digest = hashlib.sha256(text.encode()).hexdigest()
    time = show_time(datetime.fromtimestamp(path.stat().st_mtime, UTC))
    size = len(memory.colours)
    parts = tuple(PartAppearance(colour, (1.0,), (0.0, 0.0, 0.0)) for colour in memory.colours)
    Phi = np.zeros((NUM_PARAMETERS, size))
    Phi[0] = 1.0  # volumes that nothing depends on
    nothing = np.zeros(size * (size + 1))

    def build(features: np.ndarray[Any, Any], source_hash: str) -> TrialEvidence:
        return TrialEvidence(
            object_name=f"{_EARLIER}: {path.name}",
            parts=parts,
            geometry=Geometry(Phi, np.zeros((0, NUM_PARAMETERS, size))),
            model=MeanDensities(),
            features=features,
            num_samples=1,
            num_joints=size,
            robot=_EARLIER,
            time=time,
            source=str(path.name),
            source_hash=source_hash,
        )

    learned = build(np.concatenate([precision.ravel(), information]), digest)
    return [learned, *(build(nothing, fingerprint) for fingerprint in taught)]
