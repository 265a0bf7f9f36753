"""Export of trial tables to PsychoPy, jsPsych and BIDS.

Texts of a table are shown on the screen and never executed. All formats keep the names of columns, so that recorded
data can be read again.
"""

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import pandas as pd

from affordance.exceptions import BadValueError
from affordance.extensions.people.experiments.trials import TrialTable
from affordance.files.atomic import write_text
from affordance.files.template import render_template

_PACKAGE = "affordance.extensions.people"
# Columns that are written even if they are redundant.
_ALWAYS = ("participant", "trial", "group", "phase", "cycle", "object", "do")
# Description and unit of each column in BIDS.
_DESCRIPTIONS: Mapping[str, tuple[str, str]] = {
    "participant": ("Name of the participant in the table of trials", ""),
    "trial": ("Number of the trial of this participant, from 1", ""),
    "group": ("Group of the participant", ""),
    "phase": ("Phase of the experiment", ""),
    "cycle": ("Number of the repetition of this object within the phase", ""),
    "object": ("Object that is presented", ""),
    "do": ("What the participant does with it: lift, hold, look or choose", ""),
    "task": ("Task for which a grip is chosen", ""),
    "options": ("Grips to choose from, separated by |", ""),
    "duration": ("Duration of a hold", "s"),
    "mass": ("Mass of the object", "kg"),
    "looks_like": ("Material or colour that the object looks like", ""),
    "teaches": ("Whether the participant feels the object", ""),
    "measured": ("Whether the trial counts in means", ""),
    "force": ("Upward force before the release of a lift", "N"),
    "chosen": ("Grip that was chosen", ""),
    "response_time": ("Time from the prompt to the response", "s"),
}
# Columns with data recorded during the experiment.
RECORDED = ("force", "chosen", "response_time")


def list_trials(table: TrialTable) -> pd.DataFrame:
    """Lists trials as strings, without empty or redundant columns."""
    rows = table.rows.drop(columns=["place", "tool", "trial", "options", *RECORDED], errors="ignore")
    rows.insert(1, "trial", rows.groupby("participant").cumcount() + 1)
    for name in ("teaches", "measured"):
        plain = rows["do"].isin(("lift", "hold")) if name == "teaches" else True
        rows[name] = rows[name].map({True: "yes", False: "no"}) if (rows[name] != plain).any() else ""
    chooses = rows["do"] == "choose"
    grips = [" | ".join(grip.name for grip in table.tools[tool].grips) for tool in table.rows["tool"]]
    rows.insert(list(rows).index("task") + 1, "options", pd.Series(grips).where(chooses, ""))
    for name in ("duration", "mass"):
        rows[name] = rows[name].map("{:.15g}".format).where(rows[name].notna(), "")
    texts = rows.astype(str)
    return texts[[name for name in texts if name in _ALWAYS or (texts[name] != "").any()]]


def write_psychopy(table: TrialTable, folder: Path) -> str:
    """Writes a PsychoPy conditions file and a script that runs it, and returns instructions.

    Raises:
        BadValueError: The name of a column is not allowed in PsychoPy, or a cell in brackets would be executed.
    """
    trials, name = list_trials(table), table.source.stem
    for column in map(str, trials):
        if not re.fullmatch(r"[A-Za-z]\w*", column, re.ASCII):
            problem = f"is {column!r}, must be letters, digits and '_' for PsychoPy, a letter first"
            raise BadValueError(table.source, "row 1", problem)
        for row, cell in zip(table.numbers, trials[column], strict=True):
            if cell.startswith("[") and cell.endswith("]"):
                raise BadValueError(
                    table.source, f"row {row}, {column}", f"is {cell!r}, which PsychoPy would execute; omit brackets"
                )
    write_text(folder / f"{name}.csv", trials.to_csv(index=False, lineterminator="\n"))
    write_text(folder / f"{name}.py", render_template(_PACKAGE, "psychopy.py.j2", escapes=False))
    return f"python {folder / name}.py, with PsychoPy; {name}.csv is also a conditions file of its Builder"


def write_jspsych(table: TrialTable, folder: Path) -> str:
    """Writes a web page with a jsPsych timeline for each participant, and returns instructions."""
    name, people = table.source.stem, {}
    for participant, own in list_trials(table).groupby("participant", sort=False):
        people[str(participant)] = [
            {key: text for key, text in row.items() if text} for row in own.to_dict("records")
        ]
    page = render_template(_PACKAGE, "jspsych.html.j2", escapes=True, title=name, people=people)
    write_text(folder / f"{name}.html", page)
    return f"open {folder / name}.html in a browser; the files of jsPsych 7 or 8 must be in {folder / 'jspsych'}"


def write_bids(table: TrialTable, folder: Path) -> str:
    """Writes an empty BIDS data set: one ``_beh.tsv`` for each participant, and one ``_beh.json``.

    Raises:
        BadValueError: Two names of participants have the same letters and digits, or a name has none.
    """
    trials, task = list_trials(table), re.sub(r"[^A-Za-z0-9]", "", table.source.stem) or "lift"
    labels: dict[str, str] = {}
    for name in table.participants:
        label = f"sub-{re.sub(r'[^A-Za-z0-9]', '', name)}"
        if label == "sub-" or label in labels.values():
            problem = f"has {name!r}, which BIDS would call {label!r}; BIDS labels must be different"
            raise BadValueError(table.source, "participant", problem)
        labels[name] = label
    recorded = [each for each in RECORDED if each != "chosen" or (trials["do"] == "choose").any()]
    trials = trials.assign(**dict.fromkeys(recorded, ""))
    for name, label in labels.items():
        text = (
            trials[trials["participant"] == name]
            .replace("", "n/a")
            .to_csv(sep="\t", index=False, lineterminator="\n")
        )
        write_text(folder / label / "beh" / f"{label}_task-{task}_beh.tsv", text)
    described: dict[str, dict[str, str]] = {}
    for column in map(str, trials):
        meaning, unit = _DESCRIPTIONS.get(column, ("Further column of the table of trials", ""))
        described[column] = {"Description": meaning, **({"Units": unit} if unit else {})}
    first = trials.drop_duplicates("participant")
    people = pd.DataFrame({"participant_id": first["participant"].map(labels), "group": first["group"]})
    write_text(folder / "participants.tsv", people.to_csv(sep="\t", index=False, lineterminator="\n"))
    files = {
        f"task-{task}_beh.json": {"TaskName": table.source.stem, **described},
        "dataset_description.json": {"Name": table.source.stem, "BIDSVersion": "1.9.0", "DatasetType": "raw"},
    }
    for file, content in files.items():
        write_text(folder / file, json.dumps(content, indent=2, ensure_ascii=False) + "\n")
    return f"{folder} is a BIDS data set; fill in the columns {', '.join(recorded)}"


# Functions that write a table to a folder, by name of the format.
FORMATS: Mapping[str, Callable[[TrialTable, Path], str]] = {
    "psychopy": write_psychopy,
    "jspsych": write_jspsych,
    "bids": write_bids,
}
