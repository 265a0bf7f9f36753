"""Filled data sheets: a sheet filled by hand gives the shares it was filled with; a wrong cell is one line."""

import pytest
from helpers.refusals import refuse

from affordance.extensions.people.experiments import two_ends, two_ends_design
from affordance.extensions.people.experiments.two_ends_people import read_choices


def fill():
    """A sheet whose participants always point to the dense end, as text."""
    sheet = two_ends_design.build_data_sheet().astype(str)
    sheet["chosen_end"] = sheet["dense_end_is"]
    return sheet


def write(sheet, folder):
    sheet.to_csv(folder / "sheet.csv", index=False)
    return folder / "sheet.csv"


def test_who_points_to_the_dense_end_is_right_to_reach_and_wrong_to_hit(tmp_path):
    choices = read_choices(write(fill(), tmp_path))
    shares = two_ends.measure(choices).set_index(["measure", "lifts"])
    assert len(choices) == 48 * 8
    assert shares.loc["reach", "share"].tolist() == [1.0] * 4
    assert shares.loc["hammer", "share"].tolist() == shares.loc["agree", "share"].tolist() == [0.0] * 4
    assert (shares["observers"] == 48).all()
    assert two_ends.tabulate(two_ends.measure(choices)).index[0] == "people"
    least = two_ends.contrast(two_ends.measure(choices)).iloc[0]
    assert (least["one"], least["other"], least["people"]) == ("people", "chance", 5)


def test_missing_answers_and_participants_are_left_out(tmp_path):
    """P01 has no answer to the first question, to hit after 0 lifts; P03 and later did not come."""
    sheet = fill()
    sheet.loc[0, "chosen_end"] = ""
    path = write(sheet[sheet["participant"] < "P03"].sample(frac=1.0, random_state=0), tmp_path)
    counts = two_ends.measure(read_choices(path)).set_index(["measure", "lifts"])["observers"]
    assert sheet.loc[0, "task"] == "hammer"
    assert (counts["reach", 0], counts["hammer", 0], counts["agree", 0], counts["agree", 1]) == (2, 1, 1, 2)


@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("chosen_end", "middle", "row 2, chosen_end: is 'middle', must be one of left, right"),
        ("participant", "P49", "row 2, participant: is 'P49', must be one of P01"),
        ("trial", "15", "row 2, trial: is 15, must be from 1 to 14; the nearest is 14"),
        ("trial", "1.5", "row 2, trial: must be a whole number from 1 to 14"),
        ("trial", "2", "row 3, trial: is 2, as in row 2; must be there once"),
        ("dense_end_is", "right", "row 2, dense_end_is: is 'right', must be 'left', as it was registered"),
        ("response_time", "-1", "row 2, response_time: is -1, must be from 0 to 3600 s; the nearest is 0"),
        ("response_time", "850 ms", "row 2, response_time: is '850 ms', must be a number of s; 0.85 would be one"),
    ],
)
def test_a_wrong_cell_is_named(tmp_path, column, value, said):
    sheet = fill()
    sheet.loc[0, column] = value
    if column == "trial":
        sheet = sheet.drop(columns=["task", "dense_end_is"])
    assert said in refuse(read_choices, write(sheet, tmp_path))


def test_a_lift_has_no_answer_and_an_empty_sheet_none(tmp_path):
    sheet = fill()
    sheet.loc[2, "chosen_end"] = "left"
    assert "row 4, chosen_end: is 'left', must be empty" in refuse(read_choices, write(sheet, tmp_path))
    empty = write(two_ends_design.build_data_sheet(), tmp_path)
    assert "chosen_end: is empty in all rows" in refuse(read_choices, empty)
    missing = write(fill().drop(columns="chosen_end"), tmp_path)
    assert "chosen_end: is missing" in refuse(read_choices, missing)
    named = write(fill().rename(columns={"participant": "subject"}), tmp_path)
    said = refuse(read_choices, named)
    assert said.endswith("row 1: is 'subject'; did you mean 'participant'? Then name it so")
