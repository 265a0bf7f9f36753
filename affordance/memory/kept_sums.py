"""Sums of evidence over the trials of a ledger, stored with them so that a belief is recalled at once.

They can be computed anew at any time. All changes are made in the transaction that changes the trials.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection, delete, insert, select

from affordance.belief.density_belief import Prior
from affordance.belief.quadratic import Quadratic
from affordance.files.atomic import to_plain
from affordance.memory.evidence_sums import MaterialSum, ObjectSum
from affordance.memory.stored_trials import list_things, read_thing
from affordance.memory.tables import MATERIALS, THINGS
from affordance.memory.trial_evidence import TrialEvidence
from affordance.objects.inertia import NUM_PARAMETERS, Geometry


class KeptSums:
    """Sums for one prior, as they are kept in a ledger, and the ids of the trials in which colours were first met."""

    def __init__(self, materials: MaterialSum, founders: Sequence[str] = ()) -> None:
        """Stores the sums."""
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
            columns = self.materials.recognise(trials[0].parts)
            self.founders += [trials[0].id] * (len(self.materials.colours) - len(self.founders))
            of_object, founder = ObjectSum.start(trials[0], columns), trials[0].id
        else:
            of_object, founder = _unpack(json.loads(row)), json.loads(row)["founder"]
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
        kept = {
            row.thing: row.content
            for row in connection.execute(select(THINGS).where(THINGS.c.prior == name_prior(self.prior)))
        }
        for thing in list_things(connection):
            self.materials.add(_unpack(json.loads(kept[thing])))

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
        connection.execute(insert(MATERIALS), [{"prior": name, "content": json.dumps(to_plain(content))}])

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
        text = json.dumps(to_plain(content))
        row = {"prior": name_prior(self.prior), "thing": thing, "founder": founder, "content": text}
        connection.execute(insert(THINGS), [row])

    def _match(self, thing: str) -> tuple[Any, Any]:
        return THINGS.c.prior == name_prior(self.prior), THINGS.c.thing == thing


def read_sums(connection: Connection, prior: Prior | None = None) -> dict[str, KeptSums]:
    """Reads the sums that are kept, for one prior or all, by the name of the prior."""
    query = select(MATERIALS)
    if prior is not None:
        query = query.where(MATERIALS.c.prior == name_prior(prior))
    found = {}
    for row in connection.execute(query).all():
        content = json.loads(row.content)
        size = len(content["colours"])
        colours = [(float(r), float(g), float(b)) for r, g, b in content["colours"]]
        precision = np.array(content["precision"], dtype=float).reshape(size, size)
        materials = MaterialSum(
            Prior(**content["prior"]), colours, precision, np.array(content["information"], dtype=float)
        )
        found[str(row.prior)] = KeptSums(materials, content["founders"])
    return found


def drop_sums(connection: Connection, prior: Prior | None = None) -> None:
    """Drops the sums for a prior, or all; they are computed anew when they are needed."""
    for table in (THINGS, MATERIALS):
        everything = delete(table)
        connection.execute(everything if prior is None else everything.where(table.c.prior == name_prior(prior)))


def name_prior(prior: Prior) -> str:
    """Returns the key of the sums for a prior."""
    return f"{prior.mode!r} {prior.sd!r} {prior.deviation_sd!r}"


def _unpack(content: Any) -> ObjectSum:
    """Builds the sum of a thing from its content."""
    size = len(content["columns"])
    body = Quadratic(np.array(content["precision"]), np.array(content["information"]))
    errors = np.array(content["Phi_errors"], dtype=float).reshape(-1, NUM_PARAMETERS, size)
    means = np.array(content["means"][0], dtype=float).reshape(size, size), np.array(content["means"][1], dtype=float)
    return ObjectSum(tuple(content["columns"]), Geometry(np.array(content["Phi"]), errors), body, means)
