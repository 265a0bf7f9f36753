"""Sums of evidence over the trials of a ledger, stored with them so that a belief is recalled at once.

They can be computed anew at any time. All changes are made in the transaction that changes the trials.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection, delete, insert, select

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.belief.likelihood import Quadratic
from affordance.files.atomic import to_plain
from affordance.memory.evidence_sums import MaterialSum, ObjectSum
from affordance.memory.stored_trials import list_things, read_thing
from affordance.memory.tables import MATERIALS, THINGS
from affordance.memory.trial_evidence import TrialEvidence
from affordance.objects.inertia import NUM_PARAMETERS, Geometry

# Relative error that sums may have: they are sums of doubles, in another order.
_ROUNDING = 1e-9


class DamagedSumsError(ValueError):
    """Sums that are kept are not what was written, or are missing; they must be computed anew."""


class KeptSums:
    """Sums for one prior, as they are kept in a ledger, and the ids of the trials in which colours were first met."""

    def __init__(self, materials: MaterialSum, founders: Sequence[str] = ()) -> None:
        """Takes the sums."""
        self.materials = materials
        self.founders = list(founders)

    @property
    def prior(self) -> Prior:
        """Prior of materials that were never felt."""
        return self.materials.prior

    def add(self, connection: Connection, thing: str, trials: Sequence[TrialEvidence]) -> None:
        """Adds trials of a thing, later than all others, to the sums of the thing and of its materials."""
        row = connection.execute(select(THINGS.c.content).where(*self._match(thing))).scalar()
        if row is None:
            if list_things(connection, thing)[thing] > len(trials):
                raise DamagedSumsError(thing)
            of_object, founder = ObjectSum.start(trials[0], self.meet(trials[0])), trials[0].id
        else:
            of_object, founder = _unpack(content := _unseal(row)), content["founder"]
            self.materials.add(of_object, -1.0)
            connection.execute(delete(THINGS).where(*self._match(thing)))
        for trial in trials:
            of_object = of_object.add(trial, self.prior)
        self.materials.add(of_object)
        self._write_thing(connection, thing, of_object, founder)

    def was_founded_by(self, connection: Connection, ids: Iterable[str]) -> bool:
        """Returns True if a colour or a thing was first met in one of the given trials."""
        query = select(THINGS.c.founder).where(THINGS.c.prior == name_prior(self.prior))
        return not set(ids).isdisjoint({*self.founders, *connection.execute(query).scalars()})

    def renew(self, connection: Connection, things: Iterable[str], place: Path | str) -> None:
        """Sums the evidence anew for things of which trials were forgotten, and then for all materials."""
        for thing in things:
            trials = read_thing(connection, thing, place)
            columns = self.materials.recognise(trials[0].parts)
            of_object = ObjectSum.of(trials, columns, self.prior)
            connection.execute(delete(THINGS).where(*self._match(thing)))
            self._write_thing(connection, thing, of_object, trials[0].id)
        self.materials = MaterialSum(self.prior, self.materials.colours)
        kept = self.read_things(connection)
        for thing in list_things(connection):
            if thing not in kept:
                raise DamagedSumsError(thing)
            self.materials.add(kept[thing])

    def read_things(self, connection: Connection) -> dict[str, ObjectSum]:
        """Reads the sum of each thing; damaged ones raise a DamagedSumsError."""
        query = select(THINGS).where(THINGS.c.prior == name_prior(self.prior))
        return {row.thing: _unpack(_unseal(row.content)) for row in connection.execute(query)}

    def is_of(self, connection: Connection, trials: Mapping[str, Sequence[TrialEvidence]]) -> bool:
        """Returns True if the sums are those of the trials of each thing, up to rounding."""
        kept, wanted = self.read_things(connection), KeptSums(MaterialSum(self.prior))
        if kept.keys() != trials.keys():
            return False
        for thing, group in trials.items():
            of_object = ObjectSum.of(group, wanted.meet(group[0]), self.prior)
            wanted.materials.add(of_object)
            if kept[thing].columns != of_object.columns:
                return False
            if not all(map(_is_close, _list_arrays(kept[thing]), _list_arrays(of_object))):
                return False
        one, other = self.materials, wanted.materials
        is_same = (one.colours, self.founders) == (other.colours, wanted.founders)
        return is_same and _is_close(one.precision, other.precision) and _is_close(one.information, other.information)

    def meet(self, trial: TrialEvidence) -> tuple[int, ...]:
        """Finds the materials of a thing that is met in a trial, and adds those that were never met."""
        columns = self.materials.recognise(trial.parts)
        self.founders += [trial.id] * (len(self.materials.colours) - len(self.founders))
        return columns

    def write(self, connection: Connection) -> None:
        """Writes the sum over all objects."""
        materials = self.materials
        content = {
            "prior": asdict(self.prior),
            "colours": materials.colours,
            "founders": self.founders,
            "precision": materials.precision,
            "information": materials.information,
        }
        name = name_prior(self.prior)
        connection.execute(delete(MATERIALS).where(MATERIALS.c.prior == name))
        connection.execute(insert(MATERIALS), [{"prior": name, "content": _seal(content)}])

    def _write_thing(self, connection: Connection, thing: str, of_object: ObjectSum, founder: str) -> None:
        content = {
            "founder": founder,
            "columns": of_object.columns,
            "Phi": of_object.geometry.Phi,
            "Phi_errors": of_object.geometry.Phi_errors,
            "precision": of_object.body.precision,
            "information": of_object.body.information,
            "means": of_object.means,
        }
        row = {"prior": name_prior(self.prior), "thing": thing, "founder": founder, "content": _seal(content)}
        connection.execute(insert(THINGS), [row])

    def _match(self, thing: str) -> tuple[Any, Any]:
        return THINGS.c.prior == name_prior(self.prior), THINGS.c.thing == thing


def find_wrong(connection: Connection, trials: Mapping[str, Sequence[TrialEvidence]] | None) -> dict[str, str]:
    """Finds the priors whose sums are damaged, or not those of the trials of each thing if these are given."""
    wrong = {}
    for name in connection.execute(select(MATERIALS.c.prior)).scalars().all():
        try:
            (sums,) = read_sums(connection, name).values()
            if trials is not None and not sums.is_of(connection, trials):
                wrong[name] = "are not those of the trials"
        except DamagedSumsError:
            wrong[name] = "are damaged"
    return wrong


def read_sums(connection: Connection, name: str = "") -> dict[str, KeptSums]:
    """Reads the kept sums of one prior or all, by its name; damaged ones raise a DamagedSumsError."""
    query = select(MATERIALS)
    if name:
        query = query.where(MATERIALS.c.prior == name)
    found = {}
    for row in connection.execute(query).all():
        content = _unseal(row.content)
        size = len(content["colours"])
        colours = [(float(r), float(g), float(b)) for r, g, b in content["colours"]]
        precision = np.array(content["precision"], dtype=float).reshape(size, size)
        materials = MaterialSum(
            Prior(**content["prior"]), colours, precision, np.array(content["information"], dtype=float)
        )
        found[str(row.prior)] = KeptSums(materials, content["founders"])
    return found


def drop_sums(connection: Connection, name: str = "") -> None:
    """Drops the sums for a prior of this name, or all; they are computed anew when they are needed."""
    for table in (THINGS, MATERIALS):
        everything = delete(table)
        connection.execute(everything.where(table.c.prior == name) if name else everything)


def name_prior(prior: Prior) -> str:
    """Returns the key of the sums for a prior."""
    return f"{prior.mode!r} {prior.sd!r} {prior.deviation_sd!r}"


def _seal(content: Any) -> str:
    """Returns a text of content, with a digest by which a change is noticed."""
    plain = to_plain(content)
    return json.dumps({"digest": _digest(plain), **plain})


def _unseal(text: str) -> dict[str, Any]:
    """Returns the content of a text; one that was changed raises a DamagedSumsError."""
    try:
        content = json.loads(text)
        is_sound = content.pop("digest") == _digest(content)
    except (ValueError, RecursionError, AttributeError, TypeError, KeyError) as error:
        raise DamagedSumsError(str(error)) from error
    if not is_sound:
        raise DamagedSumsError(text[:40])
    return dict(content)


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:24]


def _list_arrays(of_object: ObjectSum) -> tuple[Array, ...]:
    geometry, body = of_object.geometry, of_object.body
    return geometry.Phi, geometry.Phi_errors, body.precision, body.information, *of_object.means


def _is_close(one: Array, other: Array) -> bool:
    error = np.abs(one - other).max(initial=0.0) if one.shape == other.shape else np.inf
    return bool(error <= _ROUNDING * np.abs(other).max(initial=0.0))


def _unpack(content: Any) -> ObjectSum:
    """Builds the sum of a thing from its content."""
    size = len(content["columns"])
    body = Quadratic(np.array(content["precision"]), np.array(content["information"]))
    errors = np.array(content["Phi_errors"], dtype=float).reshape(-1, NUM_PARAMETERS, size)
    means = np.array(content["means"][0], dtype=float).reshape(size, size), np.array(content["means"][1], dtype=float)
    return ObjectSum(tuple(content["columns"]), Geometry(np.array(content["Phi"]), errors), body, means)
