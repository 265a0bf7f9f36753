"""Numbers of every experiment are those that the suite keeps; ``make kept-numbers`` remakes them."""

import copy
import json
import math

import pytest
from helpers.shipped_runs import KEPT, NAMES, list_kept

# Kernels of another processor differ by some 1e-14. Contact amplifies this: a nail's travel differed by 2.1e-8 on
# another processor.
_TOLERANCE, _OF_BLOWS = 1e-9, 1e-7


def list_differences(found, kept, place="", tolerance=_TOLERANCE):
    """Lists the places of numbers that differ; those that are not whole may differ a little."""
    if isinstance(kept, dict) and isinstance(found, dict):
        pairs = {key: (found.get(key, "missing"), kept.get(key, "missing")) for key in {**found, **kept}}
    elif isinstance(kept, list) and isinstance(found, list) and len(kept) == len(found):
        pairs = dict(enumerate(zip(found, kept, strict=True)))
    else:
        close = type(found) is type(kept) is float and math.isclose(found, kept, rel_tol=tolerance)
        return [] if close or (type(found) is type(kept) and found == kept) else [f"{place}: {found}, kept {kept}"]
    return [
        line
        for key, (one, other) in pairs.items()
        for line in list_differences(one, other, f"{place}.{key}", tolerance)
    ]


@pytest.mark.parametrize("name", NAMES)
def test_numbers_and_verdicts_are_those_that_are_kept(get_shipped, name):
    kept = json.loads((KEPT / f"{name}.json").read_text(encoding="utf-8"))
    tolerance = _OF_BLOWS if name == "hammer" else _TOLERANCE
    assert list_differences(list_kept(get_shipped(name)), kept, tolerance=tolerance) == []


def test_every_experiment_has_kept_numbers_and_nothing_else_does():
    assert {path.stem for path in KEPT.iterdir()} == {*NAMES}


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("share", 0.5 * (1.0 + 2e-9), 1),
        ("share", 0.5 * (1.0 + 5e-10), 0),
        ("count", 4, 1),
        ("count", 3.0, 1),
        ("met", False, 1),
        ("met", 1, 1),
        ("list", [1.0], 1),
        ("list", [1.0, None], 1),
        ("list", [1.0, 2.1], 1),
        ("grip", "wood", 1),
        ("more", 0, 1),
        ("table", {}, 1),
    ],
)
def test_differences_are_found(key, value, said):
    kept = {"share": 0.5, "count": 3, "met": True, "list": [1.0, 2.0], "grip": "steel", "table": {"a": 1.0}}
    assert list_differences(copy.deepcopy(kept), kept) == []
    assert len(list_differences({**kept, key: value}, kept)) == said
