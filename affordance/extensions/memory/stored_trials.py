"""Reads, adds and deletes trials in the table of a ledger."""

import json
import sqlite3
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.arguments import check_array, check_kind
from affordance.exceptions import BadArgumentError, BadValueError, describe_choice, show_value
from affordance.extensions.memory.tables import LARGEST_RECORD
from affordance.extensions.memory.trial_evidence import FELT_MODELS, PLAIN, TrialEvidence, read_time
from affordance.files.data_model import DataModel, check_content
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import NUM_PARAMETERS, Geometry

# Number of trials that are looked up at a time.
_BATCH = 500
_SHORTEST_ID = 4
# Columns of a trial: the values of its record by which commands search, and last the record itself.
_COLUMNS = ("id", "time", "robot", "fingerprint", "object", "digest", "content")

_TOO_LARGE = f"has a record of more than {LARGEST_RECORD / 1e6:g} MB, must be smaller"

type Row = tuple[str, ...]


class Selection(NamedTuple):
    """Selection of trials that meet all given conditions.

    Attributes:
        robot: Name of the robot.
        object_name: Name of the object.
        since: Earliest selected time, ISO 8601, in UTC unless it has an offset.
        until: Time before which trials are selected, likewise.
        trial: Beginning of the id of a trial, at least four digits.

    Example:
        >>> from affordance import Selection
        >>> Selection(robot="panda", since="2026-01-01").robot
        'panda'
    """

    robot: str = ""
    object_name: str = ""
    since: str = ""
    until: str = ""
    trial: str = ""

    def narrow(self) -> tuple[str, list[str]]:
        """Builds the SQL condition for the selection, empty if all trials are selected, and its values.

        Raises:
            BadArgumentError: A time is invalid, or the id of a trial is too short.
        """
        for name, value in self._asdict().items():
            check_kind(name, value, str)
        if self.trial and len(self.trial) < _SHORTEST_ID:
            raise BadArgumentError("trial", "", f"is {self.trial!r}, must be at least {_SHORTEST_ID} digits of an id")
        conditions = {
            "robot = ?": self.robot,
            "object = ?": self.object_name,
            "time >= ?": self.since and read_time("since", self.since),
            "time < ?": self.until and read_time("until", self.until),
            f"substr(id, 1, {len(self.trial)}) = ?": self.trial,
        }
        given = {condition: value for condition, value in conditions.items() if value}
        return f" WHERE {' AND '.join(given)}" if given else "", list(given.values())


ALL = Selection()


class _PartEntry(DataModel):
    """Part of an object in a record."""

    colour: list[float]
    sizes: list[float]
    position: list[float]
    colour_sd: float = 0.0
    size_sd: float = 0.0
    position_sd: float = 0.0
    lightness_sd: float = 0.0


class _TrialEntry(DataModel):
    """Record of a trial in a ledger or a file."""

    id: str
    time: str
    robot: str
    fingerprint: str
    object: str
    parts: list[_PartEntry]
    Phi: list[list[float]]
    Phi_errors: list[list[list[float]]]
    model: dict[str, str | bool | float]
    features: list[float]
    num_samples: int
    num_joints: int
    log_evidence: float
    p_value: float
    source: str
    source_hash: str
    program: str
    digest: str

    def build(self) -> TrialEvidence:
        """Builds the evidence.

        Raises:
            BadArgumentError: If values are invalid, or the id or digest does not match the content.
        """
        numbers = dict(self.model)
        name = numbers.pop("name", "")
        if name not in FELT_MODELS:
            raise BadArgumentError("model.name", "", describe_choice(name, FELT_MODELS))
        try:
            model = FELT_MODELS[str(name)](**numbers)
        except TypeError as error:
            raise BadArgumentError("model", "", f"does not fit {name}: {error}") from error
        size = len(self.parts)
        errors = np.zeros((0, NUM_PARAMETERS, size))
        if self.Phi_errors:
            errors = check_array("geometry.Phi_errors", self.Phi_errors, (None, NUM_PARAMETERS, size))
        trial = TrialEvidence(
            object_name=self.object,
            parts=tuple(PartAppearance(**vars(part)) for part in self.parts),
            geometry=Geometry(check_array("geometry.Phi", self.Phi, (NUM_PARAMETERS, size)), errors),
            model=model,
            features=np.array(self.features),
            robot=self.robot,
            fingerprint=self.fingerprint,
            time=self.time,
            **{name: getattr(self, name) for name in PLAIN},
        )
        if trial.id != self.id:
            raise BadArgumentError("id", "", f"is {self.id!r}, must be {trial.id!r}, the digest of the content")
        if trial.digest != self.digest:
            problem = f"is {self.digest!r}, must be {trial.digest!r}, the digest of the record, which was changed"
            raise BadArgumentError("digest", "", problem)
        return trial


class Appended(NamedTuple):
    """Numbers of new trials, and of stored records replaced by an earlier record of the same recording."""

    new: int
    replaced: int


def get_precedence(trial: TrialEvidence) -> str:
    """Returns the key by which records of one id are sorted: time, then digest. The first record is kept."""
    return trial.time + trial.digest


def find_known(connection: sqlite3.Connection, ids: Sequence[str]) -> dict[str, str]:
    """Finds which of the given ids are stored, with the precedence of each record."""
    known: dict[str, str] = {}
    for start in range(0, len(ids), _BATCH):
        chosen = ids[start : start + _BATCH]
        query = f"SELECT id, time || digest FROM trials WHERE id IN ({','.join('?' * len(chosen))})"
        known |= dict(connection.execute(query, chosen))
    return known


def insert_trials(connection: sqlite3.Connection, trials: Sequence[TrialEvidence]) -> None:
    """Inserts trials; a record that is too large raises a BadArgumentError."""
    query = f"INSERT INTO trials ({', '.join(_COLUMNS)}) VALUES ({','.join('?' * len(_COLUMNS))})"
    connection.executemany(query, (_build_row(trial, write_record(trial)) for trial in trials))


def delete_trials(connection: sqlite3.Connection, ids: Sequence[str]) -> None:
    """Deletes trials."""
    connection.executemany("DELETE FROM trials WHERE id = ?", ((each,) for each in ids))


def read_rows(connection: sqlite3.Connection, path: Path, selection: Selection = ALL) -> Iterator[Row]:
    """Reads the rows of the selected trials in the order of their times; only this order is checked."""
    condition, values = selection.narrow()
    before: Row = ()
    for row in connection.execute(f"SELECT {', '.join(_COLUMNS)} FROM trials{condition} ORDER BY time, id", values):
        if not all(isinstance(each, str) for each in row):
            raise BadValueError(
                path, f"trial {show_value(row[0])}", "has a column that is not text, must be written by this program"
            )
        if row[1::-1] <= before:
            raise BadValueError(path, f"trial {row[0]}", "is stored twice or out of order: the file is damaged")
        before = row[1::-1]
        yield row


def read_trials(connection: sqlite3.Connection, path: Path, selection: Selection = ALL) -> Iterator[TrialEvidence]:
    """Reads the selected trials in the order of their times; an invalid record raises a BadValueError."""
    return (read_row(path, row) for row in read_rows(connection, path, selection))


def read_row(path: Path, row: Row) -> TrialEvidence:
    """Reads the trial in a row.

    Raises:
        BadValueError: If the record is invalid, or a column differs from it.
    """
    trial = read_record(path, f"trial {row[0]}", row[-1])
    for column, value, wanted in zip(_COLUMNS, row, _build_row(trial, row[-1]), strict=True):
        if value != wanted:
            problem = f"column {column} is {show_value(value)}, must be {wanted!r}, as in the record"
            raise BadValueError(path, f"trial {row[0]}", problem)
    return trial


def check_trials(connection: sqlite3.Connection, path: Path) -> list[str]:
    """Checks every row; returns one line per fault."""
    faults = []
    for row in read_rows(connection, path):
        try:
            read_row(path, row)
        except BadValueError as error:
            faults.append(str(error))
    return faults


def read_record(path: Path, key: str, text: str) -> TrialEvidence:
    """Reads a record from its text.

    Raises:
        BadValueError: If the record is invalid; the message names ``path`` and ``key``.
    """
    if len(text) > LARGEST_RECORD:
        raise BadValueError(path, key, _TOO_LARGE)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadValueError(path, key, f"is not JSON: {error}") from error
    return parse_trial(path, key, content)


def write_record(trial: TrialEvidence) -> str:
    """Formats a trial as the text of a record.

    Raises:
        BadArgumentError: If the text is too large to be read again.
    """
    text = json.dumps(trial.to_dict())
    if len(text) > LARGEST_RECORD:
        raise BadArgumentError(f"trial {trial.id}", "", _TOO_LARGE)
    return text


def parse_trial(path: Path, key: str, content: Any) -> TrialEvidence:
    """Builds the evidence from the JSON content of a record.

    Raises:
        BadValueError: If the content is invalid; the message names the file or database, and the key.
    """
    entry = check_content(path, key, content, _TrialEntry)
    try:
        return entry.build()
    except BadArgumentError as error:
        where = ".".join(each for each in (key, str(error.source), error.key) if each)
        raise BadValueError(path, where, error.problem) from error


def _build_row(trial: TrialEvidence, content: str) -> Row:
    return trial.id, trial.time, trial.robot, trial.fingerprint, trial.object_name, trial.digest, content
