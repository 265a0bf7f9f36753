"""Ledger of evidence with one record per trial, and the resulting beliefs.

Trials are added but never changed. Beliefs are not stored: they are recomputed from all trials in chronological
order, regardless of the order in which trials were added.

The ledger is an SQLite file. For security, files with other tables, indices, triggers or views are rejected. Each
record is stored as JSON, together with columns for searching that SQLite extracts from the JSON.
"""

import json
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np

from affordance.arguments import Seed, check_kind
from affordance.belief.colour_recognition import find_colour_index, find_material
from affordance.belief.density_belief import Prior
from affordance.belief.holds import Felt
from affordance.belief.learner import Learner, Seen
from affordance.belief.learners import DENSITY, check_learner
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.exceptions import AffordanceError, BadArgumentError, BadValueError
from affordance.extensions.memory.trial_evidence import TrialEvidence, gather, read_record, read_time
from affordance.files.atomic import write_text
from affordance.files.bounded import check_size, read_text
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import (
    COLOUR_FORM,
    Colour,
    find_nearest_colour,
    is_colour,
    is_same_colour,
    parse_colour,
    show_colour,
)
from affordance.objects.inertia import Geometry
from affordance.plant.arm import name_robot
from affordance.plant.serial_chain import ArmOwner

# Largest file, about 200 000 trials, [bytes].
LARGEST_FILE = 1_000_000_000
# Longest time to wait while another process writes, [s].
_PATIENCE = 30.0
_SQLITE = b"SQLite format 3\x00"
_SHORTEST_ID = 4
# Largest number of materials and of objects in a memory. Run time grows with their squares.
MOST_MATERIALS, MOST_THINGS = 200, 5000


# Columns that SQLite extracts from the record.
_DERIVED = ", ".join(
    f"{name} TEXT NOT NULL AS (json_extract(content, '$.{name}')) STORED"
    for name in ("id", "time", "robot", "fingerprint", "object", "digest")
)
_DEFINITIONS = (
    f"CREATE TABLE trials (content TEXT NOT NULL, {_DERIVED})",
    "CREATE UNIQUE INDEX by_id ON trials (id)",
    "CREATE INDEX by_time ON trials (time, id)",
    "CREATE TABLE joins (colour TEXT NOT NULL, meant TEXT NOT NULL)",
)
# If a recording has two records, the earlier record is kept. Equal times are ordered by digest.
_INSERT = """INSERT INTO trials (content) VALUES (?) ON CONFLICT (id) DO UPDATE SET content = excluded.content
    WHERE excluded.time || excluded.digest < time || digest"""


class Selection(NamedTuple):
    """Conditions that a trial must meet to be selected; empty conditions are ignored.

    Attributes:
        robot: Name of the robot.
        object_name: Name of the object.
        since: Earliest time, inclusive, ISO 8601, in UTC unless it has an offset.
        until: Latest time, exclusive, in the same format.
        trial: First digits of the id of a trial, at least four.

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
        """Builds the SQL condition of the selection.

        Returns: Condition, which is empty if all trials are selected, and its values.

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


class Appended(NamedTuple):
    """Number of new trials, and number of records that an earlier record of the same recording replaced."""

    new: int
    replaced: int


@dataclass
class FeltThing:
    """Object that was felt, and a summary of its trials."""

    geometry: Geometry  # as seen in the first trial, with one column per density
    since: str  # time of the first trial
    trials: int = 0
    names: dict[str, None] = field(default_factory=dict)  # names of the object in trials, in order
    robots: set[str] = field(default_factory=set)

    def add(self, trial: TrialEvidence) -> None:
        """Adds a trial of the object."""
        self.trials += 1
        self.names[trial.object_name] = None
        self.robots.add(trial.robot)


class Experience(NamedTuple):
    """Memory after all trials, and the trials of each object."""

    memory: MaterialMemory
    things: tuple[FeltThing, ...]


class Ledger:
    """Lasting memory of evidence about felt objects; see ``open_memory``.

    Example:
        >>> from affordance import MODELS, Selection, TrialRunner, load_tools, open_memory
        >>> from affordance.extensions.memory.simulated_trial import describe_trial
        >>> rod, *_ = load_tools(MODELS / "tools" / "weight.yaml")
        >>> runner = TrialRunner()
        >>> record = runner.run_hold(rod, runner.start_memory(), duration=0.5, seed=1)
        >>> with open_memory("workshop.sqlite") as ledger:
        ...     ledger.append([describe_trial(record)])
        ...     ledger.forget(Selection(object_name=rod.name))
        1
        1
    """

    def __init__(self, place: Path | str, *, create: bool = True) -> None:
        """Opens the database and creates missing tables; see ``open_memory``."""
        self.place = _check_place(place, create=create)
        with self._translate("read"):
            self._connection = sqlite3.connect(self.place.absolute(), timeout=_PATIENCE, autocommit=True)
        self._reads, self._writes = partial(self._transact, writes=False), partial(self._transact, writes=True)
        try:
            self._set_up(create=create)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        """Returns the ledger."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        """Closes the ledger."""
        self.close()

    def __len__(self) -> int:
        """Returns the number of trials."""
        with self._reads():
            return self._count()

    def __contains__(self, trial_id: str) -> bool:
        """Returns True if the ledger contains a trial with this id."""
        with self._reads():
            return self._count(" WHERE id = ?", [trial_id]) > 0

    def __repr__(self) -> str:
        return f"Ledger({self.place}: {len(self)} trials)"

    def close(self) -> None:
        """Closes the database."""
        self._connection.close()

    def append(self, trials: Sequence[TrialEvidence]) -> int:
        """Adds trials to the ledger.

        If a recording is already in the ledger, only the earlier of the two records is kept.

        Args:
            trials: Evidence of the trials, in any order.

        Returns: Number of new trials.

        Raises:
            BadArgumentError: An argument is not the evidence of a trial; nothing was changed.
            BadValueError: The database cannot be written; nothing was changed.
        """
        return self.add(trials).new

    def add(self, trials: Sequence[TrialEvidence]) -> Appended:
        """Adds trials like ``append``, and returns the numbers of new trials and replaced records."""
        for i, trial in enumerate(check_kind("trials", trials, Sequence, "a list of TrialEvidence")):
            check_kind(f"trials[{i}]", trial, TrialEvidence)
        records = (json.dumps(trial.to_dict()) for trial in sorted(trials, key=lambda each: each.time + each.digest))
        with self._writes():
            known, changes = self._count(), self._connection.total_changes
            self._connection.executemany(_INSERT, ((record,) for record in records))
            new = self._count() - known
            return Appended(new, self._connection.total_changes - changes - new)

    def recall(self, learner: Learner | str = "density", prior: Prior = Prior(), *, seed: Seed = 0) -> MaterialMemory:
        """Computes a learner's belief after all trials. Joined colours are treated as one colour.

        Args:
            learner: Learner, or its name.
            prior: Prior of unknown materials.
            seed: Seed for learners that draw random numbers.

        Raises:
            BadArgumentError: An argument has the wrong type.
            BadValueError: The database cannot be read, or a record is invalid.
        """
        learner = check_learner("learner", learner)
        check_kind("prior", prior, Prior)
        if learner.is_exact:
            return self.review(prior, learner).memory
        memory = start_memory(learner, seed)
        for trial in self._read_joined():
            with self.blame(f"trial {trial.id}"):
                memory = replay([trial], memory, prior)
        return memory

    def review(self, prior: Prior = Prior(), learner: Learner = DENSITY) -> Experience:
        """Computes the belief of a learner with one density per colour, and summarises the trials of each object."""
        things: dict[int, FeltThing] = {}

        def describe(trial: TrialEvidence, seen: Seen, columns: Sequence[int]) -> Felt:
            with self.blame(f"trial {trial.id}"):
                thing, materials = int(seen.things[0]), max(seen.colours) + 1
                if materials > MOST_MATERIALS:
                    problem = f"are of {materials} materials, must be of at most {MOST_MATERIALS}"
                    raise BadArgumentError("colours", "", problem)
                if thing >= MOST_THINGS:
                    problem = f"are {thing + 1} different ones, must be at most {MOST_THINGS}"
                    raise BadArgumentError("objects", "", problem)
                geometry = gather(trial.geometry, columns)
                things.setdefault(thing, FeltThing(geometry, trial.time)).add(trial)
                return trial.describe(geometry)

        lifts = ((trial.parts, partial(describe, trial)) for trial in self._read_joined())
        with self.blame():
            return Experience(start_memory(learner).remember(lifts, prior), tuple(things.values()))

    def list_trials(self, selection: Selection = ALL) -> list[TrialEvidence]:
        """Lists the selected trials in chronological order, without replacing joined colours.

        Raises:
            BadArgumentError: A time of the selection is invalid, or the id of a trial is too short.
            BadValueError: The database cannot be read, or a record is invalid.
        """
        return list(self._read(selection))

    def list_names(self) -> tuple[list[str], list[str]]:
        """Lists the names of all robots and of all objects, in alphabetical order."""
        with self._reads():
            robots, objects = (
                [name for (name,) in self._connection.execute(f"SELECT DISTINCT {column} FROM trials ORDER BY 1")]
                for column in ("robot", "object")
            )
            return robots, objects

    def count_of_other_arms(self, robot: str, *fingerprints: str) -> int:
        """Counts the trials of a robot whose known fingerprint differs from all given fingerprints."""
        ours = ("", *fingerprints)
        with self._reads():
            condition = f" WHERE robot = ? AND fingerprint NOT IN ({','.join('?' * len(ours))})"
            return self._count(condition, [robot, *ours])

    def forget(self, selection: Selection) -> int:
        """Deletes the selected trials.

        Returns: Number of deleted trials.

        Raises:
            BadArgumentError: The selection is empty, a time is invalid, or the id of a trial is too short.
            BadValueError: The database cannot be written; nothing was changed.
        """
        if not any(check_kind("selection", selection, Selection)):
            raise BadArgumentError("selection", "", "is empty, must name a robot, an object, a time or a trial")
        condition, values = selection.narrow()
        with self._writes():
            return int(self._connection.execute(f"DELETE FROM trials{condition}", values).rowcount)

    def join(self, pairs: Sequence[tuple[Colour, Colour]]) -> None:
        """Declares pairs of colours to be equal, because two cameras see them differently.

        Earlier declarations are replaced. Records do not change: ``recall`` replaces the second colour of each pair
        by the first. Declarations are not copied to other memories, which may come from another camera.

        Raises:
            BadValueError: The colours of a pair are already equal, or no part in the memory has the second colour.
        """
        known = {show_colour(part.colour): part.colour for trial in self._read() for part in trial.parts}
        joins: dict[Colour, Colour] = {}
        for one, other in pairs:
            meant = joins.get(one, one)
            shown = f"{show_colour(one)}={show_colour(other)}"
            if is_same_colour(meant, other):
                raise BadValueError(
                    "join", "", f"is {shown}, which count as one colour, must be two different colours"
                )
            if find_colour_index(list(known.values()), other) is None:
                nearest = f"; the nearest is {find_nearest_colour(other, known)}" if known else ""
                raise BadValueError(self.place, "", f"has no part of the second colour of {shown}{nearest}")
            joins = {each: meant if found == other else found for each, found in joins.items()} | {other: meant}
        rows = [(show_colour(other), show_colour(meant)) for other, meant in joins.items()]
        with self._writes():
            self._connection.execute("DELETE FROM joins")
            self._connection.executemany("INSERT INTO joins VALUES (?, ?)", rows)

    def list_joins(self) -> list[tuple[str, str]]:
        """Lists pairs of a colour and its replacement, in hexadecimal."""
        with self._reads():
            rows = self._connection.execute("SELECT colour, meant FROM joins ORDER BY rowid").fetchall()
        if not all(is_colour(str(each)) for row in rows for each in row):
            raise BadValueError(self.place, "joins", f"has an invalid colour, {COLOUR_FORM}")
        return rows

    def verify(self) -> list[str]:
        """Checks the database and every record. Returns one line per fault."""
        with self._reads():
            (found,) = self._connection.execute("PRAGMA integrity_check(1)").fetchone()
        if found != "ok":
            return [f"{self.place}: the file is damaged: {found}"]
        faults = []
        for key, record in self._read_records():
            try:
                read_record(self.place, f"trial {key}", record)
            except BadValueError as error:
                faults.append(str(error))
        return faults

    @contextmanager
    def blame(self, key: str = "") -> Iterator[None]:
        """Converts numerical errors due to contradictory evidence to a BadValueError with memory and key."""
        try:
            with np.errstate(over="raise", divide="raise", invalid="raise"):
                yield
        except BadValueError:  # it already has a place
            raise
        except (np.linalg.LinAlgError, FloatingPointError, AffordanceError) as error:
            raise BadValueError(self.place, key, f"cannot be learned from: {error}") from error

    def _count(self, condition: str = "", values: Sequence[str] = ()) -> int:
        return int(self._connection.execute(f"SELECT count(*) FROM trials{condition}", values).fetchone()[0])

    def _read_records(self, selection: Selection = ALL) -> list[tuple[str, str]]:
        """Reads ids and records of the selected trials in chronological order."""
        condition, values = selection.narrow()
        with self._reads():
            query = f"SELECT id, content FROM trials{condition} ORDER BY time, id"
            return self._connection.execute(query, values).fetchall()

    def _read(self, selection: Selection = ALL) -> Iterator[TrialEvidence]:
        """Reads the selected trials in chronological order. An invalid record raises a BadValueError."""
        return (read_record(self.place, f"trial {key}", text) for key, text in self._read_records(selection))

    def _read_joined(self) -> Iterable[TrialEvidence]:
        """Reads all trials, and replaces joined colours."""
        joins = {parse_colour(colour): parse_colour(meant) for colour, meant in self.list_joins()}
        return map(partial(_join_colours, joins), self._read()) if joins else self._read()

    def _set_up(self, *, create: bool) -> None:
        """Creates the tables of a new database, limits its size, and rejects databases with other tables."""
        with self._reads():
            found = self._list_definitions()
            (page_size,) = self._connection.execute("PRAGMA page_size").fetchone()
        if not found:
            if not create:
                raise BadValueError(self.place, "", "is empty, must be a memory that a command has written")
            with self._writes():
                if not self._list_definitions():  # another process may have created the tables in the meantime
                    for definition in _DEFINITIONS:
                        self._connection.execute(definition)
        elif found != set(_DEFINITIONS):
            tables = (
                ", ".join(
                    sorted(
                        name
                        for (name,) in self._connection.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")
                    )
                )
                or "none"
            )
            problem = (
                f"is a database of another program or version (tables: {tables}), must be a memory of this program"
            )
            raise BadValueError(self.place, "", problem)
        self._connection.execute(f"PRAGMA max_page_count={LARGEST_FILE // page_size}")

    def _list_definitions(self) -> set[str]:
        return {sql for (sql,) in self._connection.execute("SELECT sql FROM sqlite_schema")}

    @contextmanager
    def _transact(self, *, writes: bool) -> Iterator[None]:
        """Runs one transaction. On failure, the database is unchanged and a BadValueError is raised.

        Transactions that write acquire the lock at their start, because SQLite does not wait for a lock later.
        """
        with self._translate("written" if writes else "read"):
            self._connection.execute("BEGIN IMMEDIATE" if writes else "BEGIN")
            try:
                yield
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:  # SQLite ends the transaction itself if the disk is full
                    self._connection.execute("ROLLBACK")
                raise

    @contextmanager
    def _translate(self, what: str) -> Iterator[None]:
        """Converts database errors to a BadValueError."""
        try:
            yield
        except (sqlite3.Error, UnicodeDecodeError) as error:
            raise BadValueError(self.place, "", f"cannot be {what}: {error}; nothing was changed") from error


def open_memory(place: str | Path, *, create: bool = True) -> Ledger:
    """Opens a lasting memory, which is a ledger of evidence about felt objects.

    Args:
        place: Path of an SQLite file.
        create: True to create the file if it does not exist.

    Raises:
        BadArgumentError: The place is neither a path nor a string.
        BadValueError: The file does not exist, is not a memory, or was written by another version.
    """
    return Ledger(place, create=create)


def has_memory(place: str | Path) -> bool:
    """Returns True if a file is a memory, and False if it does not exist.

    Raises:
        BadValueError: The file is not a memory, or its folder does not exist.
    """
    return _check_place(place, create=True).exists()


def export_trials(ledger: Ledger, path: Path) -> int:
    """Writes the records of all trials to a file, one per line, and returns their number."""
    lines = [json.dumps(trial.to_dict()) for trial in ledger.list_trials()]
    write_text(path, "".join(f"{line}\n" for line in lines))
    return len(lines)


def import_trials(path: Path) -> list[TrialEvidence]:
    """Reads trials from a file that ``export_trials`` wrote. Any other file raises a BadValueError."""
    lines = enumerate(read_text(path, LARGEST_FILE).split("\n"), 1)
    return [read_record(path, f"line {number}", line) for number, line in lines if line]


def replay(trials: Sequence[TrialEvidence], memory: MaterialMemory, prior: Prior) -> MaterialMemory:
    """Updates a memory with trials, one after the other."""
    for trial in trials:
        recollection = memory.recall(trial.parts, prior)
        felt = trial.describe(gather(trial.geometry, recollection.columns))
        memory = recollection.memory.learn(felt, prior.deviation).memory
    return memory


def count_past_arms(place: str, robot: str, recognise: Callable[[], str]) -> int:
    """Counts the trials in which a robot of this name had another arm.

    Args:
        place: Path of the memory; if it does not exist, the count is 0.
        robot: Name of the robot.
        recognise: Function that computes the fingerprint of the present arm. It is called only if necessary.
    """
    if not (place and has_memory(place)):
        return 0
    with open_memory(place, create=False) as ledger:
        return ledger.count_of_other_arms(robot, recognise()) if ledger.count_of_other_arms(robot) else 0


def count_of(robot: ArmOwner, place: str | None) -> int:
    """Counts the trials in a memory in which a robot of this name had another arm; 0 without a memory."""
    return count_past_arms(place or "", name_robot(robot.directives), lambda: robot.chain.fingerprint)


def describe_past_arms(robot: str, number: int) -> str:
    """Describes the number of trials with another arm, or returns an empty string if there are none."""
    return f"{robot} had another arm in {number} of its trials, which still count for materials" if number else ""


def _check_place(place: Path | str, *, create: bool) -> Path:
    """Returns the path of a memory. Rejects other files and files that cannot be created."""
    if not isinstance(place, str | Path) or not str(place):
        raise BadArgumentError("place", "", f"is {place!r}, must be the path of an SQLite file")
    path = Path(place)
    if not path.exists():
        if not create:
            raise BadValueError(path, "", "does not exist, must be a memory that a command has written")
        if not path.parent.is_dir():
            raise BadValueError(path, "", f"cannot be created: there is no folder {str(path.parent)!r}")
        return path
    check_size(path, LARGEST_FILE)
    if path.is_dir():
        raise BadValueError(path, "", "is a folder, must be a file")
    with path.open("rb") as file:
        begin = file.read(len(_SQLITE))
    if begin not in (b"", _SQLITE):
        hint = "affordance memory import reads an exported one"
        problem = f"is not an SQLite file, must be a memory that a command has written; {hint}"
        raise BadValueError(path, "", problem)
    return path


def _join_colours(joins: dict[Colour, Colour], trial: TrialEvidence) -> TrialEvidence:
    """Replaces the colours of a trial's parts by the joined colours."""
    colours = [*joins, *joins.values()]

    def translate(part: PartAppearance) -> PartAppearance:
        index = find_material(part, colours)
        return part if index is None else part._replace(colour=joins.get(colours[index], part.colour))

    return replace(trial, parts=tuple(map(translate, trial.parts)))
