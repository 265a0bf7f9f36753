"""Expressions over numbers: their functions, and limits that keep them from doing anything else or taking long."""

import numpy as np
import pytest

from affordance.exceptions import AffordanceError
from affordance.reporting.expressions import FUNCTIONS, evaluate, find_names, parse_expression

NUMBERS = {
    "x": [1.0, 2.0],
    "y": [[1.0, 2.0, 3.0]],
    "table": np.ones((3, 1)),
    "deep": {"a": {"b": 1.0}},
    "grip": "wood",
    "nothing": None,
    "texts": ["x" * 5_000_000, "a", "b"],
}


VALID = [
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
]


@pytest.mark.parametrize(("expression", "expected"), VALID)
def test_expression_over_numbers(expression, expected):
    found = evaluate(expression, {"x": [1.0, 2.0, 4.0], "named": {"a": 3.0, "b": 5.0}})
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_every_function_is_tested():
    called = {name for name in FUNCTIONS if any(f"{name}(" in str(expression) for expression, _ in VALID)}
    assert called == set(FUNCTIONS)


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
        "2.0 ** 10 ** 10",
        "(0 - 1) ** 0.5 * 'x'",
        "'a' * 10 ** 9",
        "'%s' % x",
        "f'{x:>1000000000}'",
        "9" * 400,
        "x" + " + x" * 300,
        "-" * 900 + "1",
        "(" * 900,
        "[" * 900,
        "diff(x, 10**11)",
        "diff(x, n=10)",
        "max(x, 0)",
        "max(*x)",
        "maximum(x)",
        "sum()",
        "mx(x)",
        "len(3)",
        "values(x)",
        "values(deep)",
        "deep + 1",
        "deep['a'] + 1",
        "deep['c']",
        "grip[0]",
        "x[0.5]",
        "x['a']",
        "x[x]",
        "x[None]",
        "x[:, None]",
        "x[0:'a']",
        "x[...]",
        "table + x",
        "table - y",
        "range(10 ** 12)",
        "1 << 10 ** 10",
        "texts == texts",
        "x == grip",
        "nothing > 1",
        "x @ x",
        "x is x",
        "1 in x",
        "1j",
        "b'x'",
        "lambda: 0",
        "(y := 3)",
        "{'a': 1}",
        "[x] * 1000000000",
        "(x, x)",
        "not x",
        "x and x",
        "x\nimport os",
        "x\0",
        "'\\d' + x",
    ],
)
def test_what_cannot_or_must_not_be_evaluated_is_one_line(tmp_path, monkeypatch, expression):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AffordanceError, match=r"^the expression .* cannot be evaluated: ") as caught:
        evaluate(expression, NUMBERS)
    assert repr(expression)[:50] in str(caught.value)
    assert len(str(caught.value)) < 500
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_names_are_those_of_numbers():
    assert find_names("max(x[1:]) / named['a'] - (y if z > 2 else -x[0])") == {"x", "named", "y", "z"}
    assert find_names("max - max(x)") == {"max", "x"}
    assert find_names(3.0) == frozenset()


@pytest.mark.parametrize("expression", ["x.a", "open(x)", "diff(x, 2)", "x +", "[x]", "x" * 2000])
def test_what_an_expression_is_made_of_is_found_without_numbers(expression):
    with pytest.raises(AffordanceError, match=r"^the expression .* cannot be evaluated: "):
        parse_expression(expression)


def test_misspelt_functions_and_keys_are_answered_with_the_nearest():
    for expression, nearest in (("maximun(x, 1)", "maximum"), ("learners['densty']", "density")):
        with pytest.raises(AffordanceError, match=f"did you mean '{nearest}'"):
            evaluate(expression, {"x": 1.0, "learners": {"density": 1.0}})


def test_comparisons_chain_entry_by_entry_and_texts_are_compared():
    numbers = {"x": [1.0, 2.0, 3.0], "grips": ["a", "b"], "others": ["a", "c"]}
    np.testing.assert_array_equal(evaluate("1 < x <= 2", numbers), [False, True, False])
    np.testing.assert_array_equal(evaluate("grips != others", numbers), [False, True])
    assert evaluate("grips[0] == 'a' or x[0] > 9", numbers)


def test_whole_numbers_stay_exact_doubles():
    value = evaluate("x * x * x * x", {"x": 10**10})
    assert isinstance(value, float)
    assert value == 1e40
    assert evaluate("7 // 2 + 7 % 2 - 2 ** 2", {}) == 0


def test_of_nothing_there_is_no_mean():
    assert np.isnan(evaluate("mean(x)", {"x": []}))
