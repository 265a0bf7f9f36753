"""Memories of materials as JSON text, by which processes hand them on and an earlier version kept them in files.

Python writes the shortest decimal that reads as the same number, so a memory is restored to the last bit.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.belief.kind_memory import KindMemory, KindSettings
from affordance.belief.kinds import KindPrior, Kinds, KnownObject, Membership, OwnDensities
from affordance.belief.kinds_gate import GateSettings
from affordance.belief.learner import Pick
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.exceptions import BadValueError
from affordance.files.atomic import to_plain
from affordance.objects.appearance import PartAppearance

# Key by which the file of a learner with kinds is recognised.
_OF_KINDS = "gate"
_TAUGHT = "taught_by"


def build_memory(path: Path, content: Any) -> MaterialMemory | KindMemory:
    """Builds the memory of a file's content.

    Raises:
        BadValueError: The content is no memory.
    """
    try:
        if _OF_KINDS in content:
            return _build_kinds(content)
        return MaterialMemory(_read_colours(content), _read_belief(content))
    except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError) as error:
        raise BadValueError(path, "", f"is no memory of materials: {error}") from error


def find_taught(path: Path, content: Any) -> tuple[str, ...]:
    """Finds the fingerprints of the runs that taught the memory of a file; none if it does not say.

    Raises:
        BadValueError: They are not a list of texts.
    """
    taught = content.get(_TAUGHT, []) if isinstance(content, Mapping) else []
    if not isinstance(taught, list) or not all(isinstance(each, str) for each in taught):
        raise BadValueError(path, _TAUGHT, "must be a list of texts")
    return tuple(taught)


def format_memory(memory: Memory) -> str:
    """Returns the JSON text of a memory."""
    if isinstance(memory, KindMemory):
        return format_kinds(memory)
    return json.dumps({"colours": memory.colours, **to_plain(memory.belief)})


def parse_memory(text: str) -> MaterialMemory | KindMemory:
    """Restores a memory from its JSON text.

    Raises:
        BadValueError: The text is no memory.
    """
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadValueError("memory", "", f"is not JSON: {error}") from error
    return build_memory(Path("memory"), content)


def format_kinds(memory: KindMemory) -> str:
    """Returns the JSON text of a memory with kinds; an object recalled but not yet learned from is omitted."""
    settings, kinds = memory.settings, memory.kinds
    content = {
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
            }
            for known in kinds.objects
        ],
    }
    return json.dumps(to_plain(content))


def parse_kinds(text: str | bytes) -> KindMemory:
    """Restores a memory with kinds from its JSON text."""
    return _build_kinds(json.loads(text))


def _build_kinds(content: Mapping[str, Any]) -> KindMemory:
    settings = KindSettings(GateSettings(**content["gate"]), Pick(content["pick"]), tuple(content["seed"]))
    objects = tuple(_read_object(known) for known in content["objects"])
    priors = tuple(KindPrior(**prior) for prior in content["prior_of_kind"])
    kinds = Kinds(tuple(content["colour_of_kind"]), _read_belief(content["kinds"]), objects, priors)
    return KindMemory(settings, _read_colours(content), kinds, content["num_lifts"])


def _read_object(content: Mapping[str, Any]) -> KnownObject:
    appearance = tuple(_read_part(part) for part in content["appearance"])
    memberships = tuple(Membership(**membership) for membership in content["memberships"])
    own = OwnDensities(tuple(content["own_columns"]), _read_belief(content["own"]))
    return KnownObject(appearance, tuple(content["colours"]), memberships, own)


def _read_part(content: Mapping[str, Any]) -> PartAppearance:
    colour, position = ((float(a), float(b), float(c)) for a, b, c in (content["colour"], content["position"]))
    return PartAppearance(**{**content, "colour": colour, "position": position, "sizes": tuple(content["sizes"])})


def _read_colours(content: Mapping[str, Any]) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(red), float(green), float(blue)) for red, green, blue in content["colours"])


def _read_belief(content: Mapping[str, Any]) -> DensityBelief:
    information_vector = np.array(content["information_vector"], dtype=float)
    size = len(information_vector)
    return DensityBelief(np.array(content["precision"], dtype=float).reshape(size, size), information_vector)
