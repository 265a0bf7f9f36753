"""Memories of materials as JSON text, by which processes hand them on and an earlier version kept them in files.

Python writes the shortest decimal that reads as the same number, so a memory is restored to the last bit.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.kind_memory import KindMemory
from affordance.belief.kinds import KindPrior, Kinds, KnownObject, Membership, OwnDensities
from affordance.belief.kinds_gate import GateSettings, KindSettings
from affordance.belief.learner import Pick
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import HeldObject, MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.exceptions import BadValueError
from affordance.files.atomic import to_plain
from affordance.objects.appearance import Appearance, PartAppearance
from affordance.objects.colour import Colour

# Key by which the file of a learner with kinds is recognised.
_OF_KINDS = "gate"
_TAUGHT = "taught_by"


def build_memory(path: Path, content: Any) -> MaterialMemory | KindMemory:
    """Builds the memory of a file's content; any other content raises a BadValueError."""
    try:
        if _OF_KINDS in content:
            return _build_kinds(content)
        objects = (
            HeldObject(_read_appearance(held), tuple(held["columns"]), _read_felt(held))
            for held in content.get("objects", ())
        )
        return MaterialMemory(_read_colours(content), _read_belief(content), tuple(objects))
    except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError) as error:
        raise BadValueError(path, "", f"is not a memory of materials: {error}") from error


def find_taught(path: Path, content: Any) -> tuple[str, ...]:
    """Finds the fingerprints of the runs that taught the memory of a file, if it lists them; else a BadValueError."""
    taught = content.get(_TAUGHT, []) if isinstance(content, Mapping) else []
    if not isinstance(taught, list) or not all(isinstance(each, str) for each in taught):
        raise BadValueError(path, _TAUGHT, "must be a list of texts")
    return tuple(taught)


def format_memory(memory: Memory) -> str:
    """Returns the JSON text of a memory; an object recalled but not yet learned from is omitted."""
    if isinstance(memory, KindMemory):
        return json.dumps(to_plain(_format_kinds(memory)))
    assert isinstance(memory, MaterialMemory)
    objects = [held._asdict() | {"felt": _format_felt(held.felt)} for held in memory.objects]
    return json.dumps(to_plain({"colours": memory.colours, **to_plain(memory.belief), "objects": objects}))


def parse_memory(text: str | bytes) -> MaterialMemory | KindMemory:
    """Restores a memory from its JSON text; any other text raises a BadValueError."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadValueError("memory", "", f"is not JSON: {error}") from error
    return build_memory(Path("memory"), content)


def _format_kinds(memory: KindMemory) -> dict[str, Any]:
    settings, kinds = memory.settings, memory.kinds
    return {
        "gate": settings.gate,
        "pick": settings.pick,
        "seed": settings.seed,
        "colours": memory.colours,
        "num_lifts": memory.num_lifts,
        "colour_of_kind": kinds.colours,
        "kinds": kinds.belief,
        "prior_of_kind": kinds.priors,
        "objects": [
            {
                "appearance": known.appearance,
                "colours": known.colours,
                "memberships": known.memberships,
                "own_columns": known.own.columns,
                "own": known.own.belief,
                "felt": _format_felt(known.felt),
            }
            for known in kinds.objects
        ],
    }


def _build_kinds(content: Mapping[str, Any]) -> KindMemory:
    settings = KindSettings(GateSettings(**content["gate"]), Pick(content["pick"]), tuple(content["seed"]))
    objects = tuple(
        KnownObject(
            _read_appearance(known),
            tuple(known["colours"]),
            tuple(Membership(**membership) for membership in known["memberships"]),
            OwnDensities(tuple(known["own_columns"]), _read_belief(known["own"])),
            _read_felt(known),
        )
        for known in content["objects"]
    )
    priors = tuple(KindPrior(**prior) for prior in content["prior_of_kind"])
    kinds = Kinds(tuple(content["colour_of_kind"]), _read_belief(content["kinds"]), objects, priors)
    return KindMemory(settings, _read_colours(content), kinds, content["num_lifts"])


def _format_felt(felt: Likelihood | None) -> dict[str, Array] | None:
    """Returns what a memory keeps of a likelihood; None if nothing was felt."""
    return None if felt is None else {"precision": felt.precision, "information_vector": felt.information_vector}


def _read_felt(content: Mapping[str, Any]) -> Likelihood | None:
    """Restores the likelihood of an object that was held; None if an earlier version wrote it."""
    if (felt := content.get("felt")) is None:
        return None
    vector = np.array(felt["information_vector"], dtype=float)
    return Likelihood(np.array(felt["precision"], dtype=float).reshape(len(vector), len(vector)), vector, np.nan)


def _read_appearance(content: Mapping[str, Any]) -> Appearance:
    return tuple(_read_part(part) for part in content["appearance"])


def _read_part(content: Mapping[str, Any]) -> PartAppearance:
    colour, position = ((float(a), float(b), float(c)) for a, b, c in (content["colour"], content["position"]))
    return PartAppearance(**{**content, "colour": colour, "position": position, "sizes": tuple(content["sizes"])})


def _read_colours(content: Mapping[str, Any]) -> tuple[Colour, ...]:
    return tuple((float(red), float(green), float(blue)) for red, green, blue in content["colours"])


def _read_belief(content: Mapping[str, Any]) -> DensityBelief:
    information_vector = np.array(content["information_vector"], dtype=float)
    size = len(information_vector)
    return DensityBelief(np.array(content["precision"], dtype=float).reshape(size, size), information_vector)
