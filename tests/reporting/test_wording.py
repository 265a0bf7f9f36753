import pytest

from affordance.reporting.formatting import (
    count_observers,
    fold,
    introduce_observers,
    label,
    show_beside,
    warn_of_few_observers,
)


def test_one_observer_is_one():
    assert [count_observers(num) for num in (1, 2)] == ["1 observer", "2 observers"]
    assert introduce_observers(1, "hold", "holds") == "1 simulated observer holds"
    assert introduce_observers(20, "hold", "holds") == "20 simulated observers hold"


@pytest.mark.parametrize(("num", "warned"), [(1, True), (19, True), (20, False), (1000, False)])
def test_few_observers_are_warned_of(num, warned):
    assert bool(warn_of_few_observers(num)) == warned


@pytest.mark.parametrize(
    ("value", "shown"),
    [(10.02, "10.02"), (9.98, "9.98"), (9.9996, "9.9996"), (10.0, "10.0"), (12.34, "12.3"), (1.26, "1.3")],
)
def test_number_is_seen_on_its_side_of_a_bound(value, shown):
    assert show_beside(value, 10.0) == shown


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
    assert label("_hidden").removeprefix("\u200b") == "_hidden"
    assert not label("_hidden").startswith("_")
