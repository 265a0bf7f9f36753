"""Trial table and data sheet of the experiment ``two_ends``: what is frozen before anybody takes part."""

import hashlib

import numpy as np
import pandas as pd

PARTICIPANTS = 48  # six for each of the eight orders
COLOURS = {"blue": "#3f7fbf", "orange": "#c06a30"}  # either may be the colour of the dense material
ASKED = (0, 1, 2, 6)  # numbers of lifts after which an end is chosen for both tasks
TASKS = ("reach", "hammer")
SEED = 20261127  # of the trial table only
FROZEN = "af41ac041244c904c8506824be9db914c16e57dfe44a3e0b93c849ee0dcc8106"  # SHA-256 of the trial table as CSV
# Columns of the data sheet that the experimenter fills in.
FILLED_IN = ("chosen_end", "push_N", "response_time", "remark")  # response_time in seconds, as in BIDS
INSTRUCTIONS = {
    "": "Lift the object as in practice, and put it down.",
    "reach": "Point to the end, left or right, by which you would hold the stick to reach along the path with it.",
    "hammer": "Point to the end, left or right, by which you would hold the stick to hit the nail with it.",
}


def build_trials() -> pd.DataFrame:
    """Builds the trial table; dense colour, first object and first task are balanced, sides are random."""
    rng, tables = np.random.default_rng(SEED), []
    places = np.concatenate([rng.permutation(8) for _ in range(PARTICIPANTS // 8)])
    for participant, place in enumerate(places, start=1):
        dense, first, task = (
            list(each)[(place >> bit) % 2] for bit, each in enumerate((COLOURS, ("far", "near"), TASKS))
        )
        second = "near" if first == "far" else "far"
        rows: list[tuple[str, str, str, str]] = []
        for lifts in range(ASKED[-1] + 1):
            if lifts in ASKED:
                for number in range(2):
                    asked = TASKS[(TASKS.index(task) + number) % 2]
                    side = ("left", "right")[int(rng.integers(2))]
                    rows.append((f"after {lifts}", f"stick, {dense} dense", asked, side))
            if lifts < ASKED[-1]:
                rows.append(("lifts", f"{(first, second)[lifts % 2]}, {dense} dense", "", ""))
        table = pd.DataFrame(rows, columns=["phase", "object", "task", "dense_end_is"])
        table.insert(0, "participant", f"P{participant:02d}")
        table.insert(1, "group", f"{dense} dense")
        table.insert(4, "do", np.where(table["task"] == "", "lift", "choose"))
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def hash_trials(table: pd.DataFrame) -> str:
    """Computes the SHA-256 of a trial table, written as CSV with line feeds."""
    return hashlib.sha256(table.to_csv(index=False, lineterminator="\n").encode()).hexdigest()


def build_data_sheet() -> pd.DataFrame:
    """Builds the data sheet: numbered trials with an instruction, and empty columns to fill in."""
    table = build_trials()
    table.insert(1, "trial", table.groupby("participant").cumcount() + 1)
    table["instruction"] = table["task"].map(INSTRUCTIONS)
    return table.assign(**dict.fromkeys(FILLED_IN, ""))
