import dataclasses
import json

import pytest

from affordance.experiments.vision_comparison import NAME, compare_feature_sources, save_vision_metrics
from affordance.proprioception.faults import Faults
from affordance.reporting.report import write_report
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.features import FeatureSource

PIXELS = Settings(feature_source=FeatureSource.PIXELS)


def keep(out, settings, median, *, seed=0, repeats=2):
    numbers = {"density_median": median, "drop_m": [0.2, 0.01]}
    save_vision_metrics(out / "weight", numbers, settings, seed=seed, repeats=repeats)


def test_nothing_is_compared_where_there_is_one_source(tmp_path):
    keep(tmp_path, DEFAULT_SETTINGS, [3000.0, 8500.0])
    compare_feature_sources(tmp_path)
    assert not (tmp_path / NAME).exists()


@pytest.mark.parametrize(
    ("seen", "met", "shown"), [([3100.0, 8400.0], True, "3100, 8400"), ([3000.0, 7000.0], False, "3000, 7000")]
)
def test_both_sources_of_features_stand_side_by_side(tmp_path, seen, met, shown):
    keep(tmp_path, DEFAULT_SETTINGS, [3000.0, 8500.0])
    keep(tmp_path, PIXELS, seen)
    compare_feature_sources(tmp_path)
    section = json.loads((tmp_path / NAME / "section.json").read_text(encoding="utf-8"))
    assert (tmp_path / NAME / "comparison.png").exists()
    (claim,) = section["claims"]
    assert claim["met"] is met
    (table,) = section["tables"]
    assert [row[1:] for row in table["rows"][:2]] == [["features", "3000, 8500"], ["pixels", shown]]
    assert table["rows"][0][0] == "density believed, median (kg/m³)"
    assert "What pictures cost" in write_report(tmp_path).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "Expecting value"),
        ('{"shared": {', "Expecting"),
        ("[" * 100_000, "recursion"),
        ("[1]", "list indices"),
        ("null", "not subscriptable"),
        ("{}", "'shared'"),
        ('{"shared": {"seed": 0}}', "'faults'"),
        ("GOOD [3000, 8000] -> 7", "density_median is no list of numbers"),
        ("GOOD [3000, 8000] -> []", "density_median is no list of numbers"),
        ("GOOD [3000, 8000] -> [null, 1]", "density_median is no list of numbers"),
        ("GOOD [3000, 8000] -> [[1], [1, 2]]", "inhomogeneous"),
        ('GOOD [3000, 8000] -> ["heavy"]', "could not convert"),
        (f"GOOD [3000, 8000] -> [{10**400}]", "too large"),
        ("GOOD drop_m -> fall_m", "'drop_m'"),
    ],
)
@pytest.mark.parametrize("feature_source", FeatureSource)
def test_file_that_no_experiment_wrote_is_named_and_set_aside(tmp_path, caplog, feature_source, text, problem):
    keep(tmp_path, DEFAULT_SETTINGS, [3000, 8000])
    keep(tmp_path, PIXELS, [3000, 8000])
    path = tmp_path / "weight" / f"numbers_{feature_source.value}.json"
    if text.startswith("GOOD "):
        good, bad = text.removeprefix("GOOD ").split(" -> ")
        found = json.dumps(json.loads(path.read_text(encoding="utf-8")))
        assert good in found
        text = found.replace(good, bad)
    path.write_text(text, encoding="utf-8")
    compare_feature_sources(tmp_path)
    assert not (tmp_path / NAME).exists()
    assert f"{path.name} is not what an experiment found (" in caplog.text
    assert problem in caplog.text
    assert path.with_suffix(".broken").exists()
    assert not path.exists()


FAULTY = dataclasses.replace(PIXELS, faults=Faults(bias_sd=3.0))


@pytest.mark.parametrize(
    ("settings", "seen", "numbers", "apart"),
    [
        (FAULTY, [3000.0, 8000.0], {}, "faults"),
        (PIXELS, [3000.0, 8000.0], {"seed": 1}, "seed"),
        (PIXELS, [3000.0, 8000.0], {"seed": 1, "repeats": 20}, "seed, repeats"),
        (PIXELS, [3000.0, 8000.0, 8400.0], {}, "density_median"),
    ],
)
def test_runs_that_differ_in_more_than_the_source_of_features_are_not_compared(
    tmp_path, caplog, settings, seen, numbers, apart
):
    keep(tmp_path, DEFAULT_SETTINGS, [3000.0, 8500.0])
    keep(tmp_path, PIXELS, [3000.0, 8500.0])
    compare_feature_sources(tmp_path)
    assert (tmp_path / NAME / "section.json").exists()
    keep(tmp_path, settings, seen, **numbers)
    compare_feature_sources(tmp_path)
    assert not (tmp_path / NAME / "section.json").exists()  # what it said no longer holds
    assert caplog.text.rstrip().endswith(f"features and pixels are not compared, as they differ in {apart}")
    assert (tmp_path / "weight" / "numbers_pixels.json").exists()


def test_runs_with_other_models_are_not_compared(tmp_path, caplog):
    folder = tmp_path / "models"
    folder.mkdir()
    (folder / "materials.yaml").write_text("gold: 1", encoding="utf-8")
    keep(tmp_path, DEFAULT_SETTINGS, [3000.0, 8500.0])
    keep(tmp_path, dataclasses.replace(PIXELS, arm=folder / "arm.dmd.yaml"), [3000.0, 8500.0])
    compare_feature_sources(tmp_path)
    assert "differ in models" in caplog.text


def test_runs_with_the_same_faults_are_compared(tmp_path):
    keep(tmp_path, dataclasses.replace(FAULTY, feature_source=FeatureSource.FEATURES), [3000.0, 8500.0])
    keep(tmp_path, FAULTY, [3000.0, 8500.0])
    compare_feature_sources(tmp_path)
    assert (tmp_path / NAME / "section.json").exists()


def test_largest_difference_is_that_of_every_judged_number(tmp_path):
    """Densities as parts of the last true value, proportions as they are; what is not judged is only shown."""
    for settings, median, chosen, drop in (
        (DEFAULT_SETTINGS, [3000.0, 8000.0], [0.5, 0.8], [0.2, 0.01]),
        (PIXELS, [3000.0, 8400.0], [0.5, 0.73], [0.9, 0.9]),
    ):
        save_vision_metrics(
            tmp_path / "weight", {"density_median": median, "drop_m": drop}, settings, seed=0, repeats=2
        )
        save_vision_metrics(tmp_path / "reach", {"p_correct": chosen}, settings, seed=0, repeats=2)
    compare_feature_sources(tmp_path)
    (claim,) = json.loads((tmp_path / NAME / "section.json").read_text(encoding="utf-8"))["claims"]
    assert claim["met"]
    assert claim["criteria"][0]["value"] == "5.0, 7.0 %"
    assert "density believed, median (kg/m³); correct choices, reach" in claim["criteria"][0]["name"]


def test_experiments_that_are_not_compared_keep_nothing(tmp_path):
    save_vision_metrics(tmp_path / "vision", {"objects": 3}, DEFAULT_SETTINGS, seed=0, repeats=2)
    assert list(tmp_path.iterdir()) == []
