"""Ledger of evidence: one record per trial in which a robot felt an object, and the beliefs that follow.

Trials are added and never changed. Beliefs are recomputed from them in the order of their times, regardless of the
order in which they were added: learners with kinds replay all trials, learners with one density per colour use sums
over all trials.
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
from affordance.belief.learner import Learner
from affordance.belief.learners import check_learner
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.exceptions import AffordanceError, BadArgumentError, BadValueError
from affordance.extensions.memory.evidence_sums import EvidenceSums, gather
from affordance.extensions.memory.kept_sums import WORTH_KEEPING, KeptSums, load_sums, save_sums
from affordance.extensions.memory.same_colours import SameColours, translate
from affordance.extensions.memory.stored_trials import (
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
from affordance.extensions.memory.tables import check_file, check_integrity, check_place, open_database, transact
from affordance.extensions.memory.trial_evidence import TrialEvidence
from affordance.proprioception.fixed_point import find_fixed_point


class Ledger:
    """Lasting memory of evidence about objects that robots have felt; see ``open_memory``.

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
        """Returns True if the ledger contains a trial with this id."""
        with self._reads():
            return bool(find_known(self._connection, [trial_id]))

    def __repr__(self) -> str:
        return f"Ledger({self.place}: {len(self)} trials)"

    def close(self) -> None:
        """Closes the database."""
        self._connection.close()

    def append(self, trials: Sequence[TrialEvidence]) -> int:
        """Adds all trials or, if one is invalid, none.

        A trial that the ledger already has is skipped, unless the new record of it is the earlier one, which replaces
        the stored record.

        Args:
            trials: Evidence of the trials, in any order.

        Returns: Number of trials that were new.

        Raises:
            BadArgumentError: An argument is not the evidence of a trial, or is too large.
            BadValueError: The database cannot be written; nothing was changed.
        """
        return self.add(trials).new

    def add(self, trials: Sequence[TrialEvidence]) -> Appended:
        """Adds trials like ``append``; returns the numbers of new trials and of replaced records."""
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
        """Computes what a learner believes after all trials.

        Args:
            learner: Learner, or its name.
            prior: Prior of materials that were never felt.
            seed: Seed of the learner's random draws, if it makes any.
            same_colours: Pairs of colours to treat as one, because two cameras see them differently. The second of
                each, which must be in the memory, is read as the first.

        Raises:
            BadArgumentError: An argument has the wrong type.
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
        """Lists the selected trials, or all, in the order of their times.

        Raises:
            BadArgumentError: A time of the selection is invalid, or the id of a trial is too short.
            BadValueError: The database cannot be read, or a record is invalid.
        """
        with self._reads():
            return list(read_trials(self._connection, self.place, selection))

    def list_names(self) -> tuple[list[str], list[str]]:
        """Lists the names of all robots and of all objects."""
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
        """Counts a robot's trials whose arm is known and has none of the given fingerprints."""
        ours = ("", *fingerprints)
        query = f"SELECT count(*) FROM trials WHERE robot = ? AND fingerprint NOT IN ({','.join('?' * len(ours))})"
        with self._reads():
            return int(self._connection.execute(query, (robot, *ours)).fetchone()[0])

    def forget(self, selection: Selection) -> int:
        """Deletes trials, as if they had never been added.

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

    def merge(self, other: "Ledger") -> int:
        """Adds the trials of another ledger that this one does not have; returns their number.

        Raises:
            BadValueError: A database cannot be read or written, or a record is invalid; nothing was changed.
        """
        return self.append(other.list_trials())

    def verify(self) -> list[str]:
        """Checks the database and every record; returns one line per fault."""
        with self._reads():
            if problem := check_integrity(self._connection):
                return [f"{self.place}: the file is damaged: {problem}"]
            return check_trials(self._connection, self.place)

    def _sum_rows(self, kept: KeptSums | None, prior: Prior) -> EvidenceSums:
        """Sums the evidence of all trials, starting from the cached sums if they cover the first trials."""
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
        """Adds trials to sums; raises a BadValueError for evidence that no densities fit."""
        for trial in trials:
            with blame(self.place, f"trial {trial.id}"):
                sums.add(trial)
        for name, thing in sums.things.items():
            with blame(self.place, f"object {name}"):
                thing.compute_likelihood(sums.prior)
        return sums

    @contextmanager
    def _read(self, same_colours: SameColours) -> Iterator[Iterable[TrialEvidence]]:
        """Context with all trials in the order of their times, in which pairs of colours are translated."""
        if same_colours:
            yield translate(self.list_trials(), same_colours, self.place)
        else:
            with self._reads():
                yield read_trials(self._connection, self.place)


def open_memory(place: str | Path, *, create: bool = True) -> Ledger:
    """Opens a lasting memory: the ledger of evidence about objects that robots have felt.

    Args:
        place: Path of an SQLite file.
        create: Whether to create the file if it does not exist.

    Raises:
        BadArgumentError: The place is neither a path nor a string.
        BadValueError: The file does not exist, is not a memory, or was written by another version.
    """
    return Ledger(place, create=create)


def has_memory(place: str | Path) -> bool:
    """Returns True if a file is a memory, and False if it does not exist.

    Raises:
        BadValueError: If it is another file, or in a folder that does not exist.
    """
    path = check_place(place)
    check_file(path, create=True)
    return path.exists()


def replay(trials: Sequence[TrialEvidence], memory: MaterialMemory, prior: Prior) -> MaterialMemory:
    """Lets a learner, whose belief is in ``memory``, learn from trials one after the other."""
    for trial in trials:
        recollection = memory.recall(trial.parts, prior)
        geometry = gather(trial.geometry, recollection.columns, recollection.densities.size)
        compute = partial(trial.compute_likelihood, geometry)
        find_likelihood = partial(find_fixed_point, compute_likelihood=compute)
        memory = recollection.memory.learn(find_likelihood, prior.deviation).memory
    return memory


@contextmanager
def blame(place: Path, key: str = "") -> Iterator[None]:
    """Converts numerical errors, from evidence that no densities fit, to a BadValueError with memory and trial."""
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except (np.linalg.LinAlgError, FloatingPointError, AffordanceError) as error:
        raise BadValueError(place, key, f"cannot be learned from: {error}") from error
