"""A small version of studies/speed/inner_vs_full.py."""

import numpy as np
import pytest

from affordance.choice.motion_cost import Costs
from affordance.experiments.protocol_runs import load_choice_experiment
from studies.speed.inner_vs_full import BOUND, Comparison, compare, draw_crooked, draw_densities


@pytest.fixture(scope="module")
def experiment():
    return load_choice_experiment("reach")


def test_crooked_tools_are_one_piece_and_held_along_the_part_in_the_hand(experiment):
    rng = np.random.default_rng(0)
    for number in range(5):
        tool = draw_crooked(rng, f"crooked {number}", experiment.novel[0].components)
        for held in tool.list_gripped().values():
            near, far = sorted(held.components, key=lambda part: part.X_TE[0, 3])
            # The part in the hand begins there and lies along Tx.
            np.testing.assert_allclose(near.X_TE[:3, 3], [near.shape.sizes[0], 0.0, 0.0], atol=1e-12)
            np.testing.assert_allclose(np.abs(near.X_TE[:3, 0]), [1.0, 0.0, 0.0], atol=1e-12)
            # The other begins where it ends.
            end = np.array([2.0 * near.shape.sizes[0], 0.0, 0.0])
            assert np.linalg.norm(far.X_TE[:3, 3] - end) == pytest.approx(far.shape.sizes[0])


def test_crooked_tool_is_judged_alike_in_both_ways(experiment):
    tool = draw_crooked(np.random.default_rng(1), "crooked", experiment.novel[0].components)
    rho = draw_densities(experiment.experience, experiment.settings, 3)
    compared = compare(tool, experiment.task, experiment.experience, rho)
    assert compared.full.feasible.all()
    assert compared.num_same == 3
    assert compared.differences.shape == (6,)
    assert 0.0 < compared.differences.max() < BOUND


def test_beliefs_come_by_turns_from_before_and_after_a_trial(experiment):
    rho = draw_densities(experiment.experience, experiment.settings, 400)
    assert rho.shape == (400, 2)
    before, after = rho[::2], rho[1::2]
    assert (after.std(axis=0) < before.std(axis=0)).any()


def test_what_differs_is_counted():
    nothing = np.zeros((2, 3))
    work = np.array([[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]])
    inner = Costs(work, nothing, np.ones((2, 3), dtype=bool), work)
    executed = np.array([[1.1, 3.0, np.inf], [2.0, 2.0, 9.0]])
    full = inner._replace(work=executed, cost=executed, feasible=np.array([[1, 1, 0], [1, 1, 1]], dtype=bool))
    compared = Comparison(inner, full)
    assert compared.num_same == 1
    # The second is chosen wrongly and costs half as much again; of the third the first grip cannot be had.
    np.testing.assert_allclose(compared.losses, [0.0, 0.5, np.inf])
    np.testing.assert_allclose(np.sort(compared.differences), [0.0, 0.0, 0.1, 2.0, 3.5])
