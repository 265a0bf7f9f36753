"""Experiment ``reach``: few observers."""

import dataclasses
import json
import shutil

import numpy as np
import pytest

from affordance.choice import NO_OPTION
from affordance.exceptions import BadValueError
from affordance.experience import collect_experience
from affordance.experiments import com, reach
from affordance.experiments.decisions import (
    choose_by_expectation,
    choose_by_sample,
    count_correct,
    estimate_correct,
    list_assumptions,
)
from affordance.tools import MODELS

CONTRACT = {
    "p_correct": (7,),
    "p_correct_ci95": (7, 2),
    "p_correct_bayes": (7,),
    "p_correct_headed_tool": (7,),
    "energy_ratio_true": (),
    "seed": (),
    "repeats": (),
    "run_shown": (),
    "wall_s": (),
}


@pytest.fixture(scope="module")
def config():
    return reach.load_config()


@pytest.fixture(scope="module")
def choices(config):
    return reach.build_choices(config)


@pytest.fixture(scope="module")
def folder(config, tmp_path_factory):
    """The whole experiment with three observers, run once."""
    folder = tmp_path_factory.mktemp("results") / "reach"
    reach.run(config, folder, repeats=3, jobs=1)
    return folder


@pytest.fixture(scope="module")
def numbers(folder):
    return json.loads((folder / "metrics.json").read_text())


def test_results_keep_the_contract(folder, numbers):
    for name in ("figure7", "figure8", "path", "sensitivity", "diagram"):
        assert (folder / f"{name}.svg").stat().st_size > 1000
    assert (folder / "replay.html").stat().st_size > 1e6
    assert (folder / "trajectories.nc").exists()
    for key, shape in CONTRACT.items():
        assert np.shape(numbers[key]) == shape, key
        assert np.isfinite(numbers[key]).all(), key
    assert numbers["correct_grip"] in {"steel", "wood"}
    assert numbers["energy_true"].keys() == {"steel", "wood"}


def test_correct_grip_is_the_cheaper_one_of_the_simulated(numbers):
    energy = numbers["energy_true"]
    assert energy[numbers["correct_grip"]] == min(energy.values())
    assert numbers["energy_ratio_true"] == pytest.approx(max(energy.values()) / min(energy.values()))
    assert max(numbers["path_error_m"].values()) < 0.02


def test_section_says_met_or_not_of_every_claim(folder):
    section = json.loads((folder / "section.json").read_text())
    assert len(section["claims"]) == 4
    assert all(isinstance(claim["met"], bool) for claim in section["claims"])


def test_claims_are_not_met_by_numbers_that_contradict_them(config, numbers):
    contradicting = {
        "correct_grip": "wood",
        "p_correct": np.linspace(0.9, 0.3, 7),
        "p_correct_ci95": np.column_stack([np.linspace(0.8, 0.2, 7), np.linspace(0.95, 0.4, 7)]),
    }
    section = reach.describe(config, {**numbers, **contradicting}, 3)
    assert not any(claim.met for claim in section.claims)


def test_experience_of_one_experiment_serves_the_other(config, choices, tmp_path):
    """What was learned in com is what is chosen by in reach: the memories are found, not made anew."""
    gained = collect_experience(com.load_config().experience, tmp_path, repeats=2, jobs=1)
    before = sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob("*.npz"))
    found = collect_experience(config.experience, tmp_path, repeats=2, jobs=1)
    assert sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob("*.npz")) == before
    np.testing.assert_array_equal(found.precision, gained.precision)
    chosen = choose_by_sample(choices.plain, gained, 0, 1)
    np.testing.assert_array_equal(chosen, choose_by_sample(choices.plain, found, 0, 1))


def test_those_who_know_the_materials_choose_alike(config, choices, tmp_path):
    """After six trials a sampled density and the expectation lead to the grip that is cheaper in truth."""
    experience = collect_experience(config.experience, tmp_path, repeats=1, jobs=1)
    expected, flips = choose_by_expectation(choices.plain, experience, 0, 0)
    assert flips.shape == (7,)
    for chosen in (choose_by_sample(choices.plain, experience, 0, 0), expected):
        assert chosen.shape == (7,)
        assert choices.plain.options[chosen[-1]].grip == "steel"


def test_guesses_count_half():
    chosen = np.array([[0, 1, NO_OPTION], [0, 0, NO_OPTION]])
    np.testing.assert_array_equal(count_correct(chosen, 0), [2.0, 1.0, 1.0])


def test_choices_from_the_prior_stand_in_for_those_before_the_first_trial():
    chosen = np.zeros((100, 3), dtype=int)
    before = np.repeat([0, 1], 5000)
    estimate = estimate_correct(chosen, before, 0)
    np.testing.assert_allclose(estimate.mean, [0.5, 1.0, 1.0])
    # Wilson's interval by hand: 0.5 -+ 1.96 sqrt(0.25 / 10000 + ...) and n / (n + 1.96^2) to 1.
    assert estimate.low[0] == pytest.approx(0.4902, abs=1e-4)
    assert estimate.low[1] == pytest.approx(100 / (100 + 1.959964**2), rel=1e-6)
    assert estimate.high[1] == 1.0


def test_sensitivity_varies_one_thing_at_a_time(config):
    settings = config.experience.settings
    assumptions = list_assumptions(settings)
    assert len({assumption.panel for assumption in assumptions}) == 4
    for assumption in assumptions:
        differences = [
            assumption.settings.noise != settings.noise,
            assumption.settings.prior != settings.prior,
            assumption.point.value != "sample",
        ]
        assert sum(differences) == (0 if assumption.label.endswith("(used)") else 1)


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("tools/novel.yaml", "material: steel}", "material: brass}", r"stick: looks like brass, must look like what"),
        (
            "tools/novel.yaml",
            "material: steel}",
            "material: beech, looks_like: steel}",
            r"stick.components\[1\].looks_like: is 'steel', must be what it is made of, 'beech'",
        ),
        ("tools/novel.yaml", "[0.30, 0, 0], rpy", "[0.28, 0, 0], rpy", r"stick.grips: reach 0.3 and 0.28 m beyond"),
        ("tools/novel.yaml", "      wood:", "      oak:", r"have grips of different names"),
        ("tools/novel.yaml", "      wood: {position: [0, 0, 0]}\n", "", r"stick.grips: has 1 entries, must have 2"),
        ("paths/reach.yaml", "duration: 2.0", "duration: -2.0", r"reach.yaml: duration: is -2.0, must be from"),
    ],
)
def test_objects_and_paths_that_do_not_make_the_experiment_are_refused(tmp_path, file, old, new, message):
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(BadValueError, match=message):
        reach.load_config(tmp_path / "models")


def write_models(tmp_path, file, old, new):
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    return tmp_path / "models"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "  - [-0.10, 0.20, 0.20]\n",
            "  - [0.3, 0, 0]\n",
            r"reach.yaml: points: cannot be followed: no motion could be planned: .* at t = 0.905 s",
        ),
        ("[-0.30, 0.40, -0.10]", "[0.1, 0.4, 0.1]", r"the stick by wood leaves the path by 0\.\d+ m, must stay"),
        ("duration: 2.0", "duration: 0.05", r"reach.yaml: points: cannot be followed: "),
        ("tolerance: 0.02", "tolerance: 0.001", r"leaves the path by 0.003\d+ m, must stay within 0.001 m"),
    ],
)
def test_path_that_cannot_be_followed_is_refused(tmp_path, old, new, message):
    with pytest.raises(BadValueError, match=message):
        reach.load_config(write_models(tmp_path, "paths/reach.yaml", old, new))


def test_object_without_a_cheaper_grip_is_refused(tmp_path):
    models = write_models(
        tmp_path,
        "tools/novel.yaml",
        "[0.075, 0.015, 0.015], position: [0.225, 0, 0], material: steel}",
        "[0.075, 0.015, 0.015], position: [0.225, 0, 0], material: beech}",
    )
    with pytest.raises(
        BadValueError, match=r"novel.yaml: tools: stick: costs 8.\d+ J in both grips, must have a cheaper"
    ):
        reach.load_config(models)


def test_heavy_end_is_found_by_its_material_not_by_its_name(config):
    plain = config.novel.plain
    assert reach.find_heavy_grip(plain) == "steel"
    swapped = [
        dataclasses.replace(grip, name=name) for grip, name in zip(plain.grips, ("left", "right"), strict=True)
    ]
    assert reach.find_heavy_grip(dataclasses.replace(plain, grips=tuple(swapped))) == "right"
