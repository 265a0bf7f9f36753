import numpy as np
import pytest

from affordance.reporting.formatting import (
    break_line,
    count_observers,
    fold,
    format_beside,
    format_duration,
    format_number,
    label,
    tabulate,
    tabulate_within,
)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0"),
        (2, "2.00"),
        (12.345, "12.3"),
        (-12.345, "-12.3"),
        (100.4, "100"),
        (8512.0, "8512"),
        (0.0123456, "0.0123"),
        (-0.05, "-0.0500"),
        (0.99999, "1.00"),  # not 1.000
        (9.996, "10.0"),
        (1e-4, "0.000100"),
        (9.99e-5, "9.99 × 10^-5"),
        (999_999.0, "999999"),
        (1e6, "1.00 × 10^6"),
        (-1_234_567.0, "-1.23 × 10^6"),
        (float("nan"), "undefined"),
        (float("inf"), "infinite"),
        (float("-inf"), "minus infinite"),
        (np.float64(0.25), "0.250"),
    ],
)
def test_number_has_three_significant_digits_and_an_exponent_where_it_needs_one(value, shown):
    assert format_number(value) == shown


def test_number_of_digits_can_be_chosen():
    assert [format_number(0.0123456, digits) for digits in (1, 2, 5)] == ["0.01", "0.012", "0.012346"]


def test_number_as_shown_is_the_number_to_its_digits(rng):
    for value in 10.0 ** rng.uniform(-4.0, 6.0, 500) * rng.choice([-1.0, 1.0], 500):
        assert float(format_number(value)) == pytest.approx(value, rel=0.51e-2)


@pytest.mark.parametrize(
    ("value", "shown"),
    [(10.02, "10.02"), (9.98, "9.98"), (9.9996, "9.9996"), (10.0, "10.0"), (12.34, "12.3"), (1.26, "1.3")],
)
def test_number_is_seen_on_its_side_of_a_bound(value, shown):
    assert format_beside(value, 10.0) == shown


def test_number_without_a_finite_bound_has_the_decimals_that_are_asked_for():
    assert format_beside(3.14159, np.inf, 2) == "3.14"
    assert format_beside(-0.0001, 0.4, 2) == "0.00"  # and no -0.00


def test_side_of_a_bound_is_seen_whatever_the_numbers(rng):
    for bound in rng.uniform(-20.0, 20.0, 50).round(2):
        for value in bound + rng.choice([-1.0, 1.0], 20) * 10.0 ** rng.uniform(-7.0, 1.0, 20):
            shown = float(format_beside(value, bound))
            assert (shown < bound, shown > bound) == (value < bound, value > bound)


def test_one_observer_is_one():
    assert [count_observers(num) for num in (0, 1, 2)] == ["0 observers", "1 observer", "2 observers"]


@pytest.mark.parametrize(
    ("text", "folded"),
    [
        ("held by steel", "held by steel"),
        ("held by the_painted_handle", "held by the_\npainted_handle"),
        ("abcdefghijklmnopqrstuvwxyz", "abcdefghijklmn\nopqrstuvwxyz"),
        ("", ""),
    ],
)
def test_names_are_folded_at_their_gaps(text, folded):
    assert fold(text) == folded


def test_no_line_is_too_long_and_no_letter_is_lost():
    text = "held by a_rather-long_handle of antidisestablishmentarianism_ and_x"
    lines = fold(text, 9).split("\n")
    assert max(map(len, lines)) <= 9
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")


def test_label_never_begins_with_an_underscore():
    assert label("_hidden") == " hidden"
    assert label("rod_10cm") == "rod 10cm"


def test_cells_of_a_table_neither_steer_the_terminal_nor_break_lines():
    rows = [["name", "kg"], ["\x1b[2Ja\nb", "1.0"], ["\u202eoak", "12.0"]]
    assert tabulate(rows, right=[1]) == ["name       kg", "\ufffd[2Ja\ufffdb   1.0", "\ufffdoak     12.0"]


ROWS = [["name", "kg", "why"], ["stick by steel", "1.0", "the lightest of all"], ["club", "12.0", "long"]]


def test_cells_are_broken_between_words_where_a_table_is_too_wide():
    assert tabulate(ROWS, right=[1], width=30) == [
        "name           kg  why",
        "stick by      1.0  the",
        "steel              lightest of",
        "                   all",
        "club         12.0  long",
    ]


@pytest.mark.parametrize("width", range(24, 60))
def test_table_fits_every_width_that_its_words_allow(width):
    lines = tabulate(ROWS, width=width)
    assert max(map(len, lines)) <= width
    assert sorted(" ".join(lines).split()) == sorted(word for row in ROWS for cell in row for word in cell.split())


def test_columns_that_matter_less_are_left_out_before_cells_are_broken():
    assert tabulate_within(ROWS, 30, [2]) == ["name            kg", "stick by steel  1.0", "club            12.0"]
    assert max(map(len, tabulate_within(ROWS, 12, [2]))) <= 12
    assert tabulate_within(ROWS, 0, [2]) == tabulate(ROWS)


@pytest.mark.parametrize(
    ("seconds", "shown"), [(0.4, "0 s"), (99.0, "99 s"), (101.0, "2 min"), (5400.0, "90 min"), (9000.0, "2.5 h")]
)
def test_duration_is_in_a_readable_unit(seconds, shown):
    assert format_duration(seconds) == shown


def test_line_is_broken_with_a_deeper_indent():
    assert break_line("  one two three", 9) == ["  one two", "    three"]
    assert break_line("one two three", 0) == ["one two three"]


def test_columns_stay_on_the_right_when_others_are_left_out():
    assert tabulate_within(ROWS, 0, [], left_out=[0], right=[1]) == [
        "  kg  why",
        " 1.0  the lightest of all",
        "12.0  long",
    ]
