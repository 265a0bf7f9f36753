"""Two ends: a frozen, balanced table, objects of either colour, shares and numbers of participants by hand."""

import hashlib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from helpers.refusals import refuse
from scipy.stats import binom, binomtest, fisher_exact

from affordance.belief.learners import DENSITY
from affordance.choice.ranking import rank_options
from affordance.exceptions import AffordanceError
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import table_lifts, two_ends, two_ends_design
from affordance.extensions.people.rivals import OWN_MEMORY
from affordance.files.model_folder import MODELS
from affordance.named_settings import change_settings
from affordance.objects.load import load_tools
from affordance.settings import DEFAULT_SETTINGS

NUMB = change_settings(DEFAULT_SETTINGS, {"noise.threshold": 50.0}).noise

TABLE = two_ends_design.build_trials()


def test_trial_table_is_the_frozen_one(monkeypatch):
    assert two_ends_design.hash_trials(TABLE) == two_ends_design.FROZEN
    assert two_ends_design.hash_trials(TABLE.assign(do="look")) != two_ends_design.FROZEN
    monkeypatch.setattr(two_ends_design, "SEED", 1)
    said = refuse(two_ends.read, Setup(), error=AffordanceError)
    assert said.endswith(f"must have {two_ends_design.FROZEN}, which is frozen")


def test_participants_are_balanced():
    assert TABLE["participant"].nunique() == 48
    first = TABLE.groupby("participant").agg(dense=("group", "first"), task=("task", "first"))
    first["lifted"] = TABLE[TABLE["do"] == "lift"].groupby("participant")["object"].first().str.split(",").str[0]
    assert (first.value_counts() == 6).all()
    assert len(first.value_counts()) == 8
    sides = TABLE.loc[TABLE["do"] == "choose", "dense_end_is"].value_counts(normalize=True)
    assert sides["left"] == pytest.approx(0.5, abs=0.06)


def test_each_participant_chooses_both_ends_after_0_1_2_and_6_lifts():
    for _, own in TABLE.groupby("participant"):
        lifts = (own["do"] == "lift").cumsum()[own["do"] == "choose"]
        assert lifts.tolist() == [0, 0, 1, 1, 2, 2, 6, 6]
        assert (
            own.loc[own["do"] == "choose"].groupby("phase")["task"].apply(set).tolist() == [{"reach", "hammer"}] * 4
        )
        assert not (own["do"].eq("lift") & own["object"].str.startswith("stick")).any()


def test_objects_differ_in_the_colour_of_the_dense_material_alone():
    blue, orange = np.split(np.array(two_ends.make_objects(MODELS), dtype=object), 2)
    for one, other in zip(blue, orange, strict=True):
        np.testing.assert_allclose(one.parameters, other.parameters, rtol=1e-12)
        colours = [[part.looks_like.name for part in tool.components] for tool in (one, other)]
        assert {"blue": "orange", "orange": "blue"}[colours[0][0]] == colours[1][0]
    densities = sorted({part.material.density for tool in blue for part in tool.components})
    assert densities[1] / densities[0] == pytest.approx(11.0, rel=0.05)
    assert blue[0].mass == pytest.approx(blue[1].mass)
    assert {grip.name for grip in blue[2].grips} == {"dense", "light"}


def test_data_sheet_is_the_table_with_empty_columns():
    sheet = two_ends_design.build_data_sheet()
    assert (sheet[[*two_ends_design.FILLED_IN]] == "").all(axis=None)
    pd.testing.assert_frame_equal(sheet[[*TABLE]], TABLE)
    assert sheet.groupby("participant")["trial"].max().tolist() == [14] * 48


def test_shares_by_hand():
    rows = [
        ("a", 0, 2, "reach", True),
        ("a", 0, 2, "hammer", True),
        ("a", 1, 2, "reach", True),
        ("a", 1, 2, "hammer", False),
    ]
    shares = two_ends.measure(pd.DataFrame(rows, columns=["learner", "observer", "lifts", "task", "right"]))
    found = shares.set_index("measure")["share"]
    assert (found["reach"], found["hammer"], found["agree"]) == (1.0, 0.5, 0.5)


def choose_likely(choice, memories, seed):
    """Chooses the end that is more probably the cheaper one, in place of the one of less expected work."""
    ranking = rank_options(choice, memories[0], np.random.default_rng(seed), 500)
    likely = max(ranking.ranked, key=lambda each: each.p_best).option
    return np.array([choice.options.index(likely)]), np.array([False])


def replace_stick(patch, file, place):
    """Another object in place of the stick, with its ends named as those of the stick."""
    make, dense = two_ends.make_objects, {"steel": "dense", "wood": "light"}

    def make_other(models):
        tools, other = make(models), load_tools(models / "tools" / file)[place]
        grips = tuple(replace(each, name=dense.get(each.name, each.name)) for each in other.grips)
        parts = [part.material.density for part in other.components]
        return [
            tool
            if not tool.name.startswith("stick")
            else replace(
                tool,
                grips=grips or tool.grips,
                components=tuple(
                    replace(part, material=(own := tool.components[int(each == max(parts))].material), looks_like=own)
                    for part, each in zip(other.components, parts, strict=True)
                ),
            )
            for tool in tools
        ]

    patch.setattr(two_ends, "make_objects", make_other)


# One thing that is changed, with the claim that it contradicts; None changes nothing, and all claims are met.
CHANGED = {
    None: (lambda patch, setup: setup, ""),
    "the stick is a hammer": (lambda patch, setup: replace_stick(patch, "novel.yaml", 1) or setup, "by_chance"),
    "nothing is felt": (lambda patch, setup: setup.change(noise=NUMB), "by_look"),
    "the stick is lifted": (lambda patch, setup: replace_stick(patch, "com.yaml", 0) or setup, "by_object"),
    "the more probable end": (
        lambda patch, setup: patch.setattr(table_lifts, "choose_by_expectation", choose_likely) or setup,
        "reach_first",
    ),
}


@pytest.mark.parametrize("what", CHANGED)
def test_each_claim_is_contradicted_by_one_change(what, tmp_path, monkeypatch):
    monkeypatch.setattr(two_ends, "_list_learners", lambda setup: [DENSITY, OWN_MEMORY])
    change, key = CHANGED[what]
    setup = change(monkeypatch, Setup(observers=16, out=tmp_path, jobs=1))
    met = {each.key: each.met for each in two_ends.judge(two_ends.measure(two_ends.collect(setup)))}
    assert {*met} == {key for _, key in CHANGED.values() if key}
    assert all(met.values()) if not key else not met[key], met


@pytest.mark.parametrize(
    ("one", "other", "count"),
    [(0.69, None, 44), (0.0, None, 5), (1.0, None, 5), (0.83, 0.99, 46), (0.9, 0.6, 30), (0.52, None, 3863)],
)
def test_participants_that_tell_shares_apart(one, other, count):
    """Four of four right answers have p = .06, so fewer than five participants never tell anything from chance."""
    assert two_ends.count_people(one, other) == count
    assert two_ends.count_people(0.7, 0.7) == np.inf


@pytest.mark.parametrize(("one", "other", "count"), [(0.69, None, 44), (0.83, 0.99, 46)])
def test_tests_of_scipy_find_shares_in_four_of_five_experiments(one, other, count):
    """With one participant fewer they find them less often."""
    shares = []
    for number in (count - 1, count):
        hits = np.arange(number + 1)
        if other is None:
            found = np.array([[binomtest(each, number, 0.5, "greater").pvalue <= 0.05] for each in hits])
            shares.append(binom.pmf(hits, number, one) @ found[:, 0])
        else:
            found = [
                [fisher_exact([[b, number - b], [a, number - a]], "greater").pvalue <= 0.05 for b in hits]
                for a in hits
            ]
            shares.append(binom.pmf(hits, number, one) @ np.array(found) @ binom.pmf(hits, number, other))
    assert shares[0] < 0.8 <= shares[1] < 0.83


def test_results_have_the_table_to_register_and_the_sheet_to_fill_in(tmp_path, monkeypatch):
    """Choices are made up: the learner a is always right, b by a coin."""
    rows = [
        (learner, observer, lifts, task, learner == "a" or (observer + lifts) % 2 == 0)
        for learner in ("a", "b")
        for observer in range(48)
        for lifts in two_ends_design.ASKED
        for task in two_ends_design.TASKS
    ]
    choices = pd.DataFrame(rows, columns=["learner", "observer", "lifts", "task", "right"])
    monkeypatch.setattr(two_ends, "collect", lambda setup: choices)
    results = two_ends.run(Setup(observers=48))
    for write in results.files.values():
        write(tmp_path)
    text = (tmp_path / "trials.csv").read_bytes()
    assert hashlib.sha256(text).hexdigest() == two_ends_design.FROZEN == results.numbers["sha256"]
    assert (tmp_path / "data_sheet.csv").read_text().startswith("participant,trial,group,phase,object,do,task,")
    assert results.numbers["shares"]["a"]["reach"]["6"][0] == 1.0
    assert results.numbers["contrasts"][0]["people"] <= 7
    (*_, contrasts) = results.tables.values()
    assert "_" not in "".join(contrasts) + "".join(map(str, contrasts.to_numpy().ravel()))
    assert contrasts["people"].dtype == int
    assert all(draw() for _, draw in results.figures.values())
    values = two_ends.predict(Setup(observers=48)).values
    assert values["b"]["hammer_1"].mean() == 0.5


def test_shares_of_all_and_of_nobody_are_drawn():
    """Wilson's intervals end at 0 and 1 up to rounding, which no length of a bar may fall below."""
    rows = [
        ("a", observer, lifts, task, lifts > 0)
        for observer in range(48)
        for lifts in (0, 1)
        for task in two_ends_design.TASKS
    ]
    shares = two_ends.measure(pd.DataFrame(rows, columns=["learner", "observer", "lifts", "task", "right"]))
    assert two_ends.draw(shares).axes[0].get_title() == "right end to reach"
    assert two_ends.tabulate(shares).loc["a"].shape == (3, 3)
