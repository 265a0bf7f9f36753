"""Memories of materials as JSON text, by which processes hand them on and an earlier version kept them in files.

Python writes the shortest decimal that reads as the same number, so a memory is restored to the last bit.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from affordance.belief.kind_memory import KindMemory, build_kinds, format_kinds, read_belief, read_colours
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.exceptions import BadValueError
from affordance.files.atomic import to_plain

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
            return build_kinds(content)
        return MaterialMemory(read_colours(content), read_belief(content))
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
