"""Claims: comparisons, lists, and the display of values."""

import json

import numpy as np
import pytest
import xarray as xr

from affordance.reporting.claims import CM, COMPARISONS, MM, NONE, PERCENT, Unit, check, claim, confirm, with_interval

INFINITE, NAN = float("inf"), float("nan")


def judge(value, unit=NONE, **bounds):
    """Judges a claim of one criterion."""
    result = claim("key", "ours", "It is so.", check("the value", value, unit, **bounds))
    assert (result.key, result.source, result.text) == ("key", "ours", "It is so.")
    (criterion,) = result.criteria
    assert result.met == criterion.met
    assert type(result.met) is bool  # not NumPy's: it goes into a file
    json.dumps(result._asdict())
    return criterion


@pytest.mark.parametrize(
    ("how", "met"),
    [
        ("above", (False, False, True)),
        ("at_least", (False, True, True)),
        ("at_most", (True, True, False)),
        ("below", (True, False, False)),
    ],
)
def test_every_comparison_below_at_and_above_the_bound(how, met):
    assert tuple(judge(x, **{how: 2.0}).met for x in (1.9, 2.0, 2.1)) == met


def test_every_comparison_is_tested():
    assert set(COMPARISONS) == {"above", "at_least", "at_most", "below"}


def test_criterion_without_a_bound_or_with_another_is_a_mistake_of_the_program():
    for bounds in ({}, {"atleast": 1.0}):
        with pytest.raises(TypeError, match="must be among above, at_least, at_most, below"):
            judge(1.0, **bounds)


def test_two_bounds_must_both_be_met():
    bounds = {"at_least": 0.85, "at_most": 0.95}
    assert [judge(x, **bounds).met for x in (0.84, 0.85, 0.9, 0.95, 0.96)] == [False, True, True, True, False]


@pytest.mark.parametrize(("values", "met"), [([1.0, 2.0, 3.0], True), ([1.0, 5.0, 3.0], False), ([], False)])
def test_every_entry_of_a_list_must_meet_the_bound(values, met):
    for each in (values, np.array(values), xr.DataArray(values)):
        assert judge(each, below=4.0).met is met


def test_list_is_compared_with_a_list_entry_by_entry():
    assert judge([1.0, 2.0, 3.0], below=[2.0, 3.0, 4.0]).met
    assert not judge([1.0, 2.0, 3.0], below=[2.0, 3.0, 3.0]).met


@pytest.mark.parametrize("value", [NAN, INFINITE, -INFINITE, [INFINITE, 1.0], [1.0, NAN], []])
@pytest.mark.parametrize("how", COMPARISONS)
def test_what_is_no_finite_number_meets_nothing(value, how):
    assert not judge(value, **{how: np.ones(np.shape(value))}).met
    assert not judge(np.ones(np.shape(value)), **{how: value}).met


def test_truth_is_yes_or_no():
    for value, shown in ((True, "yes"), (np.bool_(False), "no")):
        result = claim("key", "ours", "It is so.", confirm("the value", value))
        assert (result.met, result.criteria) == (bool(value), (("the value", shown, "yes", bool(value)),))
        assert type(result.met) is bool


def test_claim_is_met_if_all_its_criteria_are():
    for x, y in ((2.0, 2.0), (2.0, 0.0), (0.0, 2.0)):
        one, other = check("one", x, above=1.0), check("other", y, above=1.0)
        both = claim("first", "paper", "Both.", one, other)
        assert both.met == (x > 1.0 and y > 1.0)
        assert claim("second", "ours", "One.", one).met == (x > 1.0)
        assert [each.met for each in both.criteria] == [x > 1.0, y > 1.0]


@pytest.mark.parametrize(
    ("value", "unit", "bounds", "value_shown", "bound_shown"),
    [
        (0.0612, PERCENT, {"at_most": 0.1}, "6.1 %", "at most 10 %"),
        (0.10004, PERCENT, {"at_most": 0.1}, "10.004 %", "at most 10 %"),
        (3.0, NONE, {"above": 1}, "3.00", "above 1"),
        ([0.01, 0.02], CM, {"below": 0.05}, "1.00, 2.00 cm", "below 5 cm"),
        (0.0042, MM, {"at_most": 0.01}, "4.20 mm", "at most 10 mm"),
        ([1.0, 2.0], NONE, {"above": np.array([0.5, 0.6])}, "1.00, 2.00", "above 0.50, 0.60"),
        (0.9, NONE, {"at_least": 0.85, "at_most": 0.95}, "0.90", "at least 0.85 and at most 0.95"),
        (120.4, Unit("ms", digits=0), {"at_most": 150}, "120 ms", "at most 150 ms"),
        ([], NONE, {"above": 1.0}, "none", "above 1"),
    ],
)
def test_what_was_found_is_shown_in_its_unit_beside_the_bound(value, unit, bounds, value_shown, bound_shown):
    criterion = judge(value, unit, **bounds)
    assert (criterion.name, criterion.value, criterion.bound) == ("the value", value_shown, bound_shown)


def test_long_lists_are_shown_by_their_beginning():
    criterion = judge(np.zeros(100_000), below=np.arange(1.0, 100_001.0))
    assert criterion.met
    assert criterion.value.endswith("0.00, ... (100000 in all)")
    assert criterion.bound.endswith("100.00, ... (100000 in all)")


def test_mean_comes_with_its_interval():
    """Of the numbers 1 and 3 the interval is 2 -+ 12.7062, Student's quantile with one degree of freedom."""
    numbers = with_interval("drop_m", xr.DataArray([[1.0, 5.0], [3.0, 5.0]], dims=("observer", "trial")))
    np.testing.assert_allclose(numbers["drop_m"], [2.0, 5.0])
    np.testing.assert_allclose(numbers["drop_m_ci95"], [[2.0 - 12.7062, 2.0 + 12.7062], [5.0, 5.0]], atol=1e-4)
