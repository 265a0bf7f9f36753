"""Beliefs of a ledger against the reference by quadrature, and against learning one trial after the other."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.trials import BRASS, STEEL, TAU_ARM, WOOD, hold, hold_workshop

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.extensions.memory.ledger import Selection, open_memory, replay
from affordance.extensions.memory.summary import summarise
from affordance.extensions.memory.trial_evidence import TrialEvidence
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import Geometry
from affordance.proprioception.torque_noise import WeberNoise
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
