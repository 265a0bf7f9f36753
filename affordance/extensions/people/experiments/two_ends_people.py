"""Reads people's answers in the experiment ``two_ends`` from a filled data sheet.

The result has the columns of simulated choices, so ``two_ends.measure`` and ``two_ends.contrast`` take both.
"""

from pathlib import Path

import pandas as pd

from affordance.extensions.people.experiments.trial_cells import Cells
from affordance.extensions.people.experiments.two_ends_design import build_data_sheet
from affordance.extensions.people.reporting.lift_means import PEOPLE

_SIDES = ("left", "right")
# Columns that describe the trial; they must be as registered.
_REGISTERED = ("group", "phase", "object", "do", "task", "dense_end_is")


def read_choices(path: Path) -> pd.DataFrame:
    """Reads the choices of a filled data sheet; returns a row for each answer.

    Rows may be in any order, and participants may be missing. Choices without an answer are left out. The column
    ``observer`` numbers the participants in the order of the sheet.

    Args:
        path: Filled data sheet, with commas, semicolons or tabs between the cells.

    Raises:
        BadValueError: The sheet cannot be read, or a cell is wrong: a trial is not registered, occurs twice or was
            changed, or an answer is neither left nor right.
    """
    sheet = build_data_sheet()
    cells = Cells.read(path, [str(each) for each in sheet], None)
    for needed in ("participant", "trial", "chosen_end"):
        if needed not in cells.labels:
            cells.refuse(0, needed, "is missing; the sheet must have this column")
    participants = cells.read_choices("participant", list(dict.fromkeys(sheet["participant"])))
    most = int(sheet["trial"].max())
    trials = cells.read_numbers("trial", 1, most)
    ends = cells.read_choices("chosen_end", (*_SIDES, "none"), default="none")
    cells.read_numbers("push_N", 0.0, 1e3, "N", "mN")
    cells.read_numbers("response_time", 0.0, 3600.0, "s", "ms")
    records = [{str(name): str(value) for name, value in each.items()} for each in sheet.to_dict("records")]
    registered = {(each["participant"], int(each["trial"])): each for each in records}
    rows, seen = [], dict[tuple[str, int], int]()
    for place, (participant, trial, end) in enumerate(zip(participants, trials, ends, strict=True)):
        if trial != trial or trial % 1.0:
            cells.refuse(place, "trial", f"must be a whole number from 1 to {most}")
        key = (participant, int(trial))
        if key in seen:
            cells.refuse(place, "trial", f"is {int(trial)}, as in row {cells.numbers[seen[key]]}; must be there once")
        seen[key] = place
        row = registered[key]
        for column in _REGISTERED:
            if column in cells.labels and cells[column][place] != row[column]:
                problem = f"is {cells[column][place]!r}, must be {row[column]!r}, as it was registered"
                cells.refuse(place, column, problem)
        if end == "none":
            continue
        if row["do"] != "choose":
            cells.refuse(place, "chosen_end", f"is {end!r}, must be empty, as nothing is chosen in a lift")
        chosen = "dense" if end == row["dense_end_is"] else "light"
        rows.append((participant, int(row["phase"].removeprefix("after ")), row["task"], chosen))
    if not rows:
        cells.refuse(0, "chosen_end", "is empty in all rows, must have an answer in some")
    choices = pd.DataFrame(rows, columns=["participant", "lifts", "task", "chosen"])
    choices["right"] = choices["chosen"] == choices["task"].map({"reach": "dense", "hammer": "light"})
    return choices.assign(learner=PEOPLE, observer=pd.factorize(choices["participant"])[0])
