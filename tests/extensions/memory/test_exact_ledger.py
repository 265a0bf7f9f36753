"""Beliefs of a ledger against the reference by quadrature, and against learning one trial after the other."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from helpers.trials import BRASS, PLAIN, STEEL, TAU_ARM, WOOD, build_geometry, get_regressor, hold

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.extensions.memory.ledger import Selection, open_memory, replay
from affordance.extensions.memory.summary import summarise
from affordance.extensions.memory.trial_evidence import TrialEvidence, gather
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import Geometry
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from studies import exact_reference as reference

PRIOR = Prior()
_COLOURS = (BRASS, WOOD)


def _keep(case: reference.Case) -> list[TrialEvidence]:
    """Describes the holds of a reference case as trials, whose parts have the parameters of their regressor."""
    holds, owned, _ = case
    trials = []
    for number, each in enumerate(holds):
        size = len(owned[each.object])
        Phi = np.zeros((10, size))
        Phi[0], Phi[1 : 1 + size] = 1e-4, 1e-4 * np.eye(size)
        Y = np.zeros((7, 10))
        Y[:, 1 : 1 + size] = 1e4 * each.A  # so that Y Phi = A
        parts = tuple(
            PartAppearance(_COLOURS[i], (0.1 + 0.1 * each.object,), (0.1 * i, 0.0, 0.0)) for i in owned[each.object]
        )
        noise = WeberNoise()
        trials.append(
            TrialEvidence(
                f"rod {each.object}",
                parts,
                Geometry(Phi, np.zeros((0, 10, size))),
                noise,
                noise.compute_features(each.y, each.tau_arm, Y),
                1,
                7,
                "arm",
                time=f"2026-01-01T00:00:{number:02d}Z",
            )
        )
    return trials


@pytest.mark.parametrize(
    "rods", [[[8000], [8000 / 1.3]], [[8000], [4000]], [[8000], [8000], [800]], [[8000, 700], [4000, 700], [8000]]]
)
def test_contradictory_objects_give_the_posterior_by_quadrature(tmp_path, rods):
    case = reference.build_case(rods, 2)
    wanted = reference.compute_posterior(*case, nodes=None if len(rods[0]) == 1 else 150)
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        ledger.append(_keep(case))
        memory = ledger.recall()
        shown = summarise(ledger, PRIOR).things
    for i, colour in enumerate(_COLOURS[: len(rods[0])]):
        found = memory.density(colour)
        assert found.mean == pytest.approx(wanted.mu[i].mean, rel=0.02)
        assert found.sd == pytest.approx(wanted.mu[i].sd, rel=0.05)
        assert found.median == pytest.approx(wanted.mu[i].median, rel=0.02)
    for k, thing in enumerate(shown):
        wanted_medians = [wanted.rho[k, i].median for i in range(len(rods[k]))]
        np.testing.assert_allclose(thing.densities, wanted_medians, rtol=0.02)


def _assert_same(one: MaterialMemory, other: MaterialMemory) -> None:
    order = [one.colours.index(colour) for colour in other.colours]
    np.testing.assert_allclose(one.belief.untruncated_mean[order], other.belief.untruncated_mean, rtol=1e-9)
    np.testing.assert_allclose(one.belief.covariance[np.ix_(order, order)], other.belief.covariance, rtol=1e-9)


@pytest.mark.parametrize("num_errors", [0, 2])
def test_recall_is_what_learning_from_one_trial_after_the_other_gives(tmp_path, num_errors):
    """Also after merging in another order, and after an object was forgotten."""
    things = (("bar", (WOOD,), (600.0,)), ("rod", (STEEL,), (7800.0,)), ("hammer", (WOOD, STEEL), (650.0, 7700.0)))
    trials = [hold(*things[i % 3], seed=i, model=WeberNoise(), num_errors=num_errors) for i in range(9)]
    rng = np.random.default_rng(5)
    for i in range(1, 9, 2):  # in other postures
        features = trials[i].features.copy()
        features[7:14] += rng.uniform(0.0, 5.0, 7)
        features[:7] += features[7:14] - TAU_ARM
        trials[i] = replace(trials[i], features=features)
    with open_memory(tmp_path / "a.sqlite") as ledger, open_memory(tmp_path / "b.sqlite") as other:
        ledger.append(trials[5:])
        other.append(trials[:6][::-1])
        ledger.append(other.list_trials())
        memory = ledger.recall()
        one_by_one = replay(trials, start_memory(), PRIOR)
        _assert_same(memory, one_by_one)
        assert memory.things == one_by_one.things
        assert memory.num_lifts == 9
        ledger.forget(Selection(object_name="rod"))
        _assert_same(
            ledger.recall(), replay([trial for trial in trials if trial.object_name != "rod"], start_memory(), PRIOR)
        )


def _learn(trials: Sequence[TrialEvidence]) -> MaterialMemory:
    """Learns from trials as the recall of a ledger does."""
    lifts = ((each.parts, lambda _, columns, t=each: t.describe(gather(t.geometry, columns))) for each in trials)
    return start_memory().remember(lifts, PRIOR)


@pytest.mark.parametrize("model", [PLAIN, WeberNoise(), WhiteNoise(sd=0.3)])
def test_repeated_holds_tell_little_more_about_a_material(model):
    """However often it is held, a piece may deviate from its material; that of many pieces averages out."""
    A = get_regressor() @ build_geometry(1).Phi[:, 0]
    sd = (A**2 / model.compute_sd(TAU_ARM + 600.0 * A) ** 2).sum() ** -0.5  # of the piece's density after one hold
    of_pieces = PRIOR.deviation * 600.0
    often = _learn([hold("bar", (WOOD,), (600.0,), seed, model=model) for seed in range(256)]).density(WOOD)
    assert often.sd == pytest.approx(np.hypot(of_pieces, sd / 16.0), rel=0.05)
    others = [hold("bar", (WOOD,), (600.0,), i, model=model) for i in range(100)]
    looks = [each.parts[0]._replace(sizes=(0.05 * 1.04**i,)) for i, each in enumerate(others)]
    others = [replace(each, parts=(look,)) for each, look in zip(others, looks, strict=True)]
    of_many = _learn(others).density(WOOD).sd
    assert of_many == pytest.approx(np.hypot(of_pieces, sd) / 10.0, rel=0.1)


def test_a_size_that_is_seen_wrongly_does_not_average_out():
    """A size that errs by a tenth leaves an SD of 9 % of the density or more, after one hold as after 64."""
    for count in (1, 64):
        trials = [hold("bar", (BRASS,), (8500.0,), seed, num_errors=1) for seed in range(count)]
        assert _learn(trials).density(BRASS).sd > 0.09 * 8500.0


def test_beliefs_after_repeated_holds_are_as_wide_as_their_errors():
    """Errors of the mean over their stated SDs have a root mean square of 1, after one hold and after eight."""
    rng = np.random.default_rng(5)
    for count in (1, 8):
        errors = []
        for observer in range(150):
            rho = 2000.0 * (1.0 + PRIOR.deviation * rng.standard_normal())
            seeds = range(8 * observer, 8 * observer + count)
            trials = [hold("bar", (WOOD,), (rho,), seed, model=WeberNoise()) for seed in seeds]
            density = _learn(trials).density(WOOD)
            errors.append((density.mean - 2000.0) / density.sd)
        assert 0.85 < np.sqrt(np.mean(np.square(errors))) < 1.2  # 1 +- .06 by chance
