"""Recovery of learners and of kappa: counts and correlations by hand, and a small run."""

import numpy as np
import pytest
from helpers.refusals import refuse_command
from helpers.results_files import read_numbers
from helpers.study_runs import run_study

from studies.recovery.command import STUDY, summarise
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
    assert first == pytest.approx({"correlation": 1.0, "rms_error": 0.1, "posterior_sd": 0.3})
    assert second["correlation"] == pytest.approx(-1.0)


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


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--lifts", "321"], "--lifts: is 321, must be from 2 to 320; the nearest is 320"),
        (["--draws", "2"], "--draws: is 2, must be from 4 to 1024; the nearest is 4"),
    ],
)
def test_numbers_out_of_bounds_are_refused(words, said):
    assert refuse_command("study", "recovery", *words).endswith(said)
