"""Files of memories of materials, by which one run can use what an earlier one has learned."""

from pathlib import Path

import numpy as np

from affordance.belief import memory_record
from affordance.belief.density_belief import DensityBelief
from affordance.belief.kind_memory import KindMemory
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.exceptions import BadArgumentError, BadValueError
from affordance.files.atomic import write_json, write_text
from affordance.files.bounded import read_json
from affordance.files.constraints import StrPath, check_path

# Key by which the file of a learner with kinds is recognised.
_OF_KINDS = "gate"


def write_memory(path: StrPath, memory: Memory) -> Path:
    """Writes a memory as JSON, atomically and in full precision.

    Args:
        path: File, whose folder is created if it does not exist.
        memory: Memory of a learner with one density for each colour, or with kinds.

    Returns: The path of the file.

    Raises:
        BadArgumentError: The memory is of another class.
    """
    path = check_path("path", path)
    if isinstance(memory, KindMemory):
        write_text(path, memory_record.write_memory(memory) + "\n")
    elif isinstance(memory, MaterialMemory):
        content = {
            "colours": [list(colour) for colour in memory.colours],
            "precision": memory.belief.precision,
            "information_vector": memory.belief.information_vector,
        }
        write_json(path, content)
    else:
        raise BadArgumentError(
            "memory", "", f"is of type {type(memory).__name__}, must be of type MaterialMemory or KindMemory"
        )
    return path


def read_memory(path: StrPath) -> MaterialMemory | KindMemory:
    """Reads a memory that ``write_memory`` wrote.

    Raises:
        BadValueError: The file cannot be read, or does not hold a memory.
    """
    path = check_path("path", path)
    content = read_json(path)
    try:
        if _OF_KINDS in content:
            return memory_record.build_memory(content)
        colours = tuple((float(r), float(g), float(b)) for r, g, b in content["colours"])
        precision = np.array(content["precision"], dtype=float).reshape(len(colours), len(colours))
        belief = DensityBelief(precision, np.array(content["information_vector"], dtype=float).reshape(len(colours)))
        return MaterialMemory(colours, belief)
    except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError) as error:
        raise BadValueError(path, "", f"is no memory of materials: {error}") from error
