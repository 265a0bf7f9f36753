"""Memories of materials as files, so that what one run taught is known before the next."""

from pathlib import Path

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import BadValueError
from affordance.files.atomic import write_json
from affordance.files.bounded import SETTINGS, read_json


def write_memory(path: Path, memory: MaterialMemory) -> None:
    """Writes a memory as JSON, whole: colours, and the normal distribution of their densities in kg/m^3."""
    content = {
        "colours": [list(colour) for colour in memory.colours],
        "precision": memory.belief.precision,
        "information_vector": memory.belief.information_vector,
    }
    write_json(path, content)


def read_memory(path: Path) -> MaterialMemory:
    """Reads what ``write_memory`` wrote.

    Raises:
        BadValueError: The file cannot be read, or holds no memory.
    """
    content = read_json(path, SETTINGS)
    try:
        colours = tuple((float(r), float(g), float(b)) for r, g, b in content["colours"])
        precision = np.array(content["precision"], dtype=float).reshape(len(colours), len(colours))
        belief = DensityBelief(precision, np.array(content["information_vector"], dtype=float).reshape(len(colours)))
    except (ValueError, TypeError, KeyError, OverflowError) as error:
        raise BadValueError(path, "", f"is no memory of materials: {error}") from error
    return MaterialMemory(colours, belief)
