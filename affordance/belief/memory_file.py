"""Writes and reads memories of observers as JSON text, for exchange between processes.

Python writes the shortest decimal that reads as the same number, so a memory is restored to the last bit. The text
names its learner but contains no code: the reader must supply the learner.
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
    """Formats a memory as JSON text, without an object that is only recalled."""
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
    """Restores a learner's memory from its JSON text.

    Raises:
        BadValueError: The text is not a memory, or is the memory of another learner.
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
