"""Ledger of evidence: what robots have felt, one record a trial, and the beliefs that follow from it.

Trials are added and never changed. Beliefs are recalled from them in the order of their times, whatever the order in
which they were added: for learners with kinds by replaying all trials, for learners with one density for each colour
from sums that are kept with the trials.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

from sqlalchemy import Connection, func, select

from affordance.arguments import Seed, check_kind, check_member
from affordance.belief.density_belief import Prior
from affordance.belief.kind_memory import start_memory
from affordance.belief.learner import Learner
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.exceptions import BadArgumentError, BadValueError, hide_password
from affordance.memory.evidence_sums import MaterialSum, gather, sum_objects
from affordance.memory.kept_sums import DamagedSumsError, KeptSums, drop_sums, find_wrong, name_prior, read_sums
from affordance.memory.same_colours import SameColours, translate
from affordance.memory.stored_trials import (
    ALL,
    Appended,
    Looks,
    Selection,
    check_trials,
    delete_trials,
    find_known,
    get_order,
    get_precedence,
    insert_trials,
    list_things,
    name_thing,
    name_things,
    read_selected,
    read_thing,
)
from affordance.memory.tables import TRIALS, check_file, check_integrity, connect, find_file, open_database
from affordance.memory.trial_evidence import TrialEvidence
from affordance.proprioception.fixed_point import find_fixed_point


class Ledger:
    """Lasting memory of what robots have felt; see ``open_memory``."""

    def __init__(self, place: Path | str, *, create: bool = True) -> None:
        """Opens the database; see ``open_memory``."""
        self._engine = open_database(place, create=create)
        self.place = hide_password(place) if isinstance(place, str) else place

    def __enter__(self) -> Self:
        """Returns the ledger, which is closed at the end of the block."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        """Closes the ledger."""
        self.close()

    def __len__(self) -> int:
        """Returns the number of trials."""
        with connect(self._engine, self.place, writes=False) as connection:
            return int(connection.execute(select(func.count()).select_from(TRIALS)).scalar_one())

    def __contains__(self, trial_id: str) -> bool:
        """Returns True if a trial with this id was appended."""
        with connect(self._engine, self.place, writes=False) as connection:
            return bool(find_known(connection, [trial_id]))

    def __repr__(self) -> str:
        return f"Ledger({self.place}: {len(self)} trials)"

    def close(self) -> None:
        """Closes all connections to the database."""
        self._engine.dispose()

    def append(self, trials: Sequence[TrialEvidence]) -> int:
        """Adds trials, all or none; trials that it has already are skipped.

        Args:
            trials: Evidence of the trials, in any order.

        Returns: Number of trials that were new.

        Raises:
            BadArgumentError: An argument is not evidence of a trial.
            BadValueError: The database cannot be written; nothing was changed.
        """
        return self.add(trials).new

    def add(self, trials: Sequence[TrialEvidence]) -> Appended:
        """Appends trials, and counts also the records that an earlier one replaced; see ``append``."""
        for i, trial in enumerate(trials):
            check_kind(f"trials[{i}]", trial, TrialEvidence)
        unique = {trial.id: trial for trial in sorted(trials, key=get_precedence, reverse=True)}
        with connect(self._engine, self.place, writes=True) as connection:
            known = find_known(connection, list(unique))
            precede = [each for key, each in unique.items() if key in known and get_precedence(each) < known[key]]
            new = sorted([*precede, *(each for key, each in unique.items() if key not in known)], key=get_order)
            if not new:
                return Appended(0, 0)
            names = delete_trials(connection, [each.id for each in precede])
            things, is_settled, unsettled = insert_trials(connection, new, self.place)
            for name in sorted(names | unsettled):
                name_things(connection, name, self.place)
            if precede or not is_settled:  # it changes which colours and looks were met first
                drop_sums(connection)
            else:
                self._add_to_sums(connection, things, new)
            return Appended(len(new) - len(precede), len(precede))

    def recall(
        self,
        learner: Learner | str = Learner.DENSITY,
        prior: Prior = Prior(),
        *,
        seed: Seed = 0,
        same_colours: SameColours = (),
    ) -> Memory:
        """Recalls what a learner believes after all trials.

        Args:
            learner: Learner, or its name.
            prior: Prior of materials that were never felt.
            seed: Seed of the learner's random draws, if it makes any.
            same_colours: Pairs of colours that two cameras see differently; of each, the second, which must be in the
                memory, is read as the first.

        Raises:
            BadArgumentError: An argument is of the wrong kind.
            BadValueError: The database cannot be read, a record is invalid, or no part has a pair's second colour.
        """
        learner = check_member("learner", learner, Learner)
        check_kind("prior", prior, Prior)
        if learner is not Learner.DENSITY:
            trials = translate(self.list_trials(), same_colours, self.place)
            return replay(trials, start_memory(learner, seed), prior)
        if same_colours:
            return _build_memory(self._sum(prior, same_colours))
        with connect(self._engine, self.place, writes=False) as connection, suppress(DamagedSumsError):
            if sums := read_sums(connection, name_prior(prior)):
                return _build_memory(sums[name_prior(prior)].materials)
        return _build_memory(self._keep_sums(prior))

    def list_trials(self, selection: Selection = ALL) -> list[TrialEvidence]:
        """Lists trials in the order of their times, those of a selection or all.

        Raises:
            BadArgumentError: A time of the selection is invalid, or the id of a trial is too short.
            BadValueError: The database cannot be read, or a record is invalid.
        """
        with connect(self._engine, self.place, writes=False) as connection:
            return list(read_selected(connection, selection, self.place))

    def list_things(self) -> dict[str, int]:
        """Lists the things that were felt, in the order in which they were first met, with the number of trials."""
        with connect(self._engine, self.place, writes=False) as connection:
            return list_things(connection)

    def list_thing_trials(self, thing: str) -> list[TrialEvidence]:
        """Lists the trials of a thing in the order of their times."""
        with connect(self._engine, self.place, writes=False) as connection:
            return read_thing(connection, thing, self.place)

    def walk_things(self, same_colours: SameColours = ()) -> Iterator[tuple[str, list[TrialEvidence]]]:
        """Yields each thing, in the order in which they were first met, with its trials in the order of their times.

        Arguments and errors are those of ``recall``.
        """
        if not same_colours:
            yield from ((thing, self.list_thing_trials(thing)) for thing in self.list_things())
            return
        looks: Looks = {}
        things: dict[str, list[TrialEvidence]] = {}
        for trial in translate(self.list_trials(), same_colours, self.place):
            things.setdefault(name_thing(looks, trial), []).append(trial)
        yield from things.items()

    def count_of_other_arms(self, robot: str, *fingerprints: str) -> int:
        """Counts the trials of a robot of this name with an arm that is known, and of none of these fingerprints."""
        with connect(self._engine, self.place, writes=False) as connection:
            query = select(func.count()).select_from(TRIALS).where(TRIALS.c.robot == robot)
            changed = query.where(TRIALS.c.fingerprint.not_in(("", *fingerprints)))
            return int(connection.execute(changed).scalar_one())

    def forget(self, selection: Selection) -> int:
        """Forgets trials, as if they had never been appended.

        Returns: Number of trials that were forgotten.

        Raises:
            BadArgumentError: The selection is empty, a time is invalid, or the id of a trial is too short.
            BadValueError: The database cannot be written; nothing was changed.
        """
        if not any(selection):
            raise BadArgumentError("selection", "", "is empty, must name a robot, an object, a time or a trial")
        with connect(self._engine, self.place, writes=True) as connection:
            query = selection.narrow(select(TRIALS.c.id, TRIALS.c.object, TRIALS.c.thing))
            rows = connection.execute(query).all()
            forgotten = [str(row.id) for row in rows]
            for name in sorted(delete_trials(connection, forgotten)):
                name_things(connection, name, self.place)
            try:
                kept = list(read_sums(connection).values())
                # Without the first trial of a colour or a thing, colours and looks are distinguished anew.
                if any(sums.was_founded_by(connection, forgotten) for sums in kept):
                    drop_sums(connection)
                elif forgotten:
                    for sums in kept:
                        sums.renew(connection, sorted({str(row.thing) for row in rows}), self.place)
                        sums.write(connection)
            except DamagedSumsError:
                drop_sums(connection)
        return len(forgotten)

    def merge(self, other: "Ledger") -> int:
        """Adds the trials of another ledger that this one does not know; returns their number.

        Raises:
            BadValueError: A database cannot be read or written, or a record is invalid; nothing was changed.
        """
        return self.append(other.list_trials())

    def verify(self) -> list[str]:
        """Checks the database, every record, and the sums that are kept; returns what is wrong, a line each.

        Sums that are wrong are dropped, if the database can be written, and computed anew when they are needed.
        """
        with connect(self._engine, self.place, writes=False) as connection:
            if problem := check_integrity(connection):
                return [f"{self.place}: the file is damaged: {problem}"]
            faults, trials = check_trials(connection, self.place)
            wrong = find_wrong(connection, None if faults else trials)
        faults += [
            f"{self.place}: the sums for the prior {name} {problem}; they are dropped, and computed anew when needed"
            for name, problem in wrong.items()
        ]
        if wrong:
            with suppress(BadValueError), connect(self._engine, self.place, writes=True) as connection:
                for name in wrong:
                    drop_sums(connection, name)
        return faults

    def _sum(self, prior: Prior, same_colours: SameColours = ()) -> MaterialSum:
        """Sums all trials."""
        return sum_objects((trials for _, trials in self.walk_things(same_colours)), prior)

    def _add_to_sums(self, connection: Connection, things: Sequence[str], trials: Sequence[TrialEvidence]) -> None:
        """Adds new trials, the thing of each given, to all sums that are kept."""
        groups: dict[str, list[TrialEvidence]] = {}
        for thing, trial in zip(things, trials, strict=True):
            groups.setdefault(thing, []).append(trial)
        try:
            for sums in read_sums(connection).values():
                for thing, group in groups.items():
                    sums.add(connection, thing, group)
                sums.write(connection)
        except DamagedSumsError:
            drop_sums(connection)

    def _keep_sums(self, prior: Prior) -> MaterialSum:
        """Sums all trials for a prior, and keeps the sums if the database can be written."""
        with suppress(BadValueError), connect(self._engine, self.place, writes=True) as connection:
            drop_sums(connection, name_prior(prior))
            sums = KeptSums(MaterialSum(prior))
            for thing in list_things(connection):
                sums.add(connection, thing, read_thing(connection, thing, self.place))
            sums.write(connection)
            return sums.materials
        return self._sum(prior)


def open_memory(place: str | Path, *, create: bool = True) -> Ledger:
    """Opens a lasting memory: the ledger of what robots have felt.

    Args:
        place: Path of an SQLite file, or URL of a database (SQLAlchemy's, with its driver installed).
        create: True to create a file that does not exist.

    Raises:
        BadArgumentError: The place is neither a path nor a text.
        BadValueError: The file does not exist, is not a database, or belongs to another program or version.
    """
    if not isinstance(place, str | Path) or not str(place):
        raise BadArgumentError("place", "", f"is {place!r}, must be a path or the URL of a database")
    return Ledger(str(place) if "://" in str(place) else Path(place), create=create)


def has_memory(place: str | Path) -> bool:
    """Returns True for a file with a memory, or a server; another file, or no folder, raises a BadValueError."""
    if (path := find_file(place)) is None:
        return True
    check_file(path, create=True)
    return path.exists()


def replay(trials: Sequence[TrialEvidence], memory: Memory, prior: Prior) -> Memory:
    """Replays trials for a learner, one after the other, from a memory at the start."""
    for trial in trials:
        recollection = memory.recall(trial.parts, prior)
        geometry = gather(trial.geometry, recollection.columns, recollection.densities.size)
        compute = partial(trial.compute_likelihood, geometry)
        find_likelihood = partial(find_fixed_point, compute_likelihood=compute)
        memory = recollection.memory.learn(recollection.densities, find_likelihood, prior.deviation_sd).memory
    return memory


def _build_memory(materials: MaterialSum) -> MaterialMemory:
    return MaterialMemory(materials.colours, materials.build_belief())
