"""True features and features from pictures, side by side."""

import json

import pytest
from helpers.answers import answer
from helpers.results_files import OF_STUDY, read_numbers

from studies.side_by_side.sources import NAME

GOOD = {"density_median": [3000.0, 8500.0], "drop_m": [0.2, 0.01]}


def save(folder, source, numbers, *, experiment="weight", seed=0, repeats=2, inputs="as read"):
    """A finished run as far as it is read."""
    path = folder / experiment / "metrics.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    config = {"seed": seed, "settings": {"feature_source": source, "faults": {"bias_sd": 0.0}}}
    if experiment == "reach":
        config = {"experience": config}
    path.write_text(json.dumps({**numbers, "repeats": repeats, "inputs": inputs, "config": config}), encoding="utf-8")
    return path


def compare(out, status=0):
    return answer("study", "side_by_side", "--out", out / "one", "--pixels", out / "two", status=status).err


def read_section(out):
    return json.loads((out / "one" / NAME / "section.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("seen", "met", "shown"), [([3100.0, 8400.0], True, "3100, 8400"), ([3000.0, 7000.0], False, "3000, 7000")]
)
def test_both_sources_of_features_stand_side_by_side(tmp_path, seen, met, shown):
    save(tmp_path / "one", "features", GOOD)
    save(tmp_path / "two", "pixels", {**GOOD, "density_median": seen})
    compare(tmp_path)
    assert (tmp_path / "one" / NAME / "comparison.png").exists()
    section = read_section(tmp_path)
    (claim,), (table,) = section["claims"], section["tables"]
    assert claim["met"] is met
    assert [row[1:] for row in table["rows"][:2]] == [["features", "3000, 8500"], ["pixels", shown]]
    assert table["rows"][0][0] == "density believed, median (kg/m³)"
    assert "What pictures cost" in (tmp_path / "one" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"numbers": {**GOOD, "density_median": 7}}, "density_median is no list of numbers"),
        ({"numbers": {**GOOD, "density_median": []}}, "density_median is no list of numbers"),
        ({"numbers": {**GOOD, "density_median": [None, 1]}}, "density_median is no list of numbers"),
        ({"numbers": {**GOOD, "density_median": ["heavy"]}}, "could not convert"),
        ({"numbers": {**GOOD, "density_median": [10**400]}}, "too large"),
        ({"numbers": {"density_median": [1.0, 2.0]}}, "'drop_m'"),
        ({"numbers": {**GOOD, "density_median": [1.0, 2.0, 3.0]}}, "has 3 entries of density_median, must have 2"),
        ({"source": "features"}, "its features are features, not pixels"),
        ({"seed": 1}, "seed: is 1, must be 0 as in"),
        ({"repeats": 20}, "repeats: is 20, must be 2 as in"),
        ({"inputs": "others"}, "inputs: is 'others', must be 'as read' as in"),
        ({"experiment": "com"}, "which holds no experiment of"),
    ],
)
def test_runs_that_cannot_be_compared_are_refused(tmp_path, changes, problem):
    save(tmp_path / "one", "features", GOOD)
    save(tmp_path / "two", **{"source": "pixels", "numbers": GOOD, **changes})
    error = compare(tmp_path, status=2)
    assert error.count("\n") == 1
    assert problem in error
    assert not (tmp_path / "one" / NAME).exists()


def test_largest_difference_is_that_of_every_judged_number(tmp_path):
    """Differences of densities are parts of the last true value, of proportions absolute; others are not judged."""
    for folder, source, median, chosen, drop in (
        ("one", "features", [3000.0, 8000.0], [0.5, 0.8], [0.2, 0.01]),
        ("two", "pixels", [3000.0, 8400.0], [0.5, 0.73], [0.9, 0.9]),
    ):
        save(tmp_path / folder, source, {"density_median": median, "drop_m": drop})
        save(tmp_path / folder, source, {"p_correct": chosen}, experiment="reach")
    compare(tmp_path)
    (claim,) = read_section(tmp_path)["claims"]
    assert claim["met"]
    assert claim["criteria"][0]["value"] == "5.0, 7.0 %"
    assert "density believed, median (kg/m³); correct choices, reach" in claim["criteria"][0]["name"]
    numbers = read_numbers(tmp_path / "one" / NAME)
    assert numbers.keys() - OF_STUDY == {"largest_difference", "panels"}
