"""Claims as data: comparisons, lists, expressions, and how what was found is shown."""

import numpy as np
import pytest

from affordance.exceptions import AffordanceError
from affordance.reporting.claims import COMPARISONS, FUNCTIONS, Claim, Criterion, evaluate, judge_claims


def judge(value, bounds, numbers, **shown):
    """Judges a claim of one criterion."""
    claim = Claim("key", "ours", "It is so.", (Criterion("the value", value, bounds, **shown),))
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


@pytest.mark.parametrize(("values", "met"), [([1.0, 2.0, 3.0], True), ([1.0, 5.0, 3.0], False), ([], True)])
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


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("x[-1] / x[0]", 4.0),
        ("x[1:] / x[:-1]", [2.0, 2.0]),
        ("abs(-x)", [1.0, 2.0, 4.0]),
        ("diff(x)", [1.0, 2.0]),
        ("max(x) - min(x) - ptp(x)", 0.0),
        ("mean(x) * len(x) - sum(x)", 0.0),
        ("maximum(x, 2)", [2.0, 2.0, 4.0]),
        ("minimum(x, 2)", [1.0, 2.0, 2.0]),
        ("sqrt(x[2]) + log(x[0])", 2.0),
        ("values(named)", [3.0, 5.0]),
        ("named['a']", 3.0),
        ("all(x > 0) and not any(x > 4)", True),
        ("x[0] if x[0] > 2 else x[1]", 2.0),
        (0.25, 0.25),
        (True, True),
    ],
)
def test_expression_over_numbers(expression, expected):
    found = evaluate(expression, {"x": [1.0, 2.0, 4.0], "named": {"a": 3.0, "b": 5.0}})
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_every_function_is_tested():
    assert set(FUNCTIONS) == {
        *(
            "abs",
            "all",
            "any",
            "diff",
            "len",
            "log",
            "max",
            "maximum",
            "mean",
            "min",
            "minimum",
            "ptp",
            "sqrt",
            "sum",
        ),
        "values",
    }


@pytest.mark.parametrize(
    "expression",
    [
        "nope",
        "nope[0]",
        "x[9]",
        "x +",
        "",
        "1 / 0",
        "x + 'text'",
        "median(x)",
        "x.tofile('victim')",
        "x.mean()",
        "x.__class__",
        "open('victim', 'w')",
        "__import__('os')",
        "[y for y in x]",
        "9 ** 9 ** 9",
        "'a' * 10 ** 9",
    ],
)
def test_what_cannot_or_must_not_be_evaluated_is_one_line(tmp_path, monkeypatch, expression):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AffordanceError, match=r"^the expression .* cannot be evaluated: ") as caught:
        evaluate(expression, {"x": [1.0, 2.0]})
    assert repr(expression) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("bounds", "named"), [({}, "nothing"), ({"at_leats": 1.0, "above": 0.0}, "at_leats")])
def test_unknown_comparison_is_named_with_those_there_are(bounds, named):
    with pytest.raises(AffordanceError, match=f"the claim key compares by {named}, must be one of above, at_least"):
        judge("x", bounds, {"x": 2.0})


def test_claim_is_met_if_all_its_criteria_are():
    criteria = (Criterion("one", "x", {"above": 1.0}), Criterion("other", "y", {"above": 1.0}))
    claims = [Claim("first", "paper", "Both.", criteria), Claim("second", "ours", "One.", criteria[:1])]
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
