"""Measured or simulated pushes and lifted objects from a table of lifts (lifts.csv)."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.exceptions import BadArgumentError, BadValueError, describe_choice
from affordance.experiments.shared.holds import compute_volume
from affordance.extensions.people.columns import LIFT_COLUMNS
from affordance.extensions.people.experiments.lifts import cylinder
from affordance.extensions.people.experiments.trial_cells import (
    PEOPLE,
    Cells,
    read_cells,
    read_choices,
    read_names,
    read_numbers,
    read_truths,
    refuse_cell,
)
from affordance.extensions.people.experiments.trials import list_presented
from affordance.objects.colour import is_colour
from affordance.objects.materials import Material
from affordance.objects.tool import Tool

_LARGEST = 0.1  # largest volume of an object, [m^3]
_ROUNDED = 0.01  # largest relative difference between the size in a row and the size of the named object


class Person(NamedTuple):
    """Lifts of one participant in chronological order."""

    name: str
    objects: NDArray[np.intp]  # index of the object in ``Lifts.tools``, (N,)
    pushes: Array  # upward force before release, (N,), [N]; NaN if missing
    teaches: Mask  # True where the participant learns from the lift, (N,)
    group: str = ""


class Lifts(NamedTuple):
    """Lifts of several participants, and their objects."""

    people: tuple[Person, ...]
    tools: tuple[Tool, ...]


def read_lifts(
    path: Path,
    *,
    learner: str = "",
    tools: Sequence[Tool] = (),
    materials: Mapping[str, Material] = {},
    columns: Mapping[str, str] = {},
    group: str = "",
) -> Lifts:
    """Reads the lifts of human or simulated participants from a table.

    Without ``tools``, each object is a cylinder with mass and size from the table, held at its middle. Cylinders look
    alike unless the column ``looks_like`` differs. With ``tools``, the columns ``mass`` and ``looks_like`` modify the
    objects as in a table of trials, and a ``size`` must agree with the object.

    Args:
        path: Table with one row per lift.
        learner: Learner whose simulated observers are read, or "people". If empty, human participants are read, or
            the observers of the only learner in the table.
        tools: Objects that are named in the table.
        materials: Materials that objects can look like, by name.
        columns: Names of columns in the file, by this program's names.
        group: Column with the group of each participant; empty for none.

    Raises:
        BadValueError: The table cannot be read, is too large, or has an invalid cell; it has several learners and
            none was chosen; or a participant is in two groups.
    """
    known = dict.fromkeys([*LIFT_COLUMNS, group] if group else LIFT_COLUMNS)
    cells = read_cells(path, known, ["object", "force", *([group] if group else [])], columns)
    whose = np.array(read_names(cells, "learner", PEOPLE))
    cells = cells._replace(texts=cells.texts[whose == _choose(path, list(dict.fromkeys(whose.tolist())), learner)])
    names = read_names(cells, "participant" if "participant" in cells.labels else "observer", "1")
    repeats = read_names(cells, "repeat", "1")
    persons = np.array(
        [name if number == "1" else f"{name}, repeat {number}" for name, number in zip(names, repeats, strict=True)]
    )
    pushes = np.array(read_numbers(cells, "force", 1e-3, 1e3, "N", "mN"))
    teaches = np.array(read_truths(cells, "teaches"))
    groups = np.array(read_names(cells, group, "") if group else [""] * len(names))
    objects, found = _find_objects(cells, {tool.name: tool for tool in tools}, materials)
    people = []
    for name in dict.fromkeys(persons.tolist()):
        own = persons == name
        if not np.isfinite(pushes[own]).any():
            raise BadValueError(path, "force", f"is empty in all rows of participant {name}")
        of = list(dict.fromkeys(groups[own].tolist()))
        if len(of) > 1 or (group and not of[0]):
            problem = (
                f"is {' and '.join(each or 'empty' for each in of[:2])} for participant {name}, must be one group"
            )
            raise BadValueError(path, group, problem)
        people.append(Person(name, objects[own], pushes[own], teaches[own], of[0]))
    return Lifts(tuple(people), found)


def _choose(path: Path, known: Sequence[str], learner: str) -> str:
    """Returns the chosen learner or, by default, "people" if there are any, or else the only learner."""
    if learner:
        if learner not in known:
            raise BadValueError(path, "--of", describe_choice(learner, known))
        return learner
    if PEOPLE in known or len(known) == 1:
        return PEOPLE if PEOPLE in known else known[0]
    raise BadValueError(
        path, "learner", f"has {', '.join(known)}; --of says whose lifts are meant, such as --of {known[0]}"
    )


def _find_objects(
    cells: Cells, tools: Mapping[str, Tool], materials: Mapping[str, Material]
) -> tuple[NDArray[np.intp], tuple[Tool, ...]]:
    """Looks up objects by name or builds them from the table.

    Returns: Index of the object in each row, (rows,), and the objects.
    """
    rows = pd.DataFrame(
        {
            "object": read_choices(cells, "object", tools) if tools else read_names(cells, "object", ""),
            "mass": read_numbers(cells, "mass", 1e-3, 100.0, "kg", "g"),
            "size": read_numbers(cells, "size", 1e-9, _LARGEST, "m^3", "cm^3", 1e-6),
            "looks_like": read_names(cells, "looks_like", ""),
        }
    )
    if tools:
        for place, (name, size) in enumerate(zip(rows["object"], rows["size"], strict=True)):
            if abs(size / (volume := compute_volume(tools[name])) - 1.0) > _ROUNDED:
                problem = f"is {size:g} m^3, but that of {name} in the tools file is {volume:.4g}; omit it"
                refuse_cell(cells, place, "size", problem)
        places, presented = list_presented(cells, rows, tools, materials)
        return places.to_numpy(np.intp), presented
    for column, what in (
        ("object", "the object's name"),
        ("mass", "its mass, in kg"),
        ("size", "its volume, in m^3"),
    ):
        empty = (rows[column].isna() | (rows[column] == "")).to_numpy()
        if empty.any():
            verb = "empty" if column in cells.labels else "missing"
            problem = f"is {verb}, must be {what}; or --objects names a tools file with all objects"
            refuse_cell(cells, int(empty.argmax()), column, problem)
    numbers = np.array(rows.groupby([*rows], sort=False).ngroup(), dtype=np.intp)
    looks = pd.factorize(rows["looks_like"])[0]
    made = []
    for place in np.unique(numbers, return_index=True)[1].tolist():
        name, mass, size, look = rows.iloc[place]
        try:
            made.append(_make(name, mass, size, look, int(looks[place])))
        except BadArgumentError as error:
            refuse_cell(cells, place, "mass", f"and size make no object: {error}")
    return numbers, tuple(made)


def _make(name: str, mass: float, size: float, look: str, number: int) -> Tool:
    """Builds a cylinder of equal height and diameter. If ``look`` is not a colour, it gets an arbitrary colour."""
    radius = (size / (2.0 * math.pi)) ** (1.0 / 3.0)
    colour = look if is_colour(look) else f"#{(40 + 67 * number) % 256:02x}{(90 + 101 * number) % 256:02x}8c"
    return cylinder(name, radius=radius, height=2.0 * radius, mass=mass, colour=colour)
