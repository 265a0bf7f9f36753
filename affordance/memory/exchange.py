"""Exports and imports trials as JSON Lines, and imports memories of earlier versions."""

import hashlib
import json
from collections.abc import Generator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from affordance.belief.density_belief import EMPTY_BELIEF, Prior
from affordance.exceptions import BadValueError, show_text
from affordance.files.atomic import write_text
from affordance.files.bounded import check_size, read_text
from affordance.files.constraints import OneLine
from affordance.memory.earlier_memory import read_belief, read_taught
from affordance.memory.felt_models import MeanDensities
from affordance.memory.ledger import Ledger, blame
from affordance.memory.stored_trials import read_record, write_record
from affordance.memory.tables import LARGEST_FILE, LARGEST_RECORD, PROGRAM, describe_schema
from affordance.memory.trial_evidence import TrialEvidence, show_time
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import NUM_PARAMETERS, Geometry

# Version of the record format, which has not changed since 0.3.0.
_SCHEMA = "2"
# Largest number of values in the records made from an earlier version's memory, which have a matrix for each run.
_MOST_NUMBERS = 10_000_000
# A precision may be below the prior's by rounding: by this fraction of its largest eigenvalue.
_ROUNDING = 1e-9
_EARLIER = "memory of an earlier version"


def export_trials(ledger: Ledger, path: Path) -> int:
    """Writes all trials to a file, one per line after a header line; returns their number."""
    trials = ledger.list_trials()
    lines = (json.dumps({"program": PROGRAM, "schema": _SCHEMA}), *map(write_record, trials))
    write_text(path, "".join(f"{line}\n" for line in lines))
    return len(trials)


def read_trials(path: Path, prior: Prior) -> list[TrialEvidence]:
    """Reads a file of trials, or an earlier version's memory, from which the prior is subtracted.

    Raises:
        BadValueError: If the file is neither, or cannot be read.
    """
    lines = _read_lines(path)
    _, begin = next(lines, (0, ""))
    if not begin:
        raise BadValueError(path, "", "is empty, must be an exported memory")
    try:
        first = json.loads(begin)
    except (ValueError, RecursionError):
        first = None
    if not (isinstance(first, dict) and "schema" in first):
        lines.close()
        return _read_earlier(path, read_text(path, LARGEST_RECORD), prior)
    if first.get("program") != PROGRAM:
        problem = f"is {first['schema']!r} of {first.get('program')!r}, must be {_SCHEMA!r} of {PROGRAM!r}"
        raise BadValueError(path, "line 1: schema", problem)
    if first["schema"] != _SCHEMA:
        raise BadValueError(path, "line 1: schema", describe_schema(first["schema"], _SCHEMA))
    return [read_record(path, f"line {number}", line) for number, line in lines]


def _read_lines(path: Path) -> Generator[tuple[int, str]]:
    """Yields the non-empty lines of a file with their numbers."""
    check_size(path, LARGEST_FILE)
    try:
        with path.open(encoding="utf-8") as file:
            # A line that is too long is truncated here and then rejected by ``read_record``.
            for number, line in enumerate(iter(lambda: file.readline(LARGEST_RECORD + 2), ""), 1):
                if line.strip():
                    yield number, line
    except OSError as error:
        raise BadValueError(path, "", f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise BadValueError(path, "", "is not a text file in UTF-8") from error


def _read_earlier(path: Path, text: str, prior: Prior) -> list[TrialEvidence]:
    """Converts an earlier version's memory to one trial, and each run it has learned from to an empty trial."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadValueError(path, "", f"is not a memory: neither exported trials nor JSON: {error}") from error
    (colours, belief), taught = read_belief(path, content), read_taught(path, content)
    if not colours:
        return []
    if (numbers := len(taught) * len(colours) ** 2) > _MOST_NUMBERS:
        problem = f"would need {numbers} numbers for its runs and materials, must need at most {_MOST_NUMBERS}"
        raise BadValueError(path, "", problem)
    start = EMPTY_BELIEF.extend(prior, belief.size)
    precision = belief.precision - start.precision
    with blame(path):
        least, largest = np.linalg.eigvalsh(precision)[[0, -1]]
    if least < -_ROUNDING * max(largest, 0.0):
        raise BadValueError(path, "", f"is less certain than the prior, whose SD is {prior.sd:g} kg/m^3 (--set)")
    information = belief.information_vector - start.information_vector
    digest = hashlib.sha256(text.encode()).hexdigest()
    time = show_time(datetime.fromtimestamp(max(path.stat().st_mtime, 0.0), UTC))
    name = show_text(path.name)
    size = len(colours)
    parts = tuple(PartAppearance(colour, (1.0,), (0.0, 0.0, 0.0)) for colour in colours)
    Phi = np.zeros((NUM_PARAMETERS, size))
    Phi[0] = 1.0  # arbitrary volumes, which have no effect
    nothing = np.zeros(size * (size + 1))

    def build(features: np.ndarray[Any, Any], source_hash: str) -> TrialEvidence:
        return TrialEvidence(
            object_name=f"{_EARLIER}: {name}"[: OneLine.longest],
            parts=parts,
            geometry=Geometry(Phi, np.zeros((0, NUM_PARAMETERS, size))),
            model=MeanDensities(),
            features=features,
            num_samples=1,
            num_joints=size,
            robot=_EARLIER,
            time=time,
            source=name,
            source_hash=source_hash,
        )

    with blame(path):
        learned = build(np.concatenate([precision.ravel(), information]), digest)
        return [learned, *(build(nothing, fingerprint) for fingerprint in taught)]
