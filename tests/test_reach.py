"""Experiment ``reach``: few observers."""

import json
import shutil

import numpy as np
import pytest

from affordance.choice import NO_OPTION
from affordance.exceptions import AffordanceError, BadValueError
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
    for choose in (choose_by_sample, choose_by_expectation):
        chosen = choose(choices.plain, experience, 0, 0)
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


def test_path_that_no_grip_can_follow_is_said(config):
    executed = reach.execute(config, config.novel.plain)
    far = {grip: rollout._replace(path=rollout.path + 1.0) for grip, rollout in executed.items()}
    with pytest.raises(AffordanceError, match=r"no grip keeps to the path within 0.02 m: wood 1.7"):
        reach.find_correct_grip(config, far)
