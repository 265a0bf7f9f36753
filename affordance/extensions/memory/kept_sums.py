"""Cache of the evidence sums over the first trials of a large memory, in the user's cache folder.

Cached sums are used only for a memory that begins with exactly the rows that were summed, by the same version of the
program with the same prior; later trials are added to them. They change no result: if the cache is missing, damaged
or not writable, the same sums are recomputed, which takes longer.
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
from affordance.extensions.memory.evidence_sums import EvidenceSums, FeltThing, ObjectSum
from affordance.files.atomic import write_text
from affordance.files.bounded import RESULTS, read_text
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import NUM_PARAMETERS, Geometry

# Sums are cached once this many trials were summed anew, which takes about a second.
WORTH_KEEPING = 1000
# Exceptions raised by a file that is missing, damaged or from another program.
_DAMAGE = (AffordanceError, OSError, RuntimeError, ValueError, TypeError, LookupError, AttributeError)


class KeptSums(NamedTuple):
    """Sums over the first rows of a memory, with the number and a digest of these rows."""

    number: int
    digest: str
    sums: EvidenceSums


def load_sums(place: Path, prior: Prior) -> KeptSums | None:
    """Loads the cached sums for a memory and a prior; None if there are none."""
    try:
        head, text = read_text(_get_file(place, prior), RESULTS).split("\n", 1)
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
    """Caches the sums of a memory, replacing earlier ones; does nothing if the cache folder is not writable."""
    sums = kept.sums
    things = {name: _pack(thing, sums.prior) for name, thing in sums.things.items()}
    text = json.dumps({"colours": sums.colours, "names": sums.names, "things": things})
    head = json.dumps([kept.number, kept.digest, _seal(text, sums.prior)])
    if len(head) + 1 + len(text) <= RESULTS:
        with suppress(OSError, RuntimeError):
            write_text(_get_file(place, sums.prior), f"{head}\n{text}")


def _get_file(place: Path, prior: Prior) -> Path:
    """Returns the path of a memory's cached sums; raises a RuntimeError if the user has no home folder."""
    folder = Path(os.environ.get("XDG_CACHE_HOME", ""))  # relative paths must be ignored
    folder = folder if folder.is_absolute() else Path.home() / ".cache"
    name = hashlib.sha256(f"{place.resolve()} {prior}".encode(errors="surrogateescape")).hexdigest()[:24]
    return folder / "affordance" / "memory" / f"{name}.json"


def _seal(text: str, prior: Prior) -> str:
    """Computes a digest of the sums and of the program that computed them."""
    from affordance.runs.repeats import compute_key  # imported here, because joblib takes long to import

    return hashlib.sha256(f"{compute_key(prior, ())} {text}".encode()).hexdigest()


def _pack(thing: FeltThing, prior: Prior) -> dict[str, Any]:
    evidence, likelihood = thing.evidence, thing.compute_likelihood(prior)
    arrays = [evidence.geometry.Phi, evidence.geometry.Phi_errors, evidence.body.precision, evidence.body.information]
    arrays += [likelihood.precision, likelihood.information_vector]
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
    shapes = [(N, P), (-1, N, P), (N, N), (N,), (M, M), (M,)]
    Phi, errors, H, b, precision, vector = (
        np.array(values, dtype=float).reshape(shape) for values, shape in zip(content["arrays"], shapes, strict=True)
    )
    parts: list[list[Any]] = [
        [tuple(each) if isinstance(each, list) else each for each in part] for part in content["parts"]
    ]
    return FeltThing(
        tuple(PartAppearance(*part) for part in parts),
        ObjectSum(columns, Geometry(Phi, errors), Quadratic(H, b)),
        content["since"],
        content["trials"],
        set(content["robots"]),
        Likelihood(precision, vector, np.nan),
    )
