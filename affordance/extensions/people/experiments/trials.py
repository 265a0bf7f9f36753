"""Trial tables: one row per trial, from a spreadsheet, another program or a function, checked cell by cell.

Rows are in the order of the trials. Only the column ``object`` is required. By default a trial is a lift of the
object as its file defines it, by one participant in one group. A column ``block`` serves as ``phase`` if there is no
such column. A table is data: nothing in it is run or calculated.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from affordance.arguments import REPEATS
from affordance.exceptions import BadValueError, describe_choice, find_hidden
from affordance.experiments.shared.holds import OWN_VALUES
from affordance.extensions.people.experiments.trial_cells import Cells, is_formula
from affordance.objects.colour import is_colour, parse_colour
from affordance.objects.inertia import DENSITY_MAX, DENSITY_MIN
from affordance.objects.materials import Material
from affordance.objects.tool import Tool

# Actions of a trial: the object is lifted from a clamp, held in the hand, only looked at, or a grip is chosen.
DOINGS = ("lift", "hold", "look", "choose")
# Columns that the program reads; ``force``, [N], is the force that people exerted.
COLUMNS = (
    *("participant", "group", "phase", "cycle", "object", "do", "task", "duration", "mass", "looks_like", "teaches"),
    *("measured", "force"),
)
DURATION = 3.0  # of a hold, unless the table gives another, [s]
# Bounds (SECURITY.md): trials of one participant; objects with their own mass or look, which take a millisecond each;
# and colours, because a joint belief grows with their square.
_MOST_TRIALS, _MOST_PRESENTED, _MOST_COLOURS = 5_000, 5_000, 50
_LONGEST_HOLD = 60.0  # [s]
# Bounds on cost (SECURITY.md): a lift takes 2 ms, a second of holding 0.05 s, and a row of results a kilobyte.
_MOST_LIFTS, _MOST_SECONDS = 1_000_000, 200_000.0
# Columns that the simulation adds to the table.
WRITTEN = (
    *("observer", "learner", "lift", "repeat", "size", "expected", "believed_density", "weight", "felt", "kind"),
    *("surprise", "moved", "chosen", "tool", "place", "block", "expected_by_look", "heaviness"),
)
_LONGEST_CELL = 200  # characters in a cell of a further column


class TrialTable(NamedTuple):
    """Checked table of trials.

    Attributes:
        rows: Columns of ``COLUMNS``, in SI units; ``place``, the index of the participant; ``tool``, the index of the
            presented object in ``tools``; and the table's further columns as texts.
        tools: Objects as they are presented, with the mass and the look that their rows give them.
        unused: Names of further columns that are left out, because their cells are not short single lines or their
            names are needed for results.
        source: File of the table.
        numbers: Number of each row in the file.
    """

    rows: pd.DataFrame
    tools: tuple[Tool, ...]
    unused: tuple[str, ...]
    source: Path
    numbers: tuple[int, ...]

    @property
    def participants(self) -> list[str]:
        """Names of the participants, in the order in which they first occur."""
        return list(dict.fromkeys(self.rows["participant"]))


def read_trials(
    path: Path,
    tools: Sequence[Tool],
    materials: Mapping[str, Material],
    *,
    columns: Mapping[str, str] = {},
    tasks: Collection[str] = (),
) -> TrialTable:
    """Reads a trial table from a file and checks it; for the format see ``Cells.read``.

    Args:
        path: File of the table.
        tools: Objects that the table may name.
        materials: Materials that objects may look like, by name.
        columns: Names of columns in the file, by this program's names.
        tasks: Names of the tasks for which a grip may be chosen.

    Raises:
        BadValueError: The file cannot be read or is too large, or a cell is wrong. The message names the cell's row,
            as a spreadsheet counts, and its column.
    """
    return _check(Cells.read(path, COLUMNS, columns), tools, materials, tasks)


def check_trials(
    frame: pd.DataFrame,
    tools: Sequence[Tool],
    materials: Mapping[str, Material] = {},
    *,
    tasks: Collection[str] = (),
    name: str = "trials",
) -> TrialTable:
    """Checks a table built in Python as if it had been read from a file; its first trial is row 2."""
    rows = [
        [str(each) for each in frame.columns],
        *([_write(each) for each in row] for row in frame.to_numpy(object)),
    ]
    return _check(Cells(Path(name), list(enumerate(rows, start=1)), COLUMNS, None), tools, materials, tasks)


def _write(value: Any) -> str:
    """Writes a value as the exact text of a cell."""
    return "" if pd.isna(value) else str(value)


def _check(
    cells: Cells, tools: Sequence[Tool], materials: Mapping[str, Material], tasks: Collection[str]
) -> TrialTable:
    """Checks all cells, and makes the presented objects."""
    if "object" not in cells.labels:
        listed = ", ".join(list(cells.labels.values())[:20])
        raise BadValueError(
            cells.path, "object", f"is missing among {listed}; --columns object=NAME names the column to use"
        )
    by_name = {tool.name: tool for tool in tools}
    rows = pd.DataFrame(
        {
            "participant": cells.read_names("participant", "1"),
            "group": cells.read_names("group", "all"),
            "phase": cells.read_names("phase" if "phase" in cells.labels else "block", "all"),
            "cycle": cells.read_numbers("cycle", 0, 1_000_000),
            "object": cells.read_choices("object", by_name),
            "do": cells.read_choices("do", DOINGS, "lift"),
            "task": cells.read_names("task", ""),
            "duration": cells.read_numbers("duration", 0.1, _LONGEST_HOLD, "s", "ms"),
            "mass": cells.read_numbers("mass", 1e-3, 100.0, "kg", "g"),
            "looks_like": cells.read_names("looks_like", ""),
            "teaches": cells.read_truths("teaches"),
            "measured": cells.read_truths("measured"),
            "force": cells.read_numbers("force", -1e3, 1e3, "N", "mN"),
        }
    )
    _check_rows(cells, rows, by_name, tasks)
    rows["duration"] = rows["duration"].where(rows["duration"].notna() | (rows["do"] != "hold"), DURATION)
    rows["teaches"] &= rows["do"].isin(("lift", "hold"))
    rows["place"] = pd.factorize(rows["participant"])[0]
    _check_participants(cells, rows)
    counted = rows.groupby(["place", "phase", "object"], sort=False).cumcount() + 1
    rows["cycle"] = rows["cycle"].where(rows["cycle"].notna(), counted).astype(int)
    rows["tool"], presented = _list_presented(cells, rows, by_name, materials)
    further = [name for name in cells.labels if name not in (*COLUMNS, "block")]
    taken = (*WRITTEN, *(name for name in further if name.startswith(OWN_VALUES)))
    carried = [name for name in further if all(map(_is_carried, cells[name])) and name not in taken]
    rows = rows.assign(**{name: cells[name] for name in carried})
    unused = tuple(name for name in further if name not in carried)
    return TrialTable(rows, presented, unused, cells.path, tuple(cells.numbers))


def _check_rows(cells: Cells, rows: pd.DataFrame, tools: Mapping[str, Tool], tasks: Collection[str]) -> None:
    """Checks that the cells of each row fit together."""
    given = {name: cells[name] for name in ("task", "duration", "force")}
    for place, row in enumerate(rows.to_dict("records")):
        cycle, do, task = row["cycle"], row["do"], row["task"]
        if not (math.isnan(cycle) or cycle.is_integer()):
            cells.refuse(place, "cycle", f"is {cycle:g}, must be a whole number; the nearest is {cycle:.0f}")
        if do == "choose" and task not in tasks:
            known = ", ".join(tasks)
            problem = describe_choice(task, tasks) if task else f"is empty, must be one of {known} to choose a grip"
            cells.refuse(place, "task", problem)
        if do == "choose" and len(tools[row["object"]].grips) < 2:
            cells.refuse(place, "object", f"is {row['object']!r}, which has fewer than two grips to choose from")
        for name, only in (("task", "choose"), ("duration", "hold"), ("force", "lift")):
            if given[name][place] and do != only:
                cells.refuse(place, name, f"is {given[name][place]}, must be empty where do is {do!r}, not {only!r}")


def _check_participants(cells: Cells, rows: pd.DataFrame) -> None:
    """Checks that each participant is in one group, and does not have too many trials."""
    groups: dict[str, str] = {}
    for place, (participant, group) in enumerate(zip(rows["participant"], rows["group"], strict=True)):
        if (known := groups.setdefault(participant, group)) != group:
            problem = f"is {group!r}, must be {known!r}, as in the rows above of participant {participant}"
            cells.refuse(place, "group", problem)
    number = rows.groupby("place").cumcount() + 1
    if (number > _MOST_TRIALS).any():
        place = int((number > _MOST_TRIALS).to_numpy().argmax())
        name = rows["participant"].iloc[place]
        problem = f"is {name!r}, who has more than {_MOST_TRIALS} trials, must have at most that many"
        cells.refuse(place, "participant", problem)


def _list_presented(
    cells: Cells, rows: pd.DataFrame, tools: Mapping[str, Tool], materials: Mapping[str, Material]
) -> tuple[list[int], tuple[Tool, ...]]:
    """Lists the presented objects, each mass and look once, and the index of each row's object."""
    known: dict[tuple[str, float | None, str], int] = {}
    presented: list[Tool] = []
    places = []
    for place, (name, mass, look) in enumerate(zip(rows["object"], rows["mass"], rows["looks_like"], strict=True)):
        key = (name, None if math.isnan(mass) else mass, look)
        if key not in known:
            if len(known) == _MOST_PRESENTED:
                problem = (
                    f"exceeds the limit of {_MOST_PRESENTED} different objects; rows that give an object another"
                )
                cells.refuse(place, "object", f"{problem} mass or look count as different objects")
            known[key] = len(presented)
            presented.append(_present(cells, place, tools[name], *key[1:], materials))
        places.append(known[key])
    colours = {part.looks_like.colour for tool in presented for part in tool.components}
    if len(colours) > _MOST_COLOURS:
        problem = f"show {len(colours)} colours, must show at most {_MOST_COLOURS}"
        raise BadValueError(cells.path, "the objects", problem)
    return places, tuple(presented)


def _present(
    cells: Cells, place: int, tool: Tool, mass: float | None, look: str, materials: Mapping[str, Material]
) -> Tool:
    """Returns an object with the mass and look that a row gives; all its densities change by one factor."""
    parts = tool.components
    if mass is not None:
        factor = mass / tool.mass
        for part in parts:
            density = factor * part.material.density
            if not DENSITY_MIN <= density <= DENSITY_MAX:
                least, most = (bound / part.material.density * tool.mass for bound in (DENSITY_MIN, DENSITY_MAX))
                hint = f"; {1e-3 * mass:g} if g were meant" if least <= 1e-3 * mass <= most else ""
                hint = hint or f"; the nearest is {min(max(mass, least), most):.3g}"
                problem = f"gives {tool.name} a density of {density:.3g} kg/m^3, must be from {DENSITY_MIN:g} to"
                cells.refuse(place, "mass", f"is {mass:g} kg and {problem} {DENSITY_MAX:g}{hint}")
        parts = tuple(
            replace(part, material=replace(part.material, density=factor * part.material.density)) for part in parts
        )
    if look:
        if is_colour(look):
            shown = [replace(part.material, name=look, colour=parse_colour(look)) for part in parts]
        elif look in materials:
            shown = [materials[look]] * len(parts)
        else:
            cells.refuse(place, "looks_like", f"{describe_choice(look, materials)}; or a colour such as '#8c8c8c'")
        parts = tuple(replace(part, looks_like=each) for part, each in zip(parts, shown, strict=True))
    return replace(tool, components=parts)


def _is_carried(cell: str) -> bool:
    return len(cell) <= _LONGEST_CELL and not find_hidden(cell) and not is_formula(cell)


def check_cost(table: TrialTable, repeats: int, num_learners: int) -> None:
    """Raises a BadValueError if trials or holds would take more than some hours to compute."""
    trials, seconds = len(table.rows) * num_learners, float(table.rows["duration"].sum()) * num_learners
    most = min(
        REPEATS.high // len(table.participants),
        _MOST_LIFTS // trials,
        math.inf if seconds == 0.0 else int(_MOST_SECONDS / seconds),
    )
    if repeats > most:
        cost = f"{len(table.rows)} trials, {seconds / num_learners:g} s of holds and {num_learners} learners"
        if most == 0:
            raise BadValueError(table.source, "", f"has {cost}, which take too long, must be several tables")
        raise BadValueError(
            "--repeats", "", f"is {repeats}, must be at most {most} with {cost}; the nearest is {most}"
        )
