"""Experiment ``reach``: few observers."""

import dataclasses
import json
import shutil

import numpy as np
import pytest
from helpers.results_contract import check_results
from scipy.optimize import brentq

from affordance.belief.density_belief import PointEstimate
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.motion_cost import Costs
from affordance.choice.ranking import NO_OPTION, Ranking
from affordance.control.systems import ControlCounts
from affordance.control.timed_path import TimedPath, load_path
from affordance.exceptions import BadValueError
from affordance.experiments import com, reach
from affordance.experiments.shared import decisions, sensitivity
from affordance.experiments.shared.correct_grip import find_grip_of_densest
from affordance.experiments.shared.decisions import (
    choose_by_expectation,
    choose_by_sample,
    count_correct,
    estimate_correct,
)
from affordance.experiments.shared.experience import Experience, collect_experience, draw_order
from affordance.experiments.shared.sensitivity import Assumption, list_assumptions
from affordance.files.model_folder import MODELS
from affordance.proprioception.faults import Faults
from affordance.proprioception.torque_noise import WeberNoise
from affordance.simulation.rollout import Rollout
from affordance.simulation.trial import TrialRecord
from affordance.vision.features import FeatureSource

CONTRACT = {
    "p_correct": (7,),
    "p_correct_ci95": (7, 2),
    "p_correct_bayes": (7,),
    "p_correct_headed_tool": (7,),
    "energy_ratio_true": (),
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


def test_results_keep_the_contract(folder):
    numbers = check_results(folder, CONTRACT, ("figure7", "figure8", "path", "sensitivity"))
    assert numbers["correct_grip"] in {"steel", "wood"}
    assert numbers["energy_true"].keys() == {"steel", "wood"}


def test_correct_grip_is_the_cheaper_one_of_the_simulated(numbers):
    energy = numbers["energy_true"]
    assert energy[numbers["correct_grip"]] == min(energy.values())
    assert numbers["energy_ratio_true"] == pytest.approx(max(energy.values()) / min(energy.values()))
    assert max(numbers["path_error_m"].values()) < 0.02


def test_what_is_true_depends_neither_on_sight_nor_on_faults(config):
    settings = dataclasses.replace(
        config.experience.settings, feature_source=FeatureSource.PIXELS, faults=Faults(arm_mass_factor=1.05)
    )
    other = dataclasses.replace(config, experience=dataclasses.replace(config.experience, settings=settings))
    executed, again = (reach.execute(each, config.novel.plain) for each in (config, other))
    for grip, rollout in executed.items():
        assert (again[grip].work, again[grip].error) == (rollout.work, rollout.error)


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


def test_materials_of_both_objects_are_named(config, numbers):
    assert "Both are of beech and steel." in reach.describe(config, numbers, 3).summary
    headed = config.novel.headed
    only = dataclasses.replace(headed, components=headed.components[1:])
    other = dataclasses.replace(config, novel=dataclasses.replace(config.novel, headed=only))
    assert "The stick is of beech and steel, the hammer of steel." in reach.describe(other, numbers, 3).summary


def test_few_observers_are_named_as_few(config, numbers):
    assert reach.describe(config, numbers, 1).summary.startswith("1 simulated observer holds the objects")
    for repeats, few in ((19, True), (20, False)):
        assert ("Verdicts want about 20 observers" in reach.describe(config, numbers, repeats).summary) == few


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
            assumption.point_estimate.value != "sample",
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
            r"the stick by wood leaves the path by 0\.\d+ m, must stay",
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
    assert find_grip_of_densest(plain, at_hand=True) == "steel"
    assert find_grip_of_densest(plain, at_hand=False) == "wood"
    swapped = [
        dataclasses.replace(grip, name=name) for grip, name in zip(plain.grips, ("left", "right"), strict=True)
    ]
    assert find_grip_of_densest(dataclasses.replace(plain, grips=tuple(swapped)), at_hand=True) == "right"


# Densities of wood and steel of which the answer is known: the heavier end belongs into the hand; the hammer's handle
# is the longer lever, so that it takes more than a heavier wood to hold it there; the last is too heavy for the arm.
WOOD_IS_HEAVY, STEEL_IS_HEAVY, PLAIN_BY_WOOD, TOO_HEAVY = (8e3, 7e2), (7e2, 8e3), (3e3, 2e3), (24e3, 24e3)
BY_WOOD, BY_STEEL = 0, 1


def experience_by_hand(config, densities):
    """Observers who know two densities to 1 kg/m^3 at each moment, (repeats, K + 1, 2)."""
    rho = np.array(densities)
    order = np.zeros((len(rho), rho.shape[1] - 1), dtype=np.intp)
    return Experience(config.experience.colours, np.broadcast_to(np.eye(2), (*rho.shape, 2)), rho, order)


@pytest.mark.parametrize("rule", [choose_by_sample, lambda *arguments: choose_by_expectation(*arguments)[0]])
def test_each_choice_is_by_what_is_believed_at_that_moment(config, choices, rule):
    experience = experience_by_hand(
        config,
        [
            [WOOD_IS_HEAVY, STEEL_IS_HEAVY, STEEL_IS_HEAVY, TOO_HEAVY, WOOD_IS_HEAVY],
            [STEEL_IS_HEAVY, TOO_HEAVY, WOOD_IS_HEAVY, WOOD_IS_HEAVY, STEEL_IS_HEAVY],
        ],
    )
    assert rule(choices.plain, experience, 0, 0).tolist() == [BY_WOOD, BY_STEEL, BY_STEEL, NO_OPTION, BY_WOOD]
    assert rule(choices.plain, experience, 0, 1).tolist() == [BY_STEEL, NO_OPTION, BY_WOOD, BY_WOOD, BY_STEEL]


class FlipsIfWoodIsHeavy:
    """Stands for a choice among nothing."""

    def rank(self, memory, rng, num_samples):
        wood, steel = memory.belief.untruncated_mean
        return Ranking((), num_usable=0, p_none=1.0, flips=bool(wood > steel))


def test_flips_are_those_of_each_moment(config):
    experience = experience_by_hand(config, [[STEEL_IS_HEAVY, WOOD_IS_HEAVY, WOOD_IS_HEAVY]])
    _, flips = choose_by_expectation(FlipsIfWoodIsHeavy(), experience, 0, 0)
    assert flips.tolist() == [False, True, True]


def test_plain_and_headed_object_are_each_chosen_about_by_themselves(config, choices):
    experience = experience_by_hand(config, [[PLAIN_BY_WOOD, STEEL_IS_HEAVY, PLAIN_BY_WOOD]])
    chosen = decisions.run_repeat(choices, experience, 0, 0)
    assert chosen["paper"].tolist() == [BY_WOOD, BY_STEEL, BY_WOOD]
    assert chosen["bayes"].tolist() == [BY_WOOD, BY_STEEL, BY_WOOD]
    assert chosen["headed"].tolist() == [BY_STEEL, BY_STEEL, BY_STEEL]


def make_rollout(work, effort, error, limited):
    path, reference = np.array([[0.0, 0.0, 0.0], [0.0, error, 0.0]]), np.zeros((2, 3))
    nothing = np.zeros((2, 1))
    record = TrialRecord(
        nothing[:, 0], *[nothing] * 3, *[nothing[:, 0]] * 3, MaterialMemory(), 0.0, ControlCounts(limited, 0)
    )
    return Rollout(work, effort, path, reference, record)


def test_numbers_are_those_of_made_up_arrays(config, choices):
    """Of the plain object the grip by wood is made the right one, of the headed one that by steel.

    Before experience the plain object is a matter of chance and the headed one is not.
    """
    executed = {"wood": make_rollout(8.0, 300.0, 0.01, 4), "steel": make_rollout(10.0, 200.0, 0.02, 5)}
    executed_headed = {"wood": make_rollout(9.0, 300.0, 0.0, 0), "steel": make_rollout(6.0, 200.0, 0.0, 0)}
    arrays = {
        "paper": np.array([[1, 0, 0], [1, 1, 0], [1, 0, -1], [1, 0, -1]]),
        "bayes": np.array([[0, 1, 1], [0, 1, 1], [0, 0, 1], [1, 1, 1]]),
        "headed": np.array([[0, 1, 1], [0, 1, 0], [0, 1, 0], [0, 1, -1]]),
        "flips": np.array([[True, False, True], [False, False, True], [False, False, True], [False, True, True]]),
    }
    numbers = reach.compute_metrics(config, choices, arrays, executed, executed_headed)
    assert (numbers["correct_grip"], numbers["correct_grip_headed_tool"]) == ("wood", "steel")
    assert numbers["p_correct"][0] == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(10_000))
    assert numbers["p_correct_headed_tool"][0] > 0.8
    assert numbers["p_correct"][1:].tolist() == [0.75, 0.75]
    assert numbers["p_correct_bayes"].tolist() == [0.75, 0.25, 0.0]
    assert numbers["p_correct_headed_tool"][1:].tolist() == [1.0, 0.375]
    for key in ("p_correct", "p_correct_bayes", "p_correct_headed_tool"):
        low, high = numbers[f"{key}_ci95"].T
        assert (low <= numbers[key]).all()
        assert (numbers[key] <= high).all()
    assert numbers["effort_flips"].tolist() == [0.25, 0.25, 1.0]
    assert numbers["energy_ratio_true"] == 1.25
    assert numbers["energy_true"] == {"wood": 8.0, "steel": 10.0}
    assert numbers["energy_true_headed_tool"] == {"wood": 9.0, "steel": 6.0}
    assert numbers["effort_true"] == {"wood": 300.0, "steel": 200.0}
    assert numbers["path_error_m"] == {"wood": 0.01, "steel": 0.02}
    assert numbers["periods_limited"] == {"wood": 4, "steel": 5}
    assert numbers["density_true"] == {"beech": 720.0, "steel": 7850.0}


class WeighedAgainst:
    """Stands for a choice that is of its second option where two densities together exceed a sum."""

    def __init__(self, total):
        self.total = total
        self.memories = []

    def compute_parameters(self, memory, rho):
        self.memories.append(memory)
        return np.stack([rho, rho])

    def compute_costs(self, pi):
        work = np.stack([pi[0].sum(axis=1), np.full(pi.shape[1], self.total)])
        return Costs(work, work, np.ones(work.shape, dtype=bool))


def test_sensitivity_is_that_of_each_assumption(config, monkeypatch):
    """Two objects of one material each, 4000 and 6000 kg/m^3, of which both must be known, or the heavier.

    Who feels without error knows one of them after the first trial, and both after the second. Who feels nothing goes
    on believing in the prior, whose modes add up to twice 1000, and its means to twice 3584 kg/m^3.
    """
    first, second = config.experience.tools
    beech, steel = config.experience.colours
    densities = {beech: 4000.0, steel: 6000.0}
    tools = [
        dataclasses.replace(tool, components=tool.components[:1]).with_densities(densities)
        for tool in (first, second)
    ]
    experience = dataclasses.replace(config.experience, tools=tuple(tools), num_trials=4)
    settings = experience.settings
    exact = dataclasses.replace(settings, noise=WeberNoise(1e-6, 1e-6))
    numb = dataclasses.replace(settings, noise=WeberNoise(0.07, 1e6))
    biased = dataclasses.replace(numb, prior=numb.prior._replace(mode=4000.0))
    assumptions = [
        Assumption("noise", "none", exact, PointEstimate.MODE),
        Assumption("noise", "all", numb, PointEstimate.MODE),
        Assumption("prior", "4000", biased, PointEstimate.MODE),
        Assumption("point", "mean", numb, PointEstimate.MEAN),
    ]
    monkeypatch.setattr(sensitivity, "list_assumptions", lambda used: assumptions if used == settings else [])
    curves = sensitivity.study(experience, WeighedAgainst(6000.0), 1, repeats=8, jobs=1)
    heavier_first = np.mean([draw_order(experience, repeat)[0] for repeat in range(8)])
    assert 0.0 < heavier_first < 1.0
    assert {panel: list(by_label) for panel, by_label in curves.items()} == {
        "noise": ["none", "all"],
        "prior": ["4000"],
        "point": ["mean"],
    }
    assert curves["noise"]["none"].tolist() == [0.0, heavier_first, 1.0, 1.0, 1.0]
    assert curves["noise"]["all"].tolist() == [0.0] * 5
    assert curves["prior"]["4000"].tolist() == [1.0] * 5
    assert curves["point"]["mean"].tolist() == [1.0] * 5


def test_observers_of_the_study_become_as_certain_as_those_of_the_full_simulation(config, folder, monkeypatch):
    """Errors are as large as the torque felt says, which differs between two draws by sqrt(2) 7 %, at most twice."""
    settings = config.experience.settings
    monkeypatch.setattr(sensitivity, "list_assumptions", lambda used: [Assumption("panel", "label", used)])
    listener = WeighedAgainst(0.0)
    sensitivity.study(config.experience, listener, 1, repeats=3, jobs=1)
    studied = np.array([np.diag(memory.belief.covariance) for memory in listener.memories]).reshape(3, 7, 2)
    full = collect_experience(config.experience, folder.parent / "experience", repeats=3, jobs=1)
    simulated = np.diagonal(np.linalg.inv(full.precision), axis1=2, axis2=3)
    spread = 2 * np.sqrt(2) * settings.noise.weber_fraction
    np.testing.assert_allclose(np.sqrt(studied / simulated), 1.0, atol=spread)
    np.testing.assert_allclose(studied[:, 0], settings.prior.sd**2, rtol=1e-12)


@pytest.mark.parametrize("num_points", [2, 3])
def test_path_turns_no_corner(num_points):
    """At each of its inner points, where the length along the chords says it is, it goes on as it came."""
    path = load_path(MODELS / "paths" / "reach.yaml")
    path = TimedPath(path.points[:num_points], path.duration, path.tolerance)
    curve = path.build_trajectory()
    steps = np.linalg.norm(np.diff(path.points, axis=0, prepend=0.0), axis=1)
    for point, share in zip(path.points[:-1], np.cumsum(steps)[:-1] / steps.sum(), strict=True):
        time = path.duration * brentq(lambda u, share=share: 10 * u**3 - 15 * u**4 + 6 * u**5 - share, 0.0, 1.0)
        np.testing.assert_allclose(curve.value(time)[:, 0], point, atol=1e-9)
        came, goes = (curve.EvalDerivative(time + step)[:, 0] for step in (-1e-6, 1e-6))
        assert np.linalg.norm(came) > 0.1
        np.testing.assert_allclose(goes, came, atol=1e-4)
