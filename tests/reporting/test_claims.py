"""Claims as data: comparisons, lists, and the display of values."""

import numpy as np
import pytest

from affordance.exceptions import AffordanceError
from affordance.reporting.claims import COMPARISONS, Claim, ClaimCriterion, judge_claims


def judge(value, bounds, numbers, **shown):
    """Judges a claim of one criterion."""
    claim = Claim(
        key="key",
        source="ours",
        text="It is so.",
        criteria=[ClaimCriterion(name="the value", value=value, **bounds, **shown)],
    )
    (result,) = judge_claims([claim], numbers)
    assert (result.key, result.source, result.text) == ("key", "ours", "It is so.")
    (criterion,) = result.criteria
    assert result.met == criterion.met
    assert type(result.met) is bool  # not NumPy's: it goes into a file
    return criterion


@pytest.mark.parametrize(
    ("how", "met"),
    [
        ("above", (False, False, True)),
        ("at_least", (False, True, True)),
        ("at_most", (True, True, False)),
        ("below", (True, False, False)),
        ("is", (False, True, False)),
    ],
)
def test_every_comparison_below_at_and_above_the_bound(how, met):
    assert tuple(judge("x", {how: 2.0}, {"x": x}).met for x in (1.9, 2.0, 2.1)) == met


def test_every_comparison_is_tested():
    assert set(COMPARISONS) == {"above", "at_least", "at_most", "below", "is"}


def test_two_bounds_must_both_be_met():
    bounds = {"at_least": 0.85, "at_most": 0.95}
    assert [judge("x", bounds, {"x": x}).met for x in (0.84, 0.85, 0.9, 0.95, 0.96)] == [
        False,
        True,
        True,
        True,
        False,
    ]


@pytest.mark.parametrize(("values", "met"), [([1.0, 2.0, 3.0], True), ([1.0, 5.0, 3.0], False), ([], False)])
def test_every_entry_of_a_list_must_meet_the_bound(values, met):
    assert judge("x", {"below": 4.0}, {"x": values}).met is met


def test_list_is_compared_with_a_list_entry_by_entry():
    numbers = {"x": [1.0, 2.0, 3.0], "y": [2.0, 3.0, 4.0]}
    assert judge("x", {"below": "y"}, numbers).met
    assert not judge("x", {"below": "y"}, {**numbers, "y": [2.0, 3.0, 3.0]}).met


def test_texts_and_truths_are_compared_too():
    assert judge("grip", {"is": "other"}, {"grip": "wood", "other": "wood"}).met
    assert not judge("grip", {"is": "other"}, {"grip": "wood", "other": "steel"}).met
    assert judge("valid", {"is": True}, {"valid": True}).met
    assert not judge("valid", {"is": True}, {"valid": False}).met


@pytest.mark.parametrize("value", [None, float("nan")])
@pytest.mark.parametrize("how", COMPARISONS)
def test_number_that_is_missing_or_none_meets_nothing(value, how):
    assert not judge("x", {how: 1.0}, {"x": value}).met


@pytest.mark.parametrize("how", COMPARISONS)
def test_empty_list_meets_nothing(how):
    assert not judge("x", {how: 1.0}, {"x": []}).met
    assert not judge("y", {how: "x"}, {"x": [], "y": 1.0}).met
    assert judge("x", {how: 1.0}, {"x": []}).value == "none"


@pytest.mark.parametrize(
    ("value", "bounds"),
    [
        ("x / zero", {"above": 0}),
        ("x / zero", {"at_least": "x / zero"}),
        ("-x / zero", {"below": 0}),
        ("x", {"below": "x / zero"}),
        ("x", {"at_least": "log(zero)"}),
        ("log(zero)", {"at_most": 0}),
        ("minimum(x / zero, 5)", {"above": 4}),
        ("1 / (x / zero)", {"at_most": 0}),
        ("x / zero > 1", {"is": True}),
        ("some / zero > 1", {"is": True}),
        ("not (zero / zero > 1)", {"is": True}),
        ("two[0]", {"above": 0}),
        ("max(two)", {"above": 0}),
        ("all(none)", {"is": True}),
        ("not any(none)", {"is": True}),
        ("all(none > 1)", {"is": True}),
        ("sum(none)", {"at_most": 0}),
        ("max(none)", {"at_most": 0}),
        ("ptp(none)", {"at_most": 0}),
        ("1 if any(none) else 0", {"at_least": 0}),
    ],
)
@pytest.mark.parametrize("zero", [0.0, np.float64(0.0), 0])
def test_what_comes_of_no_number_meets_nothing(value, bounds, zero):
    """A division by zero or a list without entries never meets a claim, wherever it stands."""
    numbers = {"x": 3.0, "zero": zero, "some": [1.0, 2.0], "two": [np.inf, 1.0], "none": []}
    assert not judge(value, bounds, numbers).met


def test_part_that_is_not_taken_decides_nothing():
    numbers = {"x": 3.0, "zero": 0.0, "two": [np.inf, 1.0]}
    assert judge("x / zero if zero > 0 else x", {"at_least": 3.0}, numbers).met
    assert judge("two[1]", {"at_least": 1.0}, numbers).met


def test_claim_is_met_if_all_its_criteria_are():
    criteria = [ClaimCriterion(name="one", value="x", above=1.0), ClaimCriterion(name="other", value="y", above=1.0)]
    claims = [
        Claim(key="first", source="paper", text="Both.", criteria=criteria),
        Claim(key="second", source="ours", text="One.", criteria=criteria[:1]),
    ]
    for x, y in ((2.0, 2.0), (2.0, 0.0), (0.0, 2.0)):
        first, second = judge_claims(claims, {"x": x, "y": y})
        assert first.met == (x > 1.0 and y > 1.0)
        assert second.met == (x > 1.0)
        assert [each.met for each in first.criteria] == [x > 1.0, y > 1.0]


@pytest.mark.parametrize(
    ("value", "bounds", "shown", "value_shown", "bound_shown"),
    [
        (0.0612, {"at_most": 0.1}, {"unit": "%", "scale": 100, "digits": 1}, "6.1 %", "at most 10 %"),
        (0.10004, {"at_most": 0.1}, {"unit": "%", "scale": 100, "digits": 1}, "10.004 %", "at most 10 %"),
        (3.0, {"above": 1}, {}, "3.00", "above 1"),
        ([0.01, 0.02], {"below": 0.05}, {"unit": "cm", "scale": 100}, "1.00, 2.00 cm", "below 5 cm"),
        ([1.0, 2.0], {"above": "y"}, {}, "1.00, 2.00", "above 0.50, 0.60"),
        (0.9, {"at_least": 0.85, "at_most": 0.95}, {}, "0.90", "at least 0.85 and at most 0.95"),
        ("wood", {"is": "grip"}, {}, "wood", "steel"),
        (True, {"is": True}, {}, "yes", "yes"),
        (False, {"is": True}, {}, "no", "yes"),
        (None, {"above": 1.0}, {}, "none", "above 1"),
    ],
)
def test_what_was_found_is_shown_in_its_unit_beside_the_bound(value, bounds, shown, value_shown, bound_shown):
    criterion = judge("x", bounds, {"x": value, "y": [0.5, 0.6], "grip": "steel"}, **shown)
    assert (criterion.name, criterion.value, criterion.bound) == ("the value", value_shown, bound_shown)


@pytest.mark.parametrize(
    ("value", "bound"), [("x", "y"), ("x", "grip"), ("grip", 3), ("named", 1), ("named", "named"), ("x", "named")]
)
def test_what_cannot_be_compared_is_one_line(value, bound):
    numbers = {"x": [1.0, 2.0, 3.0], "y": [1.0, 2.0], "grip": "wood", "named": {"a": 1.0}}
    with pytest.raises(AffordanceError, match=r"the claim key cannot compare .* with its bound: ") as caught:
        judge(value, {"above": bound}, numbers)
    assert "\n" not in str(caught.value)


def test_long_lists_are_shown_by_their_beginning():
    criterion = judge("x", {"below": "y"}, {"x": np.zeros(100_000), "y": np.arange(1.0, 100_001.0)})
    assert criterion.met
    assert criterion.value.endswith("0.00, ... (100000 in all)")
    assert criterion.bound.endswith("100.00, ... (100000 in all)")
