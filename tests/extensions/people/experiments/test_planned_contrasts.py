"""Planned contrasts are what SciPy's t tests test; names are looked up in the table, and bad ones refused."""

import math

import numpy as np
import pandas as pd
import pytest
import scipy.stats
from helpers.refusals import refuse

from affordance.extensions.people.experiments.planned_contrasts import (
    compute_effect,
    compute_effects,
    count_for,
    describe_effects,
    describe_sizes,
    list_content,
    parse_contrast,
)
from affordance.extensions.people.experiments.prediction import count_people
from affordance.extensions.people.experiments.trial_cells import PEOPLE

PHASES = {"learn": ["small", "large"], "test": ["small", "large", "odd"]}


def build(learner="people", seed=0):
    """Lifts of nine persons in two groups; the last does not come to the test."""
    rng, rows = np.random.default_rng(seed), []
    for person in range(9):
        for phase, objects in PHASES.items():
            for cycle in range(4):
                rows += [
                    (person, f"P{person}", "AB"[person % 2], phase, cycle, name, rng.normal(len(name) + cycle, 1.0))
                    for name in objects
                    if (person, phase) != (8, "test")
                ]
    columns = ["observer", "participant", "group", "phase", "cycle", "object", "force"]
    table = pd.DataFrame(rows, columns=columns)
    return table.assign(learner=learner, do="lift", measured=True, heaviness=table["force"] ** 2, felt=np.nan)


LIFTS = build()


def mean(lifts):
    return lifts.groupby("observer")["force"].mean()


def compute(text, lifts=LIFTS):
    return compute_effect(parse_contrast(text, LIFTS), lifts)


TEST = LIFTS[LIFTS["phase"] == "test"]
ODD, SMALL = (TEST[TEST["object"] == name] for name in ("odd", "small"))
LEARN = LIFTS[(LIFTS["phase"] == "learn") & (LIFTS["object"] == "small")]
# Contrasts, and the persons' values that they compare: pairs, two groups, or a constant.
CASES = {
    "force: odd - small in test": (mean(ODD), mean(SMALL), "paired"),
    "force: test - learn in small": (mean(SMALL), mean(LEARN).iloc[:8], "paired"),
    "force: last - first in learn, small": (
        mean(LEARN[LEARN["cycle"] == 3]),
        mean(LEARN[LEARN["cycle"] == 0]),
        "paired",
    ),
    "force: last 2 - first in learn, small": (
        mean(LEARN[LEARN["cycle"] >= 2]),
        mean(LEARN[LEARN["cycle"] == 0]),
        "paired",
    ),
    "force: A - B in odd": (mean(ODD[ODD["group"] == "A"]), mean(ODD[ODD["group"] == "B"]), "groups"),
    "force: B - 8.83 in learn, small": (mean(LEARN[LEARN["group"] == "B"]), 8.83, "constant"),
    "force: odd - 3.5": (mean(ODD), 3.5, "constant"),
}


@pytest.mark.parametrize("text", CASES)
def test_effects_are_those_of_scipys_t_tests(text):
    one, other, kind = CASES[text]
    test = {"paired": scipy.stats.ttest_rel, "groups": scipy.stats.ttest_ind, "constant": scipy.stats.ttest_1samp}
    expected, found = test[kind](one, other), compute(text)
    interval = expected.confidence_interval(0.95)
    shift = other if kind == "constant" else 0.0
    np.testing.assert_allclose([found.low, found.high], np.array(interval) - shift, rtol=1e-10)
    np.testing.assert_allclose(found.p_value, expected.pvalue, rtol=1e-9)
    assert found.free == expected.df


def test_first_and_last_lifts_are_those_of_each_object_and_phase():
    lifts = pd.concat([LIFTS[LIFTS["cycle"] == cycle] for cycle in (0, 3)])
    own = lifts.pivot_table("force", ["observer", "phase", "object"], "cycle")
    difference = own[3].groupby("observer").mean() - own[0].groupby("observer").mean()
    np.testing.assert_allclose(compute("force: last - first").mean, difference.mean(), rtol=1e-12)


def test_rows_that_are_not_measured_and_other_measures_do_not_count():
    spoilt = LIFTS.assign(force=LIFTS["force"].where(LIFTS["cycle"] > 0, 99.0), measured=LIFTS["cycle"] > 0)
    assert compute("force: odd - 3", spoilt) == compute("force: odd - 3", LIFTS[LIFTS["cycle"] > 0])
    assert compute("heaviness: odd - 3").mean == pytest.approx((ODD["force"] ** 2).mean() - 3.0)
    assert compute("felt: odd - 3") is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("force large - small", "must be 'MEASURE: ONE - OTHER [in PLACE, ...]'"),
        ("forse: large - small", "measure is 'forse', must be one of force, heaviness, felt; did you mean 'force'?"),
        ("force: lrage - small", "is 'lrage', must be one of small, large, odd, A, B, learn, test, first, last; did"),
        ("force: large - small in tset", "is 'tset', must be one of "),
        ("force: large - small in phase=tset", "is 'tset', must be one of learn, test; did you mean 'test'?"),
        ("force: large - large", "large and large are the same"),
        ("force: large - A", "large and A are object and group, must be of one kind"),
        ("force: large - small in odd", "object is given twice"),
        ("force: odd - small in learn", "the table has no lift of odd, learn"),
        ("force: A - 3 in test, learn", "phase is given twice"),
        ("force: last 0 - 3", "the table has no lift of last 0"),
    ],
)
def test_bad_contrasts_are_refused_with_the_nearest_name(text, said):
    message = refuse(parse_contrast, text, LIFTS)
    assert message.startswith("--contrast: is ")
    assert said in message


def test_name_with_two_meanings_is_refused_until_its_kind_is_said():
    lifts = LIFTS.replace({"phase": {"test": "odd"}})
    assert "'odd' is object and phase; write object=odd" in refuse(parse_contrast, "force: odd - small", lifts)
    parsed = parse_contrast("force: object=odd - small in phase=odd", lifts)
    assert (parsed.one.kind, parsed.places[0].kind) == ("object", "phase")


def test_levels_that_no_participant_has_both_of_are_refused():
    lifts = LIFTS[(LIFTS["group"] == "A") == (LIFTS["phase"] == "learn")]
    assert "no participant does both" in refuse(parse_contrast, "force: learn - test in small", lifts)


@pytest.mark.parametrize("groups", [1, 2])
@pytest.mark.parametrize("effect", [0.4, 0.8, 1.6])
def test_number_of_people_has_the_power_in_simulated_tests(groups, effect):
    count, rng = int(count_people(effect, 0.8, groups=groups, significance=0.02)), np.random.default_rng(3)

    def find_power(count):
        one = rng.normal(effect, 1.0, (20_000, count))
        if groups == 2:
            return (scipy.stats.ttest_ind(one, rng.normal(0.0, 1.0, one.shape), axis=1).pvalue < 0.02).mean()
        return (scipy.stats.ttest_1samp(one, 0.0, axis=1).pvalue < 0.02).mean()

    assert find_power(count) > 0.79
    assert find_power(count - 1) < 0.81


def test_people_needed_follow_from_effects_spread_and_number_of_contrasts():
    contrast = parse_contrast("force: odd - small in test", LIFTS)
    (effects,) = compute_effects([contrast], pd.concat([build("one", 1), build("two", 2).assign(force=1.0), LIFTS]))
    one, people = effects["one"], effects[PEOPLE]
    sizes = count_for(contrast, effects, None, contrasts=3, power=0.9)
    sd = math.hypot(one.sd, people.sd)
    assert sizes.find["one"] == count_people(one.mean / sd, 0.9, groups=1, significance=0.05 / 3)
    assert sizes.find["two"] == math.inf
    between = math.sqrt(0.5 * one.sd**2 + people.sd**2)
    assert sizes.reject["one", "two"] == count_people(one.mean / between, 0.9, groups=1, significance=0.05 / 3)
    assert count_for(contrast, effects, 100.0).find["one"] > sizes.find["one"]
    text = describe_sizes(contrast, sizes)
    assert text.count(".") - text.count("power .9") >= 2
    assert "no number of people if they learn like two" in text
    assert "paired t test (two-sided .0167, power .9" in text
    (content,) = list_content([contrast], [effects], [sizes])
    assert content["people_to_find"]["two"] is None
    assert content["effects"][PEOPLE]["persons"] == [8]


def test_only_people_are_tested_and_one_person_says_nothing():
    contrast = parse_contrast("force: odd - small in test", LIFTS)
    (effects,) = compute_effects([contrast], pd.concat([build("one", 1), LIFTS]))
    text = describe_effects(contrast, effects)
    assert text.count("p = ") == 1
    assert "paired t test, t(7) = " in text
    (effects,) = compute_effects([contrast], LIFTS[LIFTS["observer"] == 0])
    assert "fewer than two persons" in describe_effects(contrast, effects)
