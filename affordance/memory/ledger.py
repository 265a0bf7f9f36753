"""Ledger of evidence: what robots have felt, one record a trial, and the beliefs that follow from it.

Trials are added and never changed. Beliefs are recalled from them in the order of their times, whatever the order in
which they were added: for learners with kinds by replaying all trials, for learners with one density for each colour
from sums over all trials.
"""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from affordance.arguments import Seed, check_kind
from affordance.belief.density_belief import Prior
from affordance.belief.learner import Learner, check_learner
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.exceptions import AffordanceError, BadArgumentError, BadValueError
from affordance.memory.evidence_sums import EvidenceSums, gather
from affordance.memory.kept_sums import WORTH_KEEPING, KeptSums, load_sums, save_sums
from affordance.memory.same_colours import SameColours, translate
from affordance.memory.stored_trials import (
    ALL,
    Appended,
    Selection,
    check_trials,
    delete_trials,
    find_known,
    get_precedence,
    insert_trials,
    read_row,
    read_rows,
    read_trials,
)
from affordance.memory.tables import check_file, check_integrity, check_place, open_database, transact
from affordance.memory.trial_evidence import TrialEvidence
from affordance.proprioception.fixed_point import find_fixed_point


class Ledger:
    """Lasting memory of what robots have felt; see ``open_memory``."""

    def __init__(self, place: Path | str, *, create: bool = True) -> None:
        """Opens the database; see ``open_memory``."""
        self.place = check_place(place)
        self._connection = open_database(self.place, create=create)
        self._reads = partial(transact, self._connection, self.place, writes=False)
        self._writes = partial(transact, self._connection, self.place, writes=True)

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
        with self._reads():
            return int(self._connection.execute("SELECT count(*) FROM trials").fetchone()[0])

    def __contains__(self, trial_id: str) -> bool:
        """Returns True if a trial with this id was appended."""
        with self._reads():
            return bool(find_known(self._connection, [trial_id]))

    def __repr__(self) -> str:
        return f"Ledger({self.place}: {len(self)} trials)"

    def close(self) -> None:
        """Closes the database."""
        self._connection.close()

    def append(self, trials: Sequence[TrialEvidence]) -> int:
        """Adds trials, all or none; trials that it has already are skipped.

        Args:
            trials: Evidence of the trials, in any order.

        Returns: Number of trials that were new.

        Raises:
            BadArgumentError: An argument is not evidence of a trial, or too large.
            BadValueError: The database cannot be written; nothing was changed.
        """
        return self.add(trials).new

    def add(self, trials: Sequence[TrialEvidence]) -> Appended:
        """Appends trials, and counts also the records that an earlier one replaced; see ``append``."""
        for i, trial in enumerate(check_kind("trials", trials, Sequence, "a list of TrialEvidence")):
            check_kind(f"trials[{i}]", trial, TrialEvidence)
        unique = {trial.id: trial for trial in sorted(trials, key=get_precedence, reverse=True)}
        with self._writes():
            known = find_known(self._connection, list(unique))
            new = [each for key, each in unique.items() if key not in known]
            earlier = [each for key, each in unique.items() if key in known and get_precedence(each) < known[key]]
            delete_trials(self._connection, [each.id for each in earlier])
            insert_trials(self._connection, sorted([*new, *earlier], key=get_precedence))
        return Appended(len(new), len(earlier))

    def recall(
        self,
        learner: Learner | str = "density",
        prior: Prior = Prior(),
        *,
        seed: Seed = 0,
        same_colours: SameColours = (),
    ) -> MaterialMemory:
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
        learner = check_learner("learner", learner)
        check_kind("prior", prior, Prior)
        if learner.name == "density":
            sums = self.sum(prior, same_colours)
            with blame(self.place):
                return MaterialMemory.from_belief(sums.colours, sums.build_belief())
        memory = start_memory(learner, seed)
        with self._read(same_colours) as trials:
            for trial in trials:
                with blame(self.place, f"trial {trial.id}"):
                    memory = replay([trial], memory, prior)
        return memory

    def sum(self, prior: Prior = Prior(), same_colours: SameColours = ()) -> EvidenceSums:
        """Sums the evidence of all trials; see ``recall``."""
        if same_colours:
            return self._add(EvidenceSums(prior), translate(self.list_trials(), same_colours, self.place))
        kept = load_sums(self.place, prior) if len(self) >= WORTH_KEEPING else None
        with self._reads():
            return self._sum_rows(kept, prior)

    def list_trials(self, selection: Selection = ALL) -> list[TrialEvidence]:
        """Lists trials in the order of their times, those of a selection or all.

        Raises:
            BadArgumentError: A time of the selection is invalid, or the id of a trial is too short.
            BadValueError: The database cannot be read, or a record is invalid.
        """
        with self._reads():
            return list(read_trials(self._connection, self.place, selection))

    def list_names(self) -> tuple[list[str], list[str]]:
        """Lists the names of robots and of objects."""
        with self._reads():
            robots, objects = (
                [
                    str(name)
                    for (name,) in self._connection.execute(f"SELECT DISTINCT {column} FROM trials ORDER BY 1")
                ]
                for column in ("robot", "object")
            )
            return robots, objects

    def count_of_other_arms(self, robot: str, *fingerprints: str) -> int:
        """Counts the trials of a robot of this name with an arm that is known, and of none of these fingerprints."""
        ours = ("", *fingerprints)
        query = f"SELECT count(*) FROM trials WHERE robot = ? AND fingerprint NOT IN ({','.join('?' * len(ours))})"
        with self._reads():
            return int(self._connection.execute(query, (robot, *ours)).fetchone()[0])

    def forget(self, selection: Selection) -> int:
        """Forgets trials, as if they had never been appended.

        Returns: Number of trials that were forgotten.

        Raises:
            BadArgumentError: The selection is empty, a time is invalid, or the id of a trial is too short.
            BadValueError: The database cannot be written; nothing was changed.
        """
        if not any(check_kind("selection", selection, Selection)):
            raise BadArgumentError("selection", "", "is empty, must name a robot, an object, a time or a trial")
        condition, values = selection.narrow()
        with self._writes():
            return int(self._connection.execute(f"DELETE FROM trials{condition}", values).rowcount)

    def merge(self, other: "Ledger") -> int:
        """Adds the trials of another ledger that this one does not know; returns their number.

        Raises:
            BadValueError: A database cannot be read or written, or a record is invalid; nothing was changed.
        """
        return self.append(other.list_trials())

    def verify(self) -> list[str]:
        """Checks the database and every record; returns what is wrong, a line each."""
        with self._reads():
            if problem := check_integrity(self._connection):
                return [f"{self.place}: the file is damaged: {problem}"]
            return check_trials(self._connection, self.place)

    def _sum_rows(self, kept: KeptSums | None, prior: Prior) -> EvidenceSums:
        """Sums the evidence of all trials; begins with the sums that are kept if they are of the first trials."""
        digest = hashlib.sha256()
        rows = read_rows(self._connection, self.place)
        if kept is not None:
            for row in islice(rows, kept.number):
                digest.update(repr(row).encode())
            if digest.hexdigest() != kept.digest:
                return self._sum_rows(None, prior)
        first = number = kept.number if kept else 0

        def read() -> Iterator[TrialEvidence]:
            nonlocal number
            for row in rows:
                digest.update(repr(row).encode())
                yield read_row(self.place, row)
                number += 1

        sums = self._add(kept.sums if kept else EvidenceSums(prior), read())
        if number - first >= WORTH_KEEPING:
            save_sums(self.place, KeptSums(number, digest.hexdigest(), sums))
        return sums

    def _add(self, sums: EvidenceSums, trials: Iterable[TrialEvidence]) -> EvidenceSums:
        """Adds trials to sums; evidence that fits no densities raises a BadValueError."""
        for trial in trials:
            with blame(self.place, f"trial {trial.id}"):
                sums.add(trial)
        for name, thing in sums.things.items():
            with blame(self.place, f"object {name}"):
                thing.compute_likelihood(sums.prior)
        return sums

    @contextmanager
    def _read(self, same_colours: SameColours) -> Iterator[Iterable[TrialEvidence]]:
        """Reads all trials within the context, in the order of their times, and translates the colours of pairs."""
        if same_colours:
            yield translate(self.list_trials(), same_colours, self.place)
        else:
            with self._reads():
                yield read_trials(self._connection, self.place)


def open_memory(place: str | Path, *, create: bool = True) -> Ledger:
    """Opens a lasting memory: the ledger of what robots have felt.

    Args:
        place: Path of an SQLite file.
        create: True to create a file that does not exist.

    Raises:
        BadArgumentError: The place is neither a path nor a text.
        BadValueError: The file does not exist, is not a memory, or was written by another version.
    """
    return Ledger(place, create=create)


def has_memory(place: str | Path) -> bool:
    """Returns True for a file with a memory; another file, or no folder, raises a BadValueError."""
    path = check_place(place)
    check_file(path, create=True)
    return path.exists()


def replay(trials: Sequence[TrialEvidence], memory: MaterialMemory, prior: Prior) -> MaterialMemory:
    """Replays trials for a learner, one after the other, from a memory at the start."""
    for trial in trials:
        recollection = memory.recall(trial.parts, prior)
        geometry = gather(trial.geometry, recollection.columns, recollection.densities.size)
        compute = partial(trial.compute_likelihood, geometry)
        find_likelihood = partial(find_fixed_point, compute_likelihood=compute)
        memory = recollection.memory.learn(find_likelihood, prior.deviation).memory
    return memory


@contextmanager
def blame(place: Path, key: str = "") -> Iterator[None]:
    """Converts failures of evidence that fits no densities to a BadValueError that names the memory and its trial."""
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except (np.linalg.LinAlgError, FloatingPointError, AffordanceError) as error:
        raise BadValueError(place, key, f"cannot be learned from: {error}") from error
