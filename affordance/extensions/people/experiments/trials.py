"""Trial tables with one row per trial, in order, from a spreadsheet, another program or a function.

Only the column ``object`` is required. By default, all trials are lifts by one participant in one group, of objects
as defined in their file. Without a column ``phase``, the column ``block`` is used instead. Nothing in a table is
executed.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from affordance.arguments import REPEATS
from affordance.exceptions import BadValueError, describe_choice
from affordance.experiments.shared.holds import OWN_VALUES
from affordance.extensions.people.columns import TRIAL_COLUMNS
from affordance.extensions.people.experiments.trial_cells import (
    INDEX,
    Cells,
    check_cell,
    name_cells,
    read_cells,
    read_choices,
    read_names,
    read_numbers,
    read_truths,
    refuse_cell,
)
from affordance.objects.colour import is_colour, parse_colour
from affordance.objects.inertia import DENSITY_MAX, DENSITY_MIN
from affordance.objects.materials import Material
from affordance.objects.tool import Tool

# Kinds of trials: the object is lifted from a clamp, held in the hand, or only looked at; or a grip is chosen.
DOINGS = ("lift", "hold", "look", "choose")
DURATION = 3.0  # default duration of a hold, [s]
_LONGEST_HOLD = 60.0  # [s]
# Limits on run time and memory: a lift takes 2 ms, a simulated second of holding 0.05 s, a row of results 1 kB.
_MOST_LIFTS, _MOST_SECONDS = 1_000_000, 200_000.0
# Columns that the simulation adds to the table.
WRITTEN = (
    *("observer", "learner", "lift", "repeat", "size", "expected", "believed_density", "weight", "felt", "kind"),
    *("surprise", "moved", "chosen", "tool", "place", "block", "expected_by_look", "heaviness"),
)


class TrialTable(NamedTuple):
    """Checked table of trials.

    Attributes:
        rows: Columns of ``COLUMNS``, in SI units; index ``place`` of the participant; index ``tool`` of the presented
            object in ``tools``; and all other columns as strings.
        tools: Presented objects, with mass and appearance from the table.
        unused: Names of omitted columns, which have row numbers or names that are reserved for results.
        source: File of the table.
        numbers: Row number of each trial in the file.
    """

    rows: pd.DataFrame
    tools: tuple[Tool, ...]
    unused: tuple[str, ...]
    source: Path
    numbers: tuple[int, ...]

    @property
    def participants(self) -> list[str]:
        """Names of the participants, in order of first occurrence."""
        return list(dict.fromkeys(self.rows["participant"]))


def read_trials(
    path: Path,
    tools: Sequence[Tool],
    materials: Mapping[str, Material],
    *,
    columns: Mapping[str, str] = {},
    tasks: Collection[str] = (),
) -> TrialTable:
    """Reads a trial table from a file in the format of ``read_cells``, and checks it.

    Args:
        path: File of the table.
        tools: Objects that can be named in the table.
        materials: Materials that objects can look like, by name.
        columns: Names of columns in the file, by this program's names.
        tasks: Names of the tasks for which a grip can be chosen.

    Raises:
        BadValueError: The file cannot be read or is too large, or a cell is wrong. The message contains the column
            and the row number in a spreadsheet.
    """
    return _check(read_cells(path, TRIAL_COLUMNS, ["object"], columns), tools, materials, tasks)


def check_trials(
    frame: pd.DataFrame,
    tools: Sequence[Tool],
    materials: Mapping[str, Material] = {},
    *,
    tasks: Collection[str] = (),
    name: str = "trials",
) -> TrialTable:
    """Checks a table that was built in Python, as if it came from a file. In messages, the first trial is row 2."""
    texts = frame.astype(object).map(lambda cell: "" if pd.isna(cell) else str(cell)).to_numpy(object)
    table = pd.DataFrame([[str(each) for each in frame.columns], *texts])
    table.index += 1
    return _check(name_cells(Path(name), table, TRIAL_COLUMNS, ["object"], {}), tools, materials, tasks)


def _check(
    cells: Cells, tools: Sequence[Tool], materials: Mapping[str, Material], tasks: Collection[str]
) -> TrialTable:
    """Checks all cells, and builds the presented objects."""
    by_name = {tool.name: tool for tool in tools}
    rows = pd.DataFrame(
        {
            "participant": read_names(cells, "participant", "1"),
            "group": read_names(cells, "group", "all"),
            "phase": read_names(cells, "phase" if "phase" in cells.labels else "block", "all"),
            "cycle": read_numbers(cells, "cycle", 0, 1_000_000),
            "object": read_choices(cells, "object", by_name),
            "do": read_choices(cells, "do", DOINGS, "lift"),
            "task": read_names(cells, "task", ""),
            "duration": read_numbers(cells, "duration", 0.1, _LONGEST_HOLD, "s", "ms"),
            "mass": read_numbers(cells, "mass", 1e-3, 100.0, "kg", "g"),
            "looks_like": read_names(cells, "looks_like", ""),
            "teaches": read_truths(cells, "teaches"),
            "measured": read_truths(cells, "measured"),
            "force": read_numbers(cells, "force", -1e3, 1e3, "N", "mN"),
        }
    )
    _check_rows(cells, rows, by_name, tasks)
    rows["duration"] = rows["duration"].where(rows["duration"].notna() | (rows["do"] != "hold"), DURATION)
    rows["teaches"] &= rows["do"].isin(("lift", "hold"))
    rows["place"] = pd.factorize(rows["participant"])[0]
    counted = rows.groupby(["place", "phase", "object"], sort=False).cumcount() + 1
    rows["cycle"] = rows["cycle"].where(rows["cycle"].notna(), counted).astype(int)
    rows["tool"], presented = list_presented(cells, rows, by_name, materials)
    further = [name for name in cells.labels if name not in (*TRIAL_COLUMNS, "block")]
    taken = (INDEX, *WRITTEN, *(name for name in further if name.startswith(OWN_VALUES)))
    rows = rows.assign(**{name: cells.get(name) for name in further if name not in taken})
    unused = tuple(name for name in further if name in taken)
    return TrialTable(rows, presented, unused, cells.path, tuple(cells.texts.index))


def _check_rows(cells: Cells, rows: pd.DataFrame, tools: Mapping[str, Tool], tasks: Collection[str]) -> None:
    """Checks that the cells of each row are consistent, and that each participant is in one group."""
    given = {name: cells.get(name) for name in ("task", "duration", "force")}
    groups: dict[str, str] = {}
    for place, row in enumerate(rows.to_dict("records")):
        cycle, do, participant = row["cycle"], row["do"], row["participant"]
        if not (math.isnan(cycle) or cycle.is_integer()):
            refuse_cell(cells, place, "cycle", f"is {cycle:g}, must be a whole number; the nearest is {cycle:.0f}")
        if do == "choose" and row["task"] not in tasks:
            refuse_cell(cells, place, "task", describe_choice(row["task"], tasks))
        if do == "choose" and len(tools[row["object"]].grips) < 2:
            refuse_cell(
                cells, place, "object", f"is {row['object']!r}, which has fewer than two grips to choose from"
            )
        for name, only in (("task", "choose"), ("duration", "hold"), ("force", "lift")):
            if given[name][place] and do != only:
                refuse_cell(
                    cells, place, name, f"is {given[name][place]}, must be empty where do is {do!r}, not {only!r}"
                )
        if (known := groups.setdefault(participant, row["group"])) != row["group"]:
            problem = f"is {row['group']!r}, must be {known!r}, as in the rows above of participant {participant}"
            refuse_cell(cells, place, "group", problem)


def list_presented(
    cells: Cells, rows: pd.DataFrame, tools: Mapping[str, Tool], materials: Mapping[str, Material]
) -> tuple[pd.Series, tuple[Tool, ...]]:
    """Lists the presented objects, and the index of the object in each row.

    The columns ``mass`` (NaN for an unchanged mass) and ``looks_like`` modify the objects in the column ``object``.
    Each combination is listed once.
    """
    numbers = rows.fillna({"mass": 0.0}).groupby(["object", "mass", "looks_like"], sort=False).ngroup()
    firsts = np.unique(numbers, return_index=True)[1]
    return numbers, tuple(_present(cells, int(place), rows.iloc[place], tools, materials) for place in firsts)


def _present(
    cells: Cells, place: int, row: pd.Series, tools: Mapping[str, Tool], materials: Mapping[str, Material]
) -> Tool:
    """Builds an object with the mass and appearance of a row. All densities are scaled by the same factor."""
    tool, mass, look = tools[row["object"]], row["mass"], row["looks_like"]
    parts = tool.components
    if not math.isnan(mass):
        densities = [part.material.density for part in parts]
        least, most = DENSITY_MIN / min(densities) * tool.mass, DENSITY_MAX / max(densities) * tool.mass
        unit = f"kg for {tool.name} to have a density from {DENSITY_MIN:g} to {DENSITY_MAX:g} kg/m^3"
        check_cell(cells, place, "mass", mass, least, most, unit, "g")
        factor = mass / tool.mass
        parts = tuple(
            replace(part, material=replace(part.material, density=factor * part.material.density)) for part in parts
        )
    if is_colour(look):
        shown = [replace(part.material, name=look, colour=parse_colour(look)) for part in parts]
        parts = tuple(replace(part, looks_like=each) for part, each in zip(parts, shown, strict=True))
    elif look:
        if look not in materials:
            refuse_cell(
                cells, place, "looks_like", f"{describe_choice(look, materials)}; or a colour such as '#8c8c8c'"
            )
        parts = tuple(replace(part, looks_like=materials[look]) for part in parts)
    return replace(tool, components=parts)


def check_cost(table: TrialTable, repeats: int, num_learners: int) -> None:
    """Checks the run time of all trials and holds. A BadValueError is raised if it would be too long."""
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
