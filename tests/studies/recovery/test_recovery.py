"""Recovery of learners and of kappa: counts and correlations by hand, and a small run."""

import math

import numpy as np
import pytest
from helpers.refusals import refuse_command
from helpers.results_files import read_numbers
from helpers.study_runs import run_study
from scipy.special import stdtrit

from studies.recovery.command import STUDY, compute_lead, count_per_group, summarise
from studies.recovery.groups import (
    EFFECT,
    QUANTITIES,
    SPREADS,
    GroupRecovery,
    list_parameters,
    measure_groups,
    simulate_person,
    summarise_groups,
)
from studies.recovery.people import Recovery, list_rivals, simulate, weigh


def test_counts_and_correlations_by_hand():
    """Six people of two learners; the second learner is taken for the first once, after more lifts."""
    config = Recovery(seed=0, draws=4, particles=2, lifts=(10, 20))
    score = np.zeros((6, 2, 2))
    score[::2, 0] = score[1::2, 1] = 5.0
    score[5, :, 1] = [5.0, 1.0]
    log_kappa = np.array([np.nan, -1.0, np.nan, -2.0, np.nan, -3.0])
    mean = np.column_stack([log_kappa + np.tile([0.0, 0.1], 3), -log_kappa])
    found = {"score": score, "bic": -score, "log_kappa": log_kappa, "mean": mean, "sd": np.full((6, 2), 0.3)}
    numbers = summarise(config, ["a", "b"], found)
    assert (
        numbers["confusion_by_score"] == numbers["confusion_by_bic"] == {10: [[3, 0], [0, 3]], 20: [[3, 0], [1, 2]]}
    )
    first, second = numbers["log_kappa"][10], numbers["log_kappa"][20]
    per_group = count_per_group(0.3)
    assert first == pytest.approx(
        {"correlation": 1.0, "rms_error": 0.1, "posterior_sd": 0.3, "people_per_group": per_group}
    )
    assert numbers["leads"][10]["a"] == {"a": {}, "b": {"mean": 5.0, "sd": 0.0, "people": 2}}
    assert numbers["leads"][20]["b"]["a"]["mean"] == pytest.approx((5.0 + 5.0 - 4.0) / 3.0)
    assert second["correlation"] == pytest.approx(-1.0)


@pytest.mark.parametrize("leads", [[3.0, -1.0, 7.0, 3.0], [3.0, 2.0, 4.0, 3.0], [3.0, -4.0, 5.0, 3.0]])
def test_participants_show_a_lead_as_often_as_was_asked(leads):
    """Student's test finds the mean of simulated leads in four of five experiments, and less often with one fewer."""
    rng, found, shares = np.random.default_rng(0), compute_lead(np.array(leads)), []
    for count in (found["people"] - 1, found["people"]):
        drawn = rng.normal(found["mean"], found["sd"], (100_000, count))
        t = drawn.mean(axis=1) / drawn.std(axis=1, ddof=1) * math.sqrt(count)
        shares.append((t > stdtrit(count - 1, 0.95)).mean())
    assert shares[0] < 0.8 <= shares[1] + 0.005


def test_a_lead_that_is_not_above_zero_needs_no_number_of_participants():
    assert "people" not in compute_lead(np.array([-1.0, 1.0]))
    assert "people" not in compute_lead(np.array([1.0]))
    assert "people" not in compute_lead(np.array([-100.0, 100.001]))


@pytest.mark.parametrize("posterior_sd", [0.05, 0.2, 0.36, 0.45])
def test_participants_per_group_tell_kappas_apart_as_often_as_was_asked(posterior_sd):
    """Posterior means of simulated people, under the prior that all share, are compared between groups."""
    rng, count = np.random.default_rng(1), count_per_group(posterior_sd)
    error_sd = (posterior_sd**-2 - 0.5**-2) ** -0.5
    weight = 0.5**2 / (0.5**2 + error_sd**2)
    groups = []
    for mean in (0.0, math.log(1.5)):
        log_kappa = rng.normal(mean, 0.3, (20_000, count))
        groups.append(weight * (log_kappa + rng.normal(0.0, error_sd, log_kappa.shape)))
    z = (groups[1].mean(axis=1) - groups[0].mean(axis=1)) / np.sqrt(
        (groups[0].var(axis=1, ddof=1) + groups[1].var(axis=1, ddof=1)) / count
    )
    assert 0.78 < (z > stdtrit(2 * count - 2, 0.95)).mean() < 0.84  # the number is rounded up


def test_posterior_as_wide_as_the_prior_tells_nothing():
    assert count_per_group(0.5) == math.inf


def test_posterior_of_draws_by_likelihood():
    mean, sd = weigh(np.array([1.0, 3.0]), np.log([[1.0, 3.0], [1.0, 1.0]]))
    np.testing.assert_allclose(mean, [2.0, 1.5])
    np.testing.assert_allclose(sd, [1.0, np.sqrt(0.75)])


def test_people_differ_and_are_the_same_again():
    config = Recovery(seed=0, draws=4, particles=2, lifts=(12,))
    kinds = list_rivals()[3]
    person, tools, log_kappa = simulate(config, kinds, 3)
    again, _, _ = simulate(config, kinds, 3)
    other, _, other_kappa = simulate(config, kinds, 8)
    assert (person.pushes == again.pushes).all()
    assert (person.pushes != other.pushes).all()
    assert log_kappa != other_kappa
    assert (len(person.objects), len(tools)) == (12, 5)


def test_a_small_run_names_every_learner(tmp_path):
    words = ("--repeats", 1, "--draws", 4, "--particles", 3, "--lifts", 12, "--jobs", 1, "--out", tmp_path)
    assert run_study(STUDY, *words) == 0
    numbers = read_numbers(tmp_path / "recovery")
    assert numbers["learners"] == ["density", "own_memory", "own_and_shared", "kinds_drawn", "Forgetting"]
    assert np.sum(numbers["confusion_by_score"]["12"], axis=1).tolist() == [1] * 5
    assert 0.0 < numbers["log_kappa"]["12"]["posterior_sd"] < 1.0


def draw_own(config, error, rng):
    """Draws of people of a pool, whose log kappa and log push_error were measured with a normal error."""
    free = list_parameters()
    sds = np.array([each.sd for each in free])
    spreads = np.array([SPREADS[each.name] for each in free]) / sds
    true = spreads * rng.standard_normal((3 * config.people, 2))
    true[2::3, 1] += math.log(EFFECT) / sds[1]
    measured, variance = true + error * rng.standard_normal(true.shape), 1.0 / (1.0 + error**-2)
    mean = variance * measured / error**2
    return mean[:, None] + math.sqrt(variance) * rng.standard_normal((len(mean), config.draws, 2))


def test_groups_of_people_who_are_known_well_are_recovered_with_their_effect():
    """Six pools of 15 people each: the effect of 1.5 is found in most, and no effect in few, as chance allows."""
    config = GroupRecovery(seed=0, draws=64, particles=1, people=15, sizes=(15,), groups=6)
    rng = np.random.default_rng(0)
    found = summarise_groups(np.stack([measure_groups(config, draw_own(config, 0.3, rng), 15, k) for k in range(6)]))
    effect, none = (found[key] for key in ("difference, with effect", "difference, without"))
    assert effect["kappa"]["found"] >= 0.6
    assert max(none["kappa"]["found"], none["push_error"]["found"], effect["push_error"]["found"]) <= 0.5
    assert abs(effect["kappa"]["bias"]) < 0.15
    assert found["mean"]["kappa"]["coverage"]["0.9"] >= 0.5
    assert "found" not in found["spread"]["kappa"]


def test_people_of_the_last_condition_have_the_effect():
    config = GroupRecovery(seed=0, draws=4, particles=2, people=1, sizes=(2,), groups=1)
    person = simulate_person(config, 1)
    assert len(person.objects) == 60
    assert (person.pushes == simulate_person(config, 1).pushes).all()
    assert (person.pushes != simulate_person(config, 2).pushes).any()


def test_a_small_run_recovers_groups(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("studies.recovery.groups.CYCLES", (1, 1))
    monkeypatch.setattr("affordance.extensions.people.fit.MOST_NOISE", 1e9)
    words = ("--groups", 2, "--repeats", 2, "--sizes", 2, "--draws", 4, "--particles", 2, "--jobs", 1)
    assert run_study(STUDY, *words, "--out", tmp_path) == 0
    numbers = read_numbers(tmp_path / "recovery")
    assert numbers["people_of_each_condition"] == numbers["groups"] == 2
    assert {*numbers["sizes"]["2"]} == {*QUANTITIES}
    assert "| 2 | kappa | difference, with effect |" in capsys.readouterr().out
    assert len([*(tmp_path / "recovery").rglob("repeat_*.npz")]) == 6


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--groups", "2", "--lifts", "12"], "--lifts: has no effect with --groups"),
        (["--sizes", "9"], "--sizes: has no effect without --groups"),
        (["--groups", "2", "--repeats", "12"], "--sizes: is 15, must be from 2 to 12; the nearest is 12"),
        (["--lifts", "321"], "--lifts: is 321, must be from 2 to 320; the nearest is 320"),
        (["--draws", "2"], "--draws: is 2, must be from 4 to 1024; the nearest is 4"),
    ],
)
def test_numbers_out_of_bounds_are_refused(words, said):
    assert refuse_command("study", "recovery", *words).endswith(said)
