"""Names from files: one line of characters that are seen."""

from pathlib import Path
from typing import Annotated

import pytest
from helpers.refusals import refuse
from pydantic import TypeAdapter, ValidationError

from affordance.exceptions import BadArgumentError
from affordance.files.constraints import Length, Name, OneLine, Whole, Within, check_names, run_check

_BAD = {
    "": "is '', must be a non-empty text",
    " ": "is ' ', must be a non-empty text",
    "n" * 201: "has 201 characters, must have at most 200",
    "a\nb": "is 'a\\nb', must be without the hidden character U+000A",
    "\u202eb": "is '\\u202eb', must be without the hidden character U+202E",
}


@pytest.mark.parametrize("name", _BAD)
def test_a_name_is_one_line_of_characters_that_are_seen(name):
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(Name).validate_python(name)
    assert _BAD[name] in str(caught.value)
    assert TypeAdapter(Name).validate_python("Müller's oak bar") == "Müller's oak bar"


def test_a_longer_bound_may_be_chosen():
    assert len(TypeAdapter(Annotated[str, OneLine(500)]).validate_python("n" * 500)) == 500


def test_names_of_a_file_are_checked_but_for_empty_ones():
    check_names(Path("run.csv"), "columns", ["time", "", "q_1"])
    message = "run.csv: columns: is 'q\\x1b[2J', must be without the hidden character U+001B"
    assert refuse(check_names, Path("run.csv"), "columns", ["time", "q\x1b[2J"]) == message


@pytest.mark.parametrize("value", [10**400, -(10**400)])
@pytest.mark.parametrize("bound", [Within(0.0, 1.0), Within(), Length(1e-4, 1.0), Whole(1, 9), Whole()])
def test_integers_beyond_all_doubles_are_refused(bound, value):
    with pytest.raises(BadArgumentError, match=r"must be (from|finite|at least)"):
        run_check("number", bound.check, value)


def test_not_a_number_has_no_nearest_whole_number():
    with pytest.raises(BadArgumentError, match=r"is nan, must be from 1 to 9$"):
        run_check("number", Whole(1, 9).check, float("nan"))
