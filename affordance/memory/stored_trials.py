"""Trials in the tables of a ledger: reading, adding, and identifying the thing of each.

Trials of one name and one look are about one thing. A name with another look is another thing: "hammer", "hammer #2".
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sqlalchemy import Connection, Select, delete, func, insert, select, update

from affordance.exceptions import BadArgumentError, BadValueError
from affordance.files.data_model import check_content
from affordance.memory.tables import TRIALS
from affordance.memory.trial_evidence import TrialEntry, TrialEvidence, read_time
from affordance.objects.appearance import is_same_object

# Trials that are read or written at a time.
BATCH = 500
_SHORTEST_ID = 4
# Sort key of a trial, a text in the order of times.
_ORDER = TRIALS.c.time + TRIALS.c.id


class Selection(NamedTuple):
    """Selection of trials; all that are given must hold.

    Attributes:
        robot: Name of the robot.
        object_name: Name of the object.
        since: First time that is selected, ISO 8601, UTC unless it says otherwise.
        until: First time that is not selected any more.
        trial: Beginning of the id of a trial, at least four digits.
    """

    robot: str = ""
    object_name: str = ""
    since: str = ""
    until: str = ""
    trial: str = ""

    def narrow(self, query: Select[Any]) -> Select[Any]:
        """Returns a query of trials that is restricted to the selected ones.

        Raises:
            BadArgumentError: A time is invalid, or the id of a trial is too short.
        """
        if self.trial and len(self.trial) < _SHORTEST_ID:
            raise BadArgumentError("trial", "", f"is {self.trial!r}, must be at least {_SHORTEST_ID} digits of an id")
        if self.robot:
            query = query.where(TRIALS.c.robot == self.robot)
        if self.object_name:
            query = query.where(TRIALS.c.object == self.object_name)
        if self.since:
            query = query.where(TRIALS.c.time >= read_time("since", self.since))
        if self.until:
            query = query.where(TRIALS.c.time < read_time("until", self.until))
        if self.trial:
            query = query.where(TRIALS.c.id.startswith(self.trial, autoescape=True))
        return query


ALL = Selection()

# Names of the things of each object's name, with the first trial of each, in the order in which they were met.
type Looks = dict[str, list[tuple[str, TrialEvidence]]]


class Appended(NamedTuple):
    """Numbers of appended trials: new ones, and records that an earlier one of the same recording replaced."""

    new: int
    replaced: int


def get_order(trial: TrialEvidence) -> str:
    """Returns the sort key of a trial, a text in the order of times."""
    return trial.time + trial.id


def get_precedence(trial: TrialEvidence) -> str:
    """Returns the sort key of records of one id, of which the first is kept: the earlier, then the lesser digest."""
    return trial.time + trial.digest


def find_known(connection: Connection, ids: Sequence[str]) -> dict[str, str]:
    """Finds the given ids that are stored, with the precedence of each record."""
    known: dict[str, str] = {}
    for start in range(0, len(ids), BATCH):
        query = select(TRIALS.c.id, TRIALS.c.time, TRIALS.c.digest).where(TRIALS.c.id.in_(ids[start : start + BATCH]))
        known |= {row.id: row.time + row.digest for row in connection.execute(query)}
    return known


def build_row(trial: TrialEvidence, thing: str, content: str) -> dict[str, str]:
    """Builds the row of a trial."""
    return {
        "id": trial.id,
        "time": trial.time,
        "robot": trial.robot,
        "fingerprint": trial.fingerprint,
        "object": trial.object_name,
        "thing": thing,
        "digest": trial.digest,
        "content": content,
    }


def insert_trials(
    connection: Connection, trials: Sequence[TrialEvidence], place: Path | str
) -> tuple[list[str], bool, set[str]]:
    """Inserts trials in the order of their times.

    Returns the thing of each trial, True if no thing is met earlier than before, and the names whose things must be
    named anew, as looks are met earlier.
    """
    latest = select(_ORDER).order_by(TRIALS.c.time.desc(), TRIALS.c.id.desc()).limit(1)
    last, is_settled = connection.execute(latest).scalar() or "", True
    looks: Looks = {}
    unsettled: set[str] = set()
    rows = []
    for trial in trials:
        if trial.object_name not in looks:
            looks[trial.object_name] = _read_looks(connection, trial.object_name, place)
        thing = name_thing(looks, trial)
        first = dict(looks[trial.object_name])[thing]
        if get_order(trial) <= (last if first is trial else get_order(first)):
            is_settled = False
            if len(looks[trial.object_name]) > 1 or trial.parts != first.parts:
                unsettled.add(trial.object_name)
        rows.append(build_row(trial, thing, json.dumps(trial.to_dict())))
    for start in range(0, len(rows), BATCH):
        connection.execute(insert(TRIALS), rows[start : start + BATCH])
    return [row["thing"] for row in rows], is_settled, unsettled


def delete_trials(connection: Connection, ids: Sequence[str]) -> set[str]:
    """Deletes trials; returns the names of their objects, whose things must be named anew."""
    names: set[str] = set()
    for start in range(0, len(ids), BATCH):
        is_chosen = TRIALS.c.id.in_(ids[start : start + BATCH])
        names |= set(connection.execute(select(TRIALS.c.object).where(is_chosen)).scalars())
        connection.execute(delete(TRIALS).where(is_chosen))
    return names


def name_things(connection: Connection, object_name: str, place: Path | str) -> None:
    """Names the things of all trials of an object's name anew, in the order of their times."""
    looks: Looks = {}
    query = select(TRIALS.c.id, TRIALS.c.content).where(TRIALS.c.object == object_name).order_by(_ORDER)
    for row in connection.execute(query).all():
        thing = name_thing(looks, read_trial(place, row.id, row.content))
        connection.execute(update(TRIALS).where(TRIALS.c.id == row.id).values(thing=thing))


def list_things(connection: Connection, only: str = "") -> dict[str, int]:
    """Lists the things, or only one, in the order in which they were first met, with the number of trials of each."""
    query = select(TRIALS.c.thing, func.count().label("number"), func.min(_ORDER).label("first"))
    if only:
        query = query.where(TRIALS.c.thing == only)
    rows = connection.execute(query.group_by(TRIALS.c.thing).order_by("first")).all()
    return {str(row.thing): int(row.number) for row in rows}


def read_thing(connection: Connection, thing: str, place: Path | str) -> list[TrialEvidence]:
    """Reads the trials of a thing, in the order of their times."""
    query = select(TRIALS.c.id, TRIALS.c.content).where(TRIALS.c.thing == thing).order_by(_ORDER)
    return [read_trial(place, row.id, row.content) for row in connection.execute(query)]


def read_selected(connection: Connection, selection: Selection, place: Path | str) -> Iterator[TrialEvidence]:
    """Reads the selected trials, in the order of their times."""
    query = selection.narrow(select(TRIALS.c.id, TRIALS.c.content)).order_by(TRIALS.c.time, TRIALS.c.id)
    for row in connection.execution_options(yield_per=BATCH).execute(query):
        yield read_trial(place, row.id, row.content)


def check_trials(connection: Connection, place: Path | str) -> tuple[list[str], dict[str, list[TrialEvidence]]]:
    """Checks every record and its columns; returns faults, a line each, and sound trials by thing.

    What is the thing of a trial is not checked after an invalid record of the name, as its look is unknown.
    """
    faults: list[str] = []
    unknown: set[str] = set()
    trials: dict[str, list[TrialEvidence]] = {}
    looks: Looks = {}
    query = select(TRIALS).order_by(TRIALS.c.time, TRIALS.c.id)
    for row in connection.execution_options(yield_per=BATCH).execute(query):
        try:
            trial = read_trial(place, row.id, row.content)
        except BadValueError as error:
            faults.append(str(error))
            unknown.add(row.object)
            continue
        thing = name_thing(looks, trial)
        trials.setdefault(thing, []).append(trial)
        faults += [
            f"{place}: trial {row.id}: column {key} is {getattr(row, key)!r}, must be {value!r}, as in the record"
            for key, value in build_row(trial, thing, row.content).items()
            if getattr(row, key) != value and not (key == "thing" and trial.object_name in unknown)
        ]
    return faults, trials


def read_trial(place: Path | str, name: str, content: str) -> TrialEvidence:
    """Reads the text of a record; an invalid one raises a BadValueError that says where and how."""
    try:
        found = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise BadValueError(place, f"trial {name}", f"is not JSON: {error}") from error
    return parse_trial(place, f"trial {name}", found)


def parse_trial(place: Path | str, key: str, content: Any) -> TrialEvidence:
    """Builds the evidence of a record from JSON, at a key of a file or database, or raises a BadValueError."""
    entry = check_content(Path(str(place)), key, content, TrialEntry)
    try:
        return entry.build()
    except BadArgumentError as error:
        where = ".".join(each for each in (key, str(error.source), error.key) if each)
        raise BadValueError(place, where, error.problem) from error


def _read_looks(connection: Connection, object_name: str, place: Path | str) -> list[tuple[str, TrialEvidence]]:
    """Reads the first trial of each thing of a name, with the thing's name."""
    first = select(func.min(_ORDER)).where(TRIALS.c.object == object_name).group_by(TRIALS.c.thing)
    query = select(TRIALS.c.thing, TRIALS.c.id, TRIALS.c.content).where(
        TRIALS.c.object == object_name, _ORDER.in_(first)
    )
    return [(row.thing, read_trial(place, row.id, row.content)) for row in connection.execute(query.order_by(_ORDER))]


def name_thing(looks: Looks, trial: TrialEvidence) -> str:
    """Returns the name of the thing that a trial is about, and adds its look if it is a new one."""
    met = looks.setdefault(trial.object_name, [])
    for thing, first in met:
        if is_same_object(first.parts, trial.parts):
            return thing
    thing = trial.object_name if not met else f"{trial.object_name} #{len(met) + 1}"
    met.append((thing, trial))
    return thing
