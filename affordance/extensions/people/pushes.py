"""Reads people's (or simulated) pushes and the objects that they lifted from a table of lifts (lifts.csv)."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.exceptions import BadArgumentError, BadValueError, describe_choice
from affordance.extensions.people.experiments.lifts import cylinder
from affordance.extensions.people.experiments.trial_cells import PEOPLE, Cells
from affordance.objects.colour import is_colour
from affordance.objects.tool import Tool

# Columns that are read; others, such as those that the program writes itself, are ignored.
COLUMNS = (
    "participant",
    "observer",
    "repeat",
    "learner",
    "object",
    "mass",
    "size",
    "looks_like",
    "teaches",
    "force",
)
_LARGEST = 0.1  # volume of an object, [m^3]


class Person(NamedTuple):
    """Lifts of one participant in order, N of them."""

    name: str
    objects: NDArray[np.intp]  # index of the object in ``Lifts.tools``, (N,)
    pushes: Array  # upward force before release, (N,), [N]; NaN where unknown
    teaches: Mask


class Lifts(NamedTuple):
    """Lifts of several participants, and the objects that they lifted."""

    people: tuple[Person, ...]
    tools: tuple[Tool, ...]


def read_lifts(
    path: Path, *, learner: str = "", tools: Sequence[Tool] = (), columns: Mapping[str, str] = {}
) -> Lifts:
    """Reads the lifts of participants; simulated observers count as participants too.

    Without ``tools``, objects are built from the table: cylinders with the mass and size given in each row, held at
    their middle. They look alike unless the column ``looks_like`` differs. No other property matters for lifts.

    Args:
        path: Table with one row for each lift.
        learner: Learner whose simulated observers are read, or "people"; empty for people, or if the table has the
            lifts of a single learner.
        tools: Objects that the table names.
        columns: Names of columns in the file, by this program's names.

    Raises:
        BadValueError: The table cannot be read, is too large, or has an invalid cell; or it has lifts of several
            learners and none was chosen.
    """
    cells = Cells.read(path, COLUMNS, columns)
    count = len(cells.numbers)
    for needed in ("object", "force"):
        if needed not in cells.labels:
            listed = ", ".join([*cells.labels.values()][:20])
            how = f"--columns {needed}=NAME names the column to use"
            raise BadValueError(path, needed, f"is missing among {listed}; {how}")
    whose = cells.read_names("learner", PEOPLE)
    pushes = cells.read_numbers("force", 1e-3, 1e3, "N", "mN")
    chosen = _choose(path, list(dict.fromkeys(whose)), learner)
    rows = [row for row in range(count) if whose[row] == chosen]
    names = (
        cells.read_names("participant", "") if "participant" in cells.labels else cells.read_names("observer", "1")
    )
    repeats = cells.read_names("repeat", "1")
    objects, found = _find_objects(cells, rows, {tool.name: tool for tool in tools})
    teaches = np.array(cells.read_truths("teaches"))
    by_person: dict[str, list[int]] = {}
    for place, row in enumerate(rows):
        name = names[row] or "1"
        by_person.setdefault(name if repeats[row] == "1" else f"{name}, repeat {repeats[row]}", []).append(place)
    people = tuple(
        Person(name, objects[own], np.array([pushes[rows[each]] for each in own]), teaches[np.array(rows)[own]])
        for name, own in by_person.items()
    )
    for person in people:
        if not np.isfinite(person.pushes).any():
            raise BadValueError(path, "force", f"is empty in all rows of participant {person.name}")
    return Lifts(people, found)


def _choose(path: Path, known: Sequence[str], learner: str) -> str:
    """Returns whose lifts are read: the chosen learner's, else people's, else those of the only learner."""
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
    cells: Cells, rows: Sequence[int], tools: dict[str, Tool]
) -> tuple[NDArray[np.intp], tuple[Tool, ...]]:
    """Returns each row's index of an object, (rows,), and the objects, looked up by name or built from the table."""
    names = cells.read_choices("object", tools) if tools else cells.read_names("object", "")
    if tools:
        order = list(dict.fromkeys(names[row] for row in rows))
        return np.array([order.index(names[row]) for row in rows]), tuple(tools[name] for name in order)
    masses = cells.read_numbers("mass", 1e-3, 100.0, "kg", "g")
    sizes = cells.read_numbers("size", 1e-9, _LARGEST, "m^3", "cm^3", 1e-6)
    looks = cells.read_names("looks_like", "")
    numbers: dict[tuple[str, float, float, str], int] = {}
    made: list[Tool] = []
    found = []
    for row in rows:
        key = (names[row], masses[row], sizes[row], looks[row])
        if key not in numbers:
            for column, value in (("object", names[row]), ("mass", masses[row]), ("size", sizes[row])):
                if value == "" or value != value:
                    cells.refuse(row, column, "is empty, must say what was lifted; or --objects names a file")
            numbers[key] = len(made)
            known = list(dict.fromkeys(each[3] for each in numbers))
            try:
                made.append(_make(names[row], masses[row], sizes[row], looks[row], known.index(looks[row])))
            except BadArgumentError as error:
                cells.refuse(row, "mass", f"and size make no object: {error}")
        found.append(numbers[key])
    return np.array(found, dtype=np.intp), tuple(made)


def _make(name: str, mass: float, size: float, look: str, number: int) -> Tool:
    """Builds a cylinder as high as its diameter; a look that is not a colour gets an arbitrary one."""
    radius = (size / (2.0 * math.pi)) ** (1.0 / 3.0)
    colour = look if is_colour(look) else f"#{(40 + 67 * number) % 256:02x}{(90 + 101 * number) % 256:02x}8c"
    return cylinder(name, radius=radius, height=2.0 * radius, mass=mass, colour=colour)
