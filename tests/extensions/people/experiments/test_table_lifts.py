"""Lifts of a table: those of a program with the same trials, to the last bit; holds, looks, choices in one memory."""

import dataclasses
import itertools

import numpy as np
import pandas as pd
import pytest
from helpers.refusals import refuse

from affordance.belief.learners import DENSITY, KINDS_DRAWN, LEARNERS
from affordance.exceptions import InfeasibleError
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import linear, table_lifts
from affordance.extensions.people.experiments.lifts import build_table, cylinder, measure_each, run_lifts
from affordance.extensions.people.experiments.table_lifts import (
    TableExperiment,
    average,
    describe_means,
    describe_too_strong,
    list_numbers,
    tabulate_means,
)
from affordance.extensions.people.experiments.trials import check_trials
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.robot import Robot
from affordance.runs.random_streams import Stream
from affordance.simulation.trial import Observer, get_runner

TOOLS = (
    cylinder("small", radius=0.04, height=0.06, mass=0.3),
    cylinder("large", radius=0.04, height=0.12, mass=0.6),
)
# What does not depend on the values of a trial that was never made.
SAME = ["observer", "learner", "cycle", "lift", "object", "mass", "size", "force", "expected"]
SAME += ["believed_density", "kind", "surprise", "weight"]


def build(rows, **options):
    names = ["participant", "phase", "object", "do", "mass"]
    return TableExperiment("mine", check_trials(pd.DataFrame(rows, columns=names), TOOLS), **options)


@pytest.fixture
def setup(tmp_path):
    return Setup(seed=3, out=tmp_path)


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Three observers of each learner in a short Linear+, and its trials as a table of three participants."""
    setup = Setup(observers=3, seed=3, out=tmp_path_factory.mktemp("program"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(linear, "FAMILIAR", 3)
        patch.setattr(linear, "MIXED", 4)
        lifts = run_lifts("linear_plus", setup, linear.make_objects("linear_plus"), linear.design)
        table = build_table(linear.design, 3, seed=setup.seed)
    return lifts, check_trials(table, linear.make_objects("linear_plus"))


@pytest.mark.parametrize(("jobs", "learners"), [(1, tuple(LEARNERS.values())), (2, (KINDS_DRAWN,))])
def test_linear_plus_as_a_table_of_participants_is_the_program(setup, program, jobs, learners):
    """Every number of every lift, and so of every observer, is equal, in two processes too.

    Sums over things of other observers in the same array may differ in the last bit.
    """
    of_program, table = program
    names = [each.name for each in learners]
    of_program = of_program[of_program["learner"].isin(names)].reset_index(drop=True)
    lifts = TableExperiment("mine", table, learners=learners).collect(dataclasses.replace(setup, jobs=jobs))
    for name in SAME:
        pd.testing.assert_series_equal(lifts[name], of_program[name], rtol=1e-12, atol=1e-12)
    numbers, expected = (measure_each(each, linear.measure) for each in (lifts, of_program))
    for learner, name in itertools.product(names, linear.MEANINGS):
        np.testing.assert_allclose(numbers[learner][name], expected[learner][name], rtol=1e-9, strict=True)


def test_holds_of_a_table_are_those_of_an_observer(setup):
    rows = [("P", "a", "small", "hold", None), ("P", "a", "large", "hold", 0.4)]
    experiment = build(rows, learners=(DENSITY,))
    lifts = experiment.collect(setup)
    hand = Observer(get_runner(setup.settings), setup.start_memory(0), duration=3.0)
    for number, tool in enumerate(experiment.table.tools):
        heights = hand.hold(tool, seed=(setup.seed, 0, number)).height_centre
        assert lifts["moved"].iloc[number] == heights[np.abs(heights).argmax()]
    assert lifts["force"].isna().all()
    assert lifts["mass"].tolist() == [tool.mass for tool in experiment.table.tools]


def test_one_memory_goes_through_all_that_is_done(setup):
    """A hold teaches what is lifted next; a look, and a lift that does not teach, leave no trace."""
    taught = [("P", "a", "small", "hold", None), ("P", "a", "large", "lift", None)]
    looked = [("P", "a", "small", "look", None), ("P", "a", "large", "lift", None)]
    new, old = (build(rows, learners=(DENSITY,)).collect(setup)["force"].iloc[1] for rows in (taught, looked))
    prior = setup.settings.prior.mode * TOOLS[1].components[0].shape.volume * 9.81
    assert old == pytest.approx(prior, rel=1e-9)
    assert abs(new - prior) > 0.02 * prior
    table = build([("P", "a", "small", "lift", None)] * 2)
    rows = table.table.rows.assign(teaches=[False, True])
    lifts = dataclasses.replace(table, table=table.table._replace(rows=rows)).collect(setup)
    assert lifts["force"].iloc[0] == lifts["force"].iloc[1]
    assert np.isnan(lifts["felt"].iloc[0])
    assert lifts["felt"].iloc[1] > 0.0


@pytest.mark.parametrize("learner", LEARNERS.values())
def test_what_was_lifted_and_held_is_one_thing(setup, learner):
    """A hold recalls what lifts have taught of a thing, a lift what holds have, also of another that looks alike."""
    tools = [
        cylinder("small", radius=0.04, height=0.06, mass=0.6),
        *(cylinder(name, radius=0.04, height=0.12, mass=1.2) for name in ("large", "twin")),
    ]
    names = ["twin", "large", "large", "twin", "small", "large"]
    frame = pd.DataFrame({"object": names, "do": ["lift", "hold", "lift", "hold", "hold", "look"]})
    lifts = TableExperiment("mine", check_trials(frame, tools), learners=(learner,)).collect(setup)
    assert lifts["expected"].iloc[0] < 0.7
    assert lifts["expected"].iloc[[1, 2, 3, 5]].to_numpy() == pytest.approx(1.2, rel=0.1)  # 2 SDs of a hold
    assert (lifts["surprise"].iloc[[1, 2, 3]] < 3.0).all()
    assert lifts["kind"].isna().all() if learner is DENSITY else (lifts["kind"] == 1).all()


def test_lifts_after_a_hold_are_felt_with_errors_of_their_own(setup):
    rows = [("P", "a", "small", do, None) for do in ("lift", "hold", "lift", "hold", "lift")]
    lifts = build(rows, learners=(DENSITY,)).collect(setup)
    felt = lifts.loc[lifts["do"] == "lift", "felt"].tolist()
    assert len(set(felt)) == 3


def test_repeats_are_other_observers_of_the_same_trials(setup):
    rows = [("P", "a", "small", "lift", None)] * 3 + [("Q", "a", "large", "lift", None)] * 2
    once, thrice = (build(rows, repeats=repeats, learners=(DENSITY,)).collect(setup) for repeats in (1, 3))
    first = thrice[thrice["repeat"] == 1].reset_index(drop=True)
    pd.testing.assert_frame_equal(first, once, check_exact=True)
    assert thrice["observer"].tolist() == [0] * 3 + [1] * 2 + [2] * 3 + [3] * 2 + [4] * 3 + [5] * 2
    assert thrice["participant"].tolist() == (["P"] * 3 + ["Q"] * 2) * 3
    of_p = thrice[thrice["participant"] == "P"].groupby("repeat")["felt"].first()
    assert of_p.nunique() == 3
    drawn, felt = ([(setup.seed, 0, Stream.REPEAT, 2, stream)] for stream in (Stream.KINDS, Stream.LIFT))
    lifter = table_lifts.StaticLifter([TOOLS[0]], setup.settings)
    errors = lifter.draw_errors(felt, 3)
    record = lifter.run(np.zeros((3, 1), dtype=int), lifter.start(drawn), errors, drawn)
    assert thrice.loc[thrice["observer"] == 2, "felt"].tolist() == record.felt[:, 0].tolist()


@pytest.mark.parametrize("learner", LEARNERS.values(), ids=lambda each: each.name)
def test_observers_at_once_are_those_one_by_one(setup, learner):
    """Participants differ in objects, order and number of trials; Monte Carlo errors and kinds are each one's own."""
    rng, rows = np.random.default_rng(1), []
    for number in range(4):
        names = rng.choice(["small", "large"][: 1 + number % 2], 7 + number % 3)
        rows += [
            (f"P{number}", "a", name, "look" if place == 4 else "lift", None) for place, name in enumerate(names)
        ]
    experiment = build(rows, repeats=2, learners=(learner,))
    trials, choices = table_lifts._plan(setup.change(learner=learner), experiment.table, {})
    own = setup.change(learner=learner)
    together = table_lifts.observe(own, trials, choices, range(8))
    for number, found in enumerate(together):
        (alone,) = table_lifts.observe(own, trials, choices, [number])
        for name in alone:
            np.testing.assert_allclose(found[name], alone[name], rtol=0.0 if learner is DENSITY else 1e-12)


def test_observers_are_kept_and_more_repeats_keep_them(setup):
    rows = [("P", "a", "small", "lift", None), ("Q", "a", "large", "lift", 0.4)]
    experiment = build(rows, repeats=2, learners=(DENSITY,))
    before = experiment.collect(setup)
    files = {path: path.stat().st_mtime_ns for path in setup.out.rglob("*.npz")}
    assert len(files) == 4
    more = dataclasses.replace(experiment, repeats=3).collect(setup)
    pd.testing.assert_frame_equal(more[more["repeat"] < 3].reset_index(drop=True), before, check_exact=True)
    assert {path: path.stat().st_mtime_ns for path in files} == files
    assert len(list(setup.out.rglob("*.npz"))) == 6
    build([*rows, ("Q", "a", "small", "lift", None)], repeats=2, learners=(DENSITY,)).collect(setup)
    assert len(list(setup.out.rglob("*.npz"))) == 10


def test_grip_is_chosen_by_what_was_learned(setup):
    """Whoever has lifted what the stick is made of reaches with the end by which it costs less work."""
    held = load_tools(MODELS / "tools" / "com.yaml")[:3]
    (stick, *_) = load_tools(MODELS / "tools" / "novel.yaml")
    frame = pd.DataFrame({"object": [*(tool.name for tool in held), stick.name]})
    frame = frame.assign(do=["lift"] * 3 + ["choose"], task=[""] * 3 + ["reach"])
    table = check_trials(frame, [*held, stick], tasks=["reach"])
    lifts = TableExperiment("mine", table, {"reach": Robot().load_task("reach")}, 4, (DENSITY,)).collect(setup)
    chosen = lifts[lifts["do"] == "choose"]
    assert lifts.loc[lifts["do"] == "lift", "chosen"].tolist() == [""] * 12
    assert (chosen["chosen"] == "steel").sum() >= 3
    assert chosen["force"].isna().all()
    assert chosen["expected"].notna().all()


def test_people_follow_with_their_own_forces(setup):
    frame = pd.DataFrame({"participant": ["P", "P", "Q"], "object": ["small"] * 3, "force": [2.5, None, 3.5]})
    lifts = TableExperiment("mine", check_trials(frame, TOOLS), learners=(DENSITY,)).collect(setup)
    people = lifts[lifts["learner"] == "people"]
    assert people["force"].tolist() == [2.5, 3.5]
    assert people["participant"].tolist() == ["P", "Q"]
    assert people["weight"].to_numpy() == pytest.approx(9.81 * 0.3)
    assert people["expected"].isna().all()
    assert len(lifts) == 5


def test_object_that_the_arm_cannot_hold_is_named_with_its_row(setup):
    rows = [("P", "a", "small", "lift", None), ("P", "a", "large", "lift", 15.0)]
    said = refuse(build(rows).read, setup, error=InfeasibleError)
    assert said.startswith("trials: row 3, object: is 'large', which weighs 15 kg and loads ")


def test_results_have_means_figures_and_lifts(setup):
    rows = [("P", "a", "small", "lift", None), ("P", "b", "large", "hold", None), ("Q", "a", "large", "lift", None)]
    experiment = build(rows, repeats=2, learners=(DENSITY,))
    results = experiment.run(dataclasses.replace(setup, observers=experiment.observers))
    assert set(results.figures) == {"force", "moved"}
    assert [axes.get_title() for axes in results.figures["force"][1]().axes] == ["small, density", "large, density"]
    assert results.numbers["participants"] == 2
    assert [(each["phase"], each["object"]) for each in results.numbers["means"]] == [
        ("a", "small"),
        ("b", "large"),
        ("a", "large"),
    ]
    assert results.lifts["learner"].unique().tolist() == ["density"]


def build_lifts(**changes):
    """Two observers of a learner, and two people, in one group; the second observer has two lifts."""
    lifts = pd.DataFrame(
        {
            "learner": ["density"] * 3 + ["people"] * 2,
            "observer": [0, 1, 1, 0, 1],
            "group": "all",
            "phase": ["a"] * 5,
            "object": ["small"] * 5,
            "do": "lift",
            "measured": True,
            "weight": 3.0,
            "force": [2.0, 4.0, 6.0, 1.0, 4.0],
            "expected": [0.2, 0.4, 0.6, np.nan, np.nan],
            "felt": np.nan,
            "heaviness": np.nan,
            "moved": np.nan,
            "chosen": "",
        }
    )
    return lifts.assign(**changes)


def test_each_observer_counts_once():
    density, people = average(build_lifts())
    assert density["force_N"] == pytest.approx(3.5)
    half = 12.7062 * np.std([2.0, 5.0], ddof=1) / np.sqrt(2.0)  # Student's, 1 degree of freedom
    np.testing.assert_allclose(density["force_N_ci95"], [3.5 - half, 3.5 + half], rtol=1e-5)
    assert (density["observers"], density["rows"], density["weight_N"]) == (2, 3, 3.0)
    assert (people["learner"], people["force_N"]) == ("people", pytest.approx(2.5))
    assert "expected_kg" not in people
    assert "felt_N" not in density


def test_rows_that_are_not_measured_do_not_count():
    (density, _) = average(build_lifts(measured=[True, True, False, True, True]))
    assert density["force_N"] == pytest.approx(3.0)


def test_pushes_that_no_hand_exerts_are_named():
    """People push as they do; an object that is expected to weigh 72 N is lifted with 72 N by any observer."""
    lifts = build_lifts(object=["small", "large", "large", "small", "small"])
    assert describe_too_strong(lifts.assign(force=[2.0, 62.0, 61.0, 90.0, 1.0])) == ""
    said = describe_too_strong(lifts.assign(force=[2.0, 66.0, 72.0, 90.0, np.nan]))
    assert said.endswith("with an outstretched arm: large up to 72 N.")


def test_choices_are_shares():
    found = average(build_lifts(do="choose", chosen=["head", "foot", "head", "", ""]))[0]
    assert found["chosen"] == {"head": pytest.approx(2 / 3), "foot": pytest.approx(1 / 3)}
    assert "head 67%, foot 33%" in describe_means([found])


def test_table_leaves_out_what_is_empty_or_the_same_everywhere():
    table = tabulate_means(average(build_lifts()))
    assert table.columns.tolist() == ["object", "observers", "weight (N)", "force (N)", "expected (kg)"]
    assert tabulate_means(average(build_lifts(phase=["a", "b", "b", "a", "a"]))).columns.tolist()[0] == "phase"
    assert describe_means(average(build_lifts())).splitlines()[2].split()[:4] == ["people", "small", "2", "3.00"]


def test_numbers_are_those_of_each_observer_and_spreads_those_of_people():
    values, spreads = list_numbers(build_lifts(), None)
    assert values["density"]["force_N, small"].tolist() == [2.0, 5.0]
    assert set(values) == {"density"}
    assert spreads["force_N, small"].sd == pytest.approx(np.std([1.0, 4.0], ddof=1))
    assert spreads["force_N, small"].source == "2 people of the table"
    assert list_numbers(build_lifts(), 1.9)[1]["force_N, small"] == (1.9, "as given")


def test_mean_of_one_observer_has_no_interval():
    found = average(build_lifts(observer=[0, 0, 0, 0, 0]))[0]
    assert found["force_N"] == pytest.approx(4.0)
    assert "force_N_ci95" not in found
    assert tabulate_means([found])["force (N)"].tolist() == ["4.000"]
