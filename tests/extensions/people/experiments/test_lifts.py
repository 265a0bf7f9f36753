"""Lifts: orders, rows, and numbers of observers against sums by hand."""

import dataclasses
import itertools

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from helpers.refusals import refuse, refuse_command
from pydrake.multibody.tree import SpatialInertia

from affordance.belief.learners import KINDS_DRAWN
from affordance.exceptions import AffordanceError, BadArgumentError
from affordance.experiments.shared.holds import COLUMNS, compute_surprise, compute_volume, show_kinds, tabulate_holds
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments.lifts import (
    build_row,
    build_table,
    check_can_be_lifted,
    count_rows,
    counterbalance,
    cylinder,
    measure_each,
    repeat,
    run_lifts,
    summarise_lifts,
)
from affordance.extensions.people.participant import LiftSettings, Participant
from affordance.extensions.pixels.pixel_eye import PIXELS
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.proprioception.faults import Faults
from affordance.proprioception.torque_noise import WeberNoise
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.features import VisionError

NAMES = ["a", "b", "c", "test"]
G = 9.81  # [m/s^2]


def draw(names=NAMES, repetitions=1, seed=0, **options):
    return repeat(names, repetitions, np.random.default_rng(seed), block="x", **options)["object"].tolist()


def test_trials_have_block_cycle_and_object():
    trials = repeat(["a", "b"], 2, np.random.default_rng(0), block="mixed", order="fixed", times=2)
    assert trials.columns.tolist() == ["block", "cycle", "object"]
    assert trials["block"].tolist() == ["mixed"] * 8
    assert trials["cycle"].tolist() == [1] * 4 + [2] * 4
    assert trials["object"].tolist() == ["a", "a", "b", "b"] * 2


def test_shuffled_block_holds_each_object_once_a_repetition():
    drawn = draw(repetitions=30)
    cycles = [tuple(drawn[k : k + 4]) for k in range(0, 120, 4)]
    assert all(sorted(cycle) == sorted(NAMES) for cycle in cycles)
    assert len(set(cycles)) > 10
    assert draw(repetitions=30) == drawn != draw(repetitions=30, seed=1)


def test_test_object_comes_first_in_each_cycle():
    drawn = draw(repetitions=20, first=["test"])
    assert drawn[::4] == ["test"] * 20
    assert len({tuple(drawn[k + 1 : k + 4]) for k in range(0, 80, 4)}) > 3


def test_where_all_come_first_nothing_is_left_to_be_ordered():
    assert draw(["a"], first=["a"], order="latin square", repetitions=2) == ["a", "a"]


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6])
def test_latin_square_balances_places_and_successors(count):
    rows = np.array([build_row(count, row) for row in range(count_rows(count))])
    for column in rows.T:
        assert set(np.bincount(column, minlength=count)) == {len(rows) // count}
    pairs = [pair for row in rows for pair in itertools.pairwise(row)]
    assert len({pairs.count(pair) for pair in set(pairs)}) == 1
    assert len(set(pairs)) == count * (count - 1)


def test_observers_and_repetitions_have_rows_of_the_square():
    rows = {tuple(draw(order="latin square", row=observer)) for observer in range(8)}
    assert rows == {tuple(NAMES[place] for place in build_row(4, row)) for row in range(4)}
    assert draw(order="latin square", row=3, repetitions=2) == [
        *draw(order="latin square", row=3),
        *draw(order="latin square", row=4),
    ]


def test_table_has_participants_in_groups_with_orders_and_masses_of_their_own():
    """Over four participants each object has each mass equally often, and no mass is in one group only."""
    masses = [0.2, 0.3, 0.4, 0.6]

    def draw_trials(participant, rng):
        trials = repeat(NAMES, 2, rng, block="learn")
        return trials.assign(
            mass=trials["object"].map(dict(zip(NAMES, counterbalance(masses, participant), strict=True)))
        )

    table = build_table(draw_trials, 8, groups=["A", "B"], seed=3)
    assert table.columns.tolist() == ["participant", "group", "phase", "cycle", "object", "mass"]
    assert table["participant"].tolist() == [name for n in range(1, 9) for name in [f"P{n}"] * 8]
    assert table.groupby("participant")["group"].first().tolist() == ["A", "B"] * 4
    assert (table.groupby(["object", "mass"]).size() == 4).all()
    assert (table.groupby(["group", "mass"]).size() == 8).all()
    assert table["object"].tolist()[:4] != table["object"].tolist()[8:12]
    again = build_table(draw_trials, 2, groups=["A", "B"], seed=3)
    pd.testing.assert_frame_equal(again, table.head(16))


def test_order_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match=r"^order is 'random', must be 'shuffled', 'fixed' or 'latin square'$"):
        draw(order="random")


def test_cylinder_turns_like_one():
    """Inertial parameters are those of Drake's cylinder about the middle by which it is held, to 1e-12."""
    tool = cylinder("can", radius=0.04, height=0.1, mass=0.5)
    inertia = SpatialInertia.SolidCylinderWithMass(0.5, 0.04, 0.1, np.array([0.0, 0.0, 1.0]))
    moments = inertia.CalcRotationalInertia().get_moments()
    np.testing.assert_allclose(tool.parameters, [0.5, 0.0, 0.0, 0.0, *moments, 0.0, 0.0, 0.0], rtol=1e-12, atol=1e-18)
    assert compute_volume(tool) == pytest.approx(np.pi * 0.04**2 * 0.1, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mass": 80.0}, "density of can: is 159154.9"),
        ({"mass": 0.0}, "mass: is 0.0, must be from 0.001 to 100 kg"),
        ({"radius": -0.04}, "radius: is -0.04, must be from 0.001 to 0.5 m"),
        ({"height": float("nan")}, "height: is nan, must be"),
        ({"colour": "grey"}, "colour: is 'grey', "),
    ],
)
def test_cylinder_that_there_cannot_be_is_refused_in_one_line(changes, said):
    size = {"radius": 0.04, "height": 0.1, "mass": 0.5, **changes}
    assert refuse(cylinder, "can", error=BadArgumentError, **size).startswith(said)


TOOLS = (
    cylinder("small", radius=0.045, height=0.06, mass=0.6),
    cylinder("large", radius=0.045, height=0.12, mass=1.2),
    cylinder("odd", radius=0.045, height=0.09, mass=1.4),
)


def design(observer, rng):
    family = repeat(["small", "large"], 2, rng, block="family")
    return pd.concat([family, repeat(["small", "large", "odd"], 8, rng, block="odd one among them")])


@pytest.fixture(scope="module")
def setup(tmp_path_factory):
    return Setup(observers=3, seed=4, out=tmp_path_factory.mktemp("out"))


@pytest.fixture(scope="module")
def lifts(setup):
    """Lifts of three observers of each learner."""
    return run_lifts("mine", setup, TOOLS, design)


@pytest.mark.parametrize("command", ["run", "predict"])
def test_more_lifts_than_memory_holds_are_refused_before_anything_is_written(command, tmp_path, monkeypatch):
    """Two millions are 2083 observers of the 320 lifts of Linear+ by each of three learners."""
    monkeypatch.chdir(tmp_path)
    said = refuse_command(command, "linear_plus", "--repeats", 2084)
    assert said.endswith("--repeats: is 2084, must be at most 2083 with 960 lifts each; the nearest is 2083")
    monkeypatch.setattr("affordance.extensions.people.experiments.lifts.run_observers", fail)
    with pytest.raises(AssertionError, match="would run"):
        run_lifts("mine", Setup(observers=2_000_000 // 28 // 3, out=tmp_path), TOOLS, design)


def fail(*arguments, **options):
    raise AssertionError("would run")


def test_every_lift_of_every_observer_of_every_learner_is_a_row(lifts):
    assert lifts.columns.tolist() == [*COLUMNS, "weight"]
    assert len(lifts) == 3 * 3 * (2 * 2 + 8 * 3)
    of_one = lifts[(lifts["learner"] == "kinds_map") & (lifts["observer"] == 1)]
    assert of_one["lift"].tolist() == [*range(1, 29)]
    assert of_one["cycle"].tolist() == [1, 1, 2, 2, *np.repeat(range(1, 9), 3)]
    assert of_one["block"].tolist() == ["family"] * 4 + ["odd one among them"] * 24
    for tool in TOOLS:
        own = lifts[lifts["object"] == tool.name]
        assert set(own["mass"]) == {tool.mass}
        assert own["size"].to_numpy() == pytest.approx(compute_volume(tool), rel=1e-12)
        assert own["weight"].to_numpy() == pytest.approx(G * tool.mass, rel=1e-9)


def test_force_is_the_weight_that_is_believed_of_the_most_probable_density(lifts):
    np.testing.assert_allclose(lifts["force"], G * lifts["expected"], rtol=1e-9)
    of_one = lifts[lifts["learner"] == "density"]
    np.testing.assert_allclose(of_one["expected"], of_one["believed_density"] * of_one["size"], rtol=1e-6)
    first = lifts[lifts["lift"] == 1]
    assert first["believed_density"].to_numpy() == pytest.approx(DEFAULT_SETTINGS.prior.mode)


def test_what_is_felt_is_learned(lifts):
    """After the lifts of a family it is lifted by its weight, with one density to 5 %."""
    family = lifts[(lifts["learner"] == "density") & (lifts["block"] == "family") & (lifts["cycle"] == 2)]
    np.testing.assert_allclose(family["force"], family["weight"], rtol=0.2)
    first = lifts[(lifts["lift"] == 1) & (lifts["learner"] == "density")]
    assert (first["force"] > 1.2 * first["weight"]).all() or (first["force"] < 0.8 * first["weight"]).all()


def test_kinds_are_numbered_from_the_oldest_and_are_none_without_kinds(lifts):
    assert lifts.loc[lifts["learner"] == "density", "kind"].isna().all()
    drawn = lifts[lifts["learner"] == "kinds_map"]
    assert set(drawn["kind"]) == {1, 2}
    assert set(drawn.loc[drawn["lift"] == 1, "kind"]) == {1}
    assert show_kinds(np.array([0, 2, 1])).isna().tolist() == [True, False, False]


def test_learners_lift_the_same_objects_in_the_same_order(lifts):
    orders = [own["object"].tolist() for _, own in lifts.groupby("learner")]
    assert orders[0] == orders[1] == orders[2]
    of_observers = [own["object"].tolist() for _, own in lifts.groupby("observer")]
    assert of_observers[0] != of_observers[1]


def test_surprise_is_a_logarithm_that_ends(lifts):
    np.testing.assert_allclose(compute_surprise(np.array([1e-7, 1.0, 0.0])), [7.0, 0.0, 300.0])
    assert np.isnan(compute_surprise(np.array([np.nan]))).all()
    density = lifts[lifts["learner"] == "density"]
    odd = density[density["object"] == "odd"].groupby("observer").first()
    before = density[density["block"] == "family"].groupby("observer")["surprise"].max()
    assert (odd["surprise"] > before).all()


def test_numbers_are_those_of_the_seed(lifts, setup, tmp_path):
    again = run_lifts("mine", dataclasses.replace(setup, out=tmp_path), TOOLS, design, [KINDS_DRAWN])
    own = lifts[lifts["learner"] == "kinds_drawn"].reset_index(drop=True)
    pd.testing.assert_frame_equal(again, own)
    other = run_lifts("mine", dataclasses.replace(setup, out=tmp_path, seed=5), TOOLS, design, [KINDS_DRAWN])
    assert (other["force"].to_numpy() != own["force"].to_numpy()).any()


def measure_by_hand(lifts):
    return pd.Series({"mean_N": lifts["force"].mean(), "weight_N": lifts["weight"].iloc[-1]})


def test_numbers_are_means_over_observers_with_students_intervals(lifts):
    found = summarise_lifts(lifts, measure_by_hand, Setup(), without_interval=["weight_N"])
    assert list(found["learners"]) == ["density", "kinds_map", "kinds_drawn"]
    assert found["people"] == {}
    assert set(found["kappa"]) == {"kinds_map", "kinds_drawn"}
    for learner, numbers in found["learners"].items():
        forces = lifts.loc[lifts["learner"] == learner, "force"].to_numpy().reshape(3, -1).mean(axis=1)
        assert numbers["mean_N"] == pytest.approx(forces.mean())
        half = 4.302653 * forces.std(ddof=1) / np.sqrt(3.0)  # Student's, 2 degrees of freedom
        np.testing.assert_allclose(numbers["mean_N_ci95"], forces.mean() + np.array([-half, half]), rtol=1e-5)
        assert "weight_N_ci95" not in numbers
        np.testing.assert_allclose(measure_each(lifts, measure_by_hand)[learner]["mean_N"], forces)
    assert found["mean_N"] == found["learners"]["density"]["mean_N"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"eye": PIXELS},
            "--vision: is 'pixels', must be 'features' for mine, whose lifts are in closed form",
        ),
        ({"faults": Faults(bias_sd=1.0)}, "--fault: is given, must be omitted for mine, whose lifts in closed form"),
        (
            {"noise": WeberNoise(independent_samples=True)},
            "noise.independent_samples: is true, must be false for lifts",
        ),
        ({"vision_error": VisionError(size=0.1)}, "vision_error"),
    ],
)
def test_what_the_closed_form_does_not_support_is_refused(changes, said):
    check_can_be_lifted("mine", TOOLS, DEFAULT_SETTINGS)
    settings = dataclasses.replace(DEFAULT_SETTINGS, **changes)
    assert said in refuse(check_can_be_lifted, "mine", TOOLS, settings, error=AffordanceError)


def test_object_that_is_too_heavy_for_the_arm_is_refused():
    heavy = cylinder("anvil", radius=0.2, height=0.2, mass=80.0)
    said = refuse(check_can_be_lifted, "mine", [*TOOLS, heavy], DEFAULT_SETTINGS, error=AffordanceError)
    assert said.startswith("mine: tools: anvil: weighs 80 kg and loads ")


def brief(observer, rng):
    return repeat(["small", "large", "odd"], 2, rng, block="x")


def test_participants_differ_in_their_pushes_and_in_nothing_that_they_learn(setup):
    """Errors and gains change forces only; what observers have of their own is in columns of their lifts."""
    plain = run_lifts("mine", setup, TOOLS, brief, [KINDS_DRAWN])
    participant = Participant(push_error=0.2, gain_spread=0.1, lapse=0.1)
    other = dataclasses.replace(setup, settings=LiftSettings(participant=participant))
    pushed = run_lifts("mine", other, TOOLS, brief, [KINDS_DRAWN])
    assert not any("." in name for name in plain)
    own = {name: pushed.groupby("observer")[name].unique() for name in pushed if "." in name}
    assert all(len(each) == 1 for values in own.values() for each in values)
    assert {*own} >= {"participant.push_error", "participant.gain", "participant.lapse", "learner.kappa"}
    assert pushed["participant.gain"].nunique() == 3
    same = [name for name in plain if name != "force"]
    pd.testing.assert_frame_equal(pushed[same], plain[same])
    assert (pushed["force"] != plain["force"]).all()
    errors = np.log(pushed["force"] / (plain["force"] * pushed["participant.gain"]))
    assert 0.05 < errors.std() < 0.6


def test_kappa_of_each_observer_is_its_own(setup):
    spread = dataclasses.replace(setup, settings=LiftSettings(participant=Participant(kappa_spread=0.3)))
    lifts = run_lifts("mine", spread, TOOLS, brief, [KINDS_DRAWN])
    assert lifts["learner.kappa"].nunique() == 3
    given = setup.change(learner=KINDS_DRAWN.change(kappa=[0.2, 0.3, 0.4]))
    lifts = run_lifts("mine", given, TOOLS, brief, [given.settings.learner])
    assert lifts.groupby("observer")["learner.kappa"].first().tolist() == [0.2, 0.3, 0.4]


def test_heaviness_is_felt_weight_against_what_the_look_predicts(setup):
    """By the look an odd object weighs what its colour's density and its volume say, whatever it weighed before."""
    lifts = run_lifts("mine", setup, TOOLS, brief, [KINDS_DRAWN])
    predicted = G * lifts["believed_density"] * lifts["size"]
    np.testing.assert_allclose(lifts["expected_by_look"], predicted, rtol=1e-9)
    np.testing.assert_allclose(lifts["felt"], lifts["weight"], rtol=0.3)
    expected = lifts["felt"] * (lifts["felt"] / lifts["expected_by_look"]) ** 0.1
    np.testing.assert_allclose(lifts["heaviness"], expected, rtol=1e-12)


def test_holds_are_rows_in_the_order_of_trials():
    tools = load_tools(MODELS / "tools" / "com.yaml")[:2]
    values = np.arange(8.0).reshape(2, 4)
    names = ("expected", "believed_density", "p_value")
    data = xr.Dataset(dict.fromkeys(names, (("observer", "trial"), values)))
    data["kind"] = (("observer", "trial"), np.array([[0, 1, 2, 0]] * 2))
    objects = np.array([[0, 1, 1, 0], [1, 0, 0, 1]])
    table = tabulate_holds(data, tools, learner="density", block="learning", objects=objects)
    assert table.columns.tolist() == [*COLUMNS]
    assert table["observer"].tolist() == [0] * 4 + [1] * 4
    assert table["lift"].tolist() == [1, 2, 3, 4] * 2
    assert table["cycle"].tolist() == [1, 1, 2, 2] * 2
    assert table["object"].tolist() == [tools[index].name for index in objects.ravel()]
    assert table["mass"].tolist() == [tools[index].mass for index in objects.ravel()]
    assert table["expected"].tolist() == values.ravel().tolist()
    assert table["force"].isna().all()
    assert table["kind"].isna().tolist() == [True, False, False, True] * 2
    once = tabulate_holds(data.isel(trial=slice(2)), tools, learner="density", block="test")
    assert once["object"].tolist() == [tools[0].name, tools[1].name] * 2
