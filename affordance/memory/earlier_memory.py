"""Reads the beliefs from JSON memory files of versions before 0.3."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.exceptions import BadValueError
from affordance.objects.colour import Colour

_TAUGHT = "taught_by"


def read_belief(path: Path, content: Any) -> tuple[tuple[Colour, ...], DensityBelief]:
    """Reads the colours of a memory, and the belief about their mean densities.

    For a learner with kinds, this is the belief about the most populous kind of each colour; of equally populous
    kinds, the oldest.

    Raises:
        BadValueError: If the content is not a memory of materials.
    """
    try:
        colours = tuple((float(red), float(green), float(blue)) for red, green, blue in content["colours"])
        if "gate" not in content:  # only a learner with kinds has this key
            return colours, _read_densities(content, len(colours))
        counts = Counter(each["kind"] for known in content["objects"] for each in known["memberships"])
        of_kinds = content["colour_of_kind"]
        kinds = [
            max((kind for kind, of in enumerate(of_kinds) if of == colour), key=lambda kind: (counts[kind], -kind))
            for colour in range(len(colours))
        ]
        return colours, _read_densities(content["kinds"], len(of_kinds)).select(kinds)
    except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError) as error:
        raise BadValueError(path, "", f"is not a memory of materials: {error}") from error


def read_taught(path: Path, content: Any) -> tuple[str, ...]:
    """Reads the fingerprints of the runs from which a memory has learned; empty if the file lists none.

    Raises:
        BadValueError: If they are not a list of strings.
    """
    taught = content.get(_TAUGHT, []) if isinstance(content, Mapping) else []
    if not isinstance(taught, list) or not all(isinstance(each, str) for each in taught):
        raise BadValueError(path, _TAUGHT, "must be a list of texts")
    return tuple(taught)


def _read_densities(content: Mapping[str, Any], size: int) -> DensityBelief:
    information_vector = np.array(content["information_vector"], dtype=float).reshape(size)
    return DensityBelief(np.array(content["precision"], dtype=float).reshape(size, size), information_vector)
