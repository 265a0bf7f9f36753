import numpy as np
import pytest
from helpers.results_files import read_numbers
from helpers.short_holds import shorten
from helpers.study_runs import run_study

from affordance.belief.learner import Learner
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.reporting.section import render_section
from studies.learners import command as study_learners
from studies.learners import decoy_again, honest_objects
from studies.learners.kinds_figure import summarise_kinds


@pytest.fixture(scope="module")
def held(weight):
    """Simulation I with holds of a second, in which objects drop and rise."""
    return shorten(weight, 1.0)


@pytest.fixture(scope="module")
def observed(held):
    """One observer with one density for each colour, and one with kinds."""
    return {
        learner: decoy_again.run_observer(decoy_again.DecoyConfig(held, learner), 1)
        for learner in (Learner.DENSITY, Learner.KINDS_MAP)
    }


def test_until_the_decoy_comes_again_it_is_simulation_one_to_the_last_bit(held, observed):
    presented = held.present(None, 1)
    records = [each.record for each in presented]
    memories = [presented[0].memories[0], *(each.memories[1] for each in presented)]
    ours, again = observed[Learner.DENSITY]
    for one, other in zip(records, again, strict=False):
        np.testing.assert_array_equal(one.q, other.q)
        assert one.log_evidence == other.log_evidence
    for one, other in zip(memories, ours, strict=False):
        np.testing.assert_array_equal(one.belief.precision, other.belief.precision)
        np.testing.assert_array_equal(one.belief.information_vector, other.belief.information_vector)


def test_one_decoy_and_six_spoil_brass_for_one_learner_only(observed):
    medians = {
        learner: [float(memory.belief.compute_percentiles([0.5])[0, 0]) for memory in memories]
        for learner, (memories, _) in observed.items()
    }
    before, one, *_, six, _ = medians[Learner.DENSITY][4:]
    assert one < 0.75 * before
    assert six < 0.3 * before
    kinds = medians[Learner.KINDS_MAP][4:-1]
    np.testing.assert_allclose(kinds, kinds[0], rtol=1e-9)


def test_with_kinds_the_next_honest_object_is_held_level(observed):
    excursions = {learner: np.abs(records[-1].height_centre).max() for learner, (_, records) in observed.items()}
    assert excursions[Learner.DENSITY] > 0.1
    assert excursions[Learner.KINDS_MAP] < 0.02


def test_decoys_are_surprising_once_and_then_known(observed):
    _, records = observed[Learner.KINDS_MAP]
    p_values = [record.p_value for record in records]
    assert p_values[4] < 1e-6
    assert min(p_values[5:]) > 1e-3


def test_what_is_remembered_can_be_read(observed):
    memories, _ = observed[Learner.KINDS_MAP]
    brass, other = summarise_kinds(memories[-1])
    assert brass.is_most_populous
    assert not other.is_most_populous
    assert brass.density == pytest.approx(8500.0, rel=0.2)
    assert [known.num_lifts for known in brass.objects] == [2, 1, 1]
    assert not any(known.has_own for known in brass.objects)
    (decoy,) = other.objects
    assert decoy.has_own
    assert decoy.num_lifts == decoy_again.NUM_DECOYS
    assert decoy.density == pytest.approx(720.0, abs=4.0 * decoy.sd)
    assert 0.9 < decoy.probability <= 1.0


def test_honest_objects_teach_what_they_teach_with_one_density(weight):
    """Densities agree to 10 % and shares of right grips to 0.1 in Simulations II to IV, for one observer."""
    com = load_hold_experiment("com")
    com = shorten(com, 0.5, repetitions=2)
    found = {}
    for learner in (Learner.DENSITY, Learner.KINDS_MAP):
        config = honest_objects.HonestConfig(com, weight.settings.arm.parent, learner)
        found[learner] = honest_objects.run_repeat(config, 0)
    one, other = found.values()
    np.testing.assert_allclose(other["density_median"], one["density_median"], rtol=0.1)
    np.testing.assert_allclose(other["reach"], one["reach"], atol=0.1)
    assert one["reach"][0] == pytest.approx(0.5, abs=0.1)
    assert other["hammer"][-1] > 0.9
    assert list(other["first"]).count(True) == 2
    assert set(found[Learner.DENSITY]["num_kinds"]) == {0}


def test_study_writes_what_it_found(tmp_path, capsys, monkeypatch, weight):
    def pretend(com, models, folder, *, repeats, jobs):
        """Numbers of two observers of one learner about objects that look as they weigh, right half of the time."""
        arrays = {
            "density_median": np.ones((2, 3, 2)),
            "mass_error": np.full((2, 2), 0.04),
            "com_error": np.full((2, 2), 0.009),
            "excursion": np.full((2, 3), 0.01),
            "reach": np.full((2, 3), 0.5),
            "hammer": np.full((2, 3), 0.5),
            "num_kinds": np.array([[0, 2, 3], [0, 2, 2]]),
            "first": np.array([[True, True], [True, True]]),
        }
        return {learner.value: honest_objects.compute_metrics(arrays) for learner in Learner}

    monkeypatch.setattr(honest_objects, "run", pretend)
    monkeypatch.setattr(study_learners, "load_hold_experiment", lambda *_: shorten(weight, 0.5))
    monkeypatch.setattr(decoy_again, "NUM_DECOYS", 2)
    assert run_study(study_learners.STUDY, "--repeats", 2, "--jobs", 1, "--out", tmp_path) == 0
    numbers = read_numbers(tmp_path / "learners")
    assert set(numbers["brass_after_decoy"]) == {"density", "kinds_map", "kinds_drawn"}
    one, last = numbers["brass_after_decoy"]["density"]
    assert last < one < 6500.0
    for figure in ("decoy_again", "memory"):
        assert (tmp_path / "learners" / f"{figure}.png").stat().st_size > 10_000
    claims = render_section(study_learners.STUDY.section, numbers, study_learners.list_facts(2)).claims
    assert [claim.met for claim in claims if "brass" in claim.text][:2] == [False, True]
    assert "Kinds" in (tmp_path / "report.html").read_text(encoding="utf-8")
    printed = capsys.readouterr().out
    assert "kinds_map: brass" in printed
    assert "needless kinds in 50.0 % of first lifts" in printed
