import pickle

import numpy as np
import pytest

from affordance.exceptions import (
    PROSE,
    AffordanceError,
    BadValueError,
    HiddenPartError,
    ModelFileError,
    NoDepthError,
    NoFitError,
    NoPlanError,
    NothingSeenError,
    OneColourError,
    OutOfViewError,
    SeeingError,
    StallError,
    TooSmallError,
    UnusablePictureError,
    describe_choice,
    find_hidden,
    name_gripped,
    show_text,
)


def test_every_error_of_seeing_is_one_to_be_caught():
    of_seeing = (UnusablePictureError, NoDepthError, OneColourError, NothingSeenError, OutOfViewError, TooSmallError)
    assert all(issubclass(error, SeeingError) for error in (*of_seeing, HiddenPartError, NoFitError))


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (
            BadValueError("a.yaml", "tools[0].name", "is\n3,  must be a text"),
            "a.yaml: tools[0].name: is 3, must be a text",
        ),
        (BadValueError("--jobs", "", "is 0"), "--jobs: is 0"),
        (
            NoPlanError(0.2, "point 2 of 4"),
            "no plan keeps the joints' position and velocity limits at t = 0.200 s, near point 2 of 4",
        ),
        (
            StallError("stick", 0.91234, 200_000, (("tool", "nail"),)),
            "the simulated blow with the stick stalls at t = 0.9123 s with tool on nail, must take at most 200000 "
            "steps",
        ),
        (ModelFileError("arm.sdf", "line 1\n  line 2"), "arm.sdf: line 1 line 2"),
    ],
)
def test_errors_are_one_line_and_cross_processes(error, text):
    assert str(error) == text
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == text


def test_what_a_file_holds_neither_steers_the_terminal_nor_fills_it():
    error = BadValueError("a.yaml", "\x1b[2Jname\x00", "x" * 100_000 + " the end")
    assert str(error).startswith("a.yaml: \ufffd[2Jname\ufffd: xxx")
    assert str(error).endswith("xx the end")
    assert len(str(error)) < 2100
    assert "\n" not in str(AffordanceError("one\ntwo\x1b"))
    assert len(describe_choice("y" * 100_000, ["yes"])) < 200


def test_error_of_seeing_carries_its_picture_and_where_it_was_saved():
    error = TooSmallError("a part  covers\n3 pixels", np.ones((2, 2, 3), dtype=np.uint8), np.zeros((2, 2)), "a/b.npz")
    again = pickle.loads(pickle.dumps(error))
    assert isinstance(again, SeeingError)
    assert str(again) == "a part covers 3 pixels (picture saved as a/b.npz)"
    np.testing.assert_array_equal(again.colour, error.colour)


@pytest.mark.parametrize("hidden", ["\x00", "\x1b", "\r", "\x9b", "\u202e", "\u200b", "\ue000", "\ud800", "\u2028"])
def test_characters_that_are_not_seen_are_found_and_replaced(hidden):
    for text in (hidden, f"oak{hidden}bar", f"Müller{hidden}"):
        assert find_hidden(text) == find_hidden(text, PROSE) == f"the hidden character U+{ord(hidden):04X}"
        assert show_text(text, PROSE) == text.replace(hidden, "\ufffd")


@pytest.mark.parametrize(
    "name", ["oak bar #2", "Müller", "Mu\u0308ller", "樫の棒", "дуб", "עֵץ", "تفاح", "½ µm·²", "木 🔨", ""]
)
def test_names_in_any_script_are_seen(name):
    assert find_hidden(name) == ""
    assert show_text(name) == name


def test_prose_may_have_lines_and_spaces():
    assert find_hidden("a\nb\tc\u00a0d", PROSE) == ""
    assert find_hidden("a\nb") == "the hidden character U+000A"
    assert find_hidden("a\u00a0b") == "the hidden character U+00A0"


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("mallet by head", "the mallet by its head"),
        ("mallet by choked", "the mallet choked"),
        ("my hammer by handle", "my hammer by its handle"),
        ("mallet", "the mallet"),
    ],
)
def test_an_option_is_named_as_in_a_sentence(option, said):
    assert name_gripped(option) == said
