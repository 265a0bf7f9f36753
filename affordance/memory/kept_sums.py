"""Sums of evidence over the first trials of a large memory, kept in the user's cache folder.

They are used for a memory that begins with the very rows that were summed, by the same program with the same prior,
and for no other; the trials that follow are added to them. They decide nothing: without them, because they are
missing, damaged or cannot be written, the same sums are computed and take longer.
"""

import hashlib
import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.belief.density_belief import Prior
from affordance.belief.likelihood import Likelihood, Quadratic
from affordance.exceptions import AffordanceError
from affordance.files.atomic import write_text
from affordance.files.bounded import RESULTS, read_text
from affordance.memory.evidence_sums import EvidenceSums, FeltThing, ObjectSum
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import NUM_PARAMETERS, Geometry

# Number of trials that are summed anew before the sums are kept, which is about a second's work.
WORTH_KEEPING = 1000
# What a file that is missing, damaged or of another program raises.
_DAMAGE = (AffordanceError, OSError, RuntimeError, ValueError, TypeError, LookupError, AttributeError)


class KeptSums(NamedTuple):
    """Sums over the first rows of a memory, with their number and a digest of them."""

    number: int
    digest: str
    sums: EvidenceSums


def load_sums(place: Path, prior: Prior) -> KeptSums | None:
    """Loads the sums that are kept for a memory and a prior; None if there are none."""
    try:
        head, text = read_text(_find_file(place, prior), RESULTS).split("\n", 1)
        number, digest, seal = json.loads(head)
        if seal != _seal(text, prior):
            return None
        content = json.loads(text)
        things = {name: _unpack(thing) for name, thing in content["things"].items()}
        colours = [(red, green, blue) for red, green, blue in content["colours"]]
        return KeptSums(number, digest, EvidenceSums(prior, colours, things, content["names"]))
    except _DAMAGE:
        return None


def save_sums(place: Path, kept: KeptSums) -> None:
    """Saves the sums of a memory, in place of those that were kept for it, if the cache folder can be written."""
    sums = kept.sums
    things = {name: _pack(thing, sums.prior) for name, thing in sums.things.items()}
    text = json.dumps({"colours": sums.colours, "names": sums.names, "things": things})
    head = json.dumps([kept.number, kept.digest, _seal(text, sums.prior)])
    if len(head) + 1 + len(text) <= RESULTS:
        with suppress(OSError, RuntimeError):
            write_text(_find_file(place, sums.prior), f"{head}\n{text}")


def _find_file(place: Path, prior: Prior) -> Path:
    """Finds the file of a memory's sums; a RuntimeError is raised for a user without a home."""
    folder = Path(os.environ.get("XDG_CACHE_HOME", ""))  # relative ones are to be ignored
    folder = folder if folder.is_absolute() else Path.home() / ".cache"
    name = hashlib.sha256(f"{place.resolve()} {prior}".encode(errors="surrogateescape")).hexdigest()[:24]
    return folder / "affordance" / "memory" / f"{name}.json"


def _seal(text: str, prior: Prior) -> str:
    """Computes a digest of sums and of the program that computed them."""
    from affordance.runs.repeats import compute_key  # here, as joblib takes long to import

    return hashlib.sha256(f"{compute_key(prior, ())} {text}".encode()).hexdigest()


def _pack(thing: FeltThing, prior: Prior) -> dict[str, Any]:
    evidence, likelihood = thing.evidence, thing.compute_likelihood(prior)
    arrays = [evidence.geometry.Phi, evidence.geometry.Phi_errors, evidence.body.precision, evidence.body.information]
    arrays += [*evidence.means, likelihood.precision, likelihood.information_vector]
    return {
        "parts": thing.parts,
        "columns": evidence.columns,
        "since": thing.since,
        "trials": thing.trials,
        "robots": sorted(thing.robots),
        "arrays": [array.ravel().tolist() for array in arrays],
    }


def _unpack(content: dict[str, Any]) -> FeltThing:
    columns = tuple(content["columns"])
    P, M, N = len(columns), len(set(columns)), NUM_PARAMETERS
    shapes = [(N, P), (-1, N, P), (N, N), (N,), (P, P), (P,), (M, M), (M,)]
    Phi, errors, H, b, means, information, precision, vector = (
        np.array(values, dtype=float).reshape(shape) for values, shape in zip(content["arrays"], shapes, strict=True)
    )
    parts: list[list[Any]] = [
        [tuple(each) if isinstance(each, list) else each for each in part] for part in content["parts"]
    ]
    return FeltThing(
        tuple(PartAppearance(*part) for part in parts),
        ObjectSum(columns, Geometry(Phi, errors), Quadratic(H, b), (means, information)),
        content["since"],
        content["trials"],
        set(content["robots"]),
        Likelihood(precision, vector, np.nan),
    )
