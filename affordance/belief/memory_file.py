"""Converts memories of observers to and from JSON text, for exchange between processes.

Numbers are written with enough digits to restore them exactly. The text contains the learner's name but not its code,
so the reader must supply the learner.
"""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.belief.felt_object import Thing
from affordance.belief.learner import Learner
from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import AffordanceError, BadValueError, show_value
from affordance.files.atomic import to_plain
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour

_TYPES = ("bool", "int64", "float64")


def format_memory(memory: MaterialMemory) -> str:
    """Formats a memory as JSON text. A recalled object that was not lifted yet is not included."""
    content = {
        "learner": memory.learner.name,
        "seed": memory.seed,
        "colours": memory.colours,
        "num_lifts": memory.num_lifts,
        "things": memory.things,
        "state": {
            name: {"type": array.dtype.name, "shape": array.shape, "values": array.ravel()}
            for name, array in memory.state.items()
        },
    }
    return json.dumps(to_plain(content))


def parse_memory(text: str | bytes, learner: Learner) -> MaterialMemory:
    """Restores a memory from JSON text.

    Raises:
        BadValueError: The text is not a memory, or the memory belongs to another learner.
    """
    try:
        content = json.loads(text)
        if content["learner"] != learner.name:
            problem = (
                f"is {show_value(content['learner'])}, must be {learner.name!r}, the learner that reads the memory"
            )
            raise BadValueError("memory", "learner", problem)
        return MaterialMemory(
            learner,
            tuple(content["seed"]),
            tuple(_read_colour(colour) for colour in content["colours"]),
            {str(name): _read_array(each) for name, each in content["state"].items()},
            tuple(_read_thing(thing) for thing in content["things"]),
            int(content["num_lifts"]),
        )
    except AffordanceError:
        raise
    except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError) as error:
        raise BadValueError("memory", "", f"is not a memory of materials: {error}") from error


def _read_array(content: Mapping[str, Any]) -> NDArray[Any]:
    if content["type"] not in _TYPES:
        raise ValueError(f"an array has the type {show_value(content['type'])}, must be one of {', '.join(_TYPES)}")
    return np.array(content["values"], dtype=content["type"]).reshape(content["shape"])


def _read_thing(content: Mapping[str, Any]) -> Thing:
    return Thing(tuple(_read_part(part) for part in content["appearance"]), tuple(content["colours"]))


def _read_part(content: Mapping[str, Any]) -> PartAppearance:
    x, y, z = (float(each) for each in content["position"])
    sizes, colour = tuple(content["sizes"]), _read_colour(content["colour"])
    return PartAppearance(**{**content, "colour": colour, "position": (x, y, z), "sizes": sizes})


def _read_colour(content: Any) -> Colour:
    red, green, blue = content
    return float(red), float(green), float(blue)
