"""JSON text of the memory of a learner with kinds, from which it is restored to the last bit."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.belief.kind_memory import KindMemory, KindSettings
from affordance.belief.kinds import KindPrior, Kinds, KnownObject, Membership, OwnDensities
from affordance.belief.kinds_gate import GateSettings
from affordance.belief.learner import Pick
from affordance.objects.appearance import PartAppearance

# Python writes the shortest decimal that reads as the same number, so no precision is lost.


def write_memory(memory: KindMemory) -> str:
    """Writes a memory as JSON; an object that was recalled but not yet learned from is omitted."""
    kinds = memory.kinds
    return json.dumps(
        {
            "gate": memory.settings.gate._asdict(),
            "pick": memory.settings.pick.value,
            "seed": memory.settings.seed,
            "colours": memory.colours,
            "num_lifts": memory.num_lifts,
            "colour_of_kind": kinds.colours,
            "kinds": _write_belief(kinds.belief),
            "prior_of_kind": [prior._asdict() for prior in kinds.priors],
            "objects": [
                {
                    "appearance": [part._asdict() for part in known.appearance],
                    "colours": known.colours,
                    "memberships": [membership._asdict() for membership in known.memberships],
                    "own_columns": known.own.columns,
                    "own": _write_belief(known.own.belief),
                }
                for known in kinds.objects
            ],
        }
    )


def read_memory(text: str | bytes) -> KindMemory:
    """Reads a memory that ``write_memory`` wrote."""
    return build_memory(json.loads(text))


def build_memory(content: Mapping[str, Any]) -> KindMemory:
    """Builds a memory from the content of its JSON."""
    settings = KindSettings(GateSettings(**content["gate"]), Pick(content["pick"]), tuple(content["seed"]))
    objects = tuple(_read_object(known) for known in content["objects"])
    priors = tuple(KindPrior(**prior) for prior in content["prior_of_kind"])
    kinds = Kinds(tuple(content["colour_of_kind"]), _read_belief(content["kinds"]), objects, priors)
    colours = tuple((red, green, blue) for red, green, blue in content["colours"])
    return KindMemory(settings, colours, kinds, content["num_lifts"])


def _read_object(content: Mapping[str, Any]) -> KnownObject:
    appearance = tuple(_read_part(part) for part in content["appearance"])
    memberships = tuple(Membership(**membership) for membership in content["memberships"])
    own = OwnDensities(tuple(content["own_columns"]), _read_belief(content["own"]))
    return KnownObject(appearance, tuple(content["colours"]), memberships, own)


def _read_part(content: Mapping[str, Any]) -> PartAppearance:
    red, green, blue = content["colour"]
    x, y, z = content["position"]
    return PartAppearance(
        (red, green, blue),
        tuple(content["sizes"]),
        (x, y, z),
        content["colour_sd"],
        content["size_sd"],
        content["position_sd"],
        content["lightness_sd"],
    )


def _write_belief(belief: DensityBelief) -> dict[str, Any]:
    return {"precision": belief.precision.tolist(), "information_vector": belief.information_vector.tolist()}


def _read_belief(content: Mapping[str, Any]) -> DensityBelief:
    information_vector = np.array(content["information_vector"], dtype=float)
    size = len(information_vector)
    return DensityBelief(np.array(content["precision"], dtype=float).reshape(size, size), information_vector)
