"""Groups: against conjugate normals, and the coverage of intervals over simulated groups."""

import numpy as np
import pytest

from affordance.extensions.people.groups import describe_groups, draw_groups, list_groups
from affordance.extensions.people.likelihood import list_free
from affordance.extensions.people.participant import Participant
from affordance.extensions.people.rivals import OWN_MEMORY

FREE = list_free(OWN_MEMORY, Participant())
ERROR = 0.3  # SD of what is known of one person, in SDs of the prior


def draw_alone(measured, rng, draws=100):
    """Draws from the posteriors of people whose parameters were measured with a normal error."""
    variance = 1.0 / (1.0 + ERROR**-2)
    noise = rng.standard_normal((len(measured), draws))
    return list((variance * measured[:, None] / ERROR**2 + np.sqrt(variance) * noise)[..., None])


def test_two_groups_are_those_of_a_grid():
    """Means, spread and their difference agree with the posterior on a grid, from measurements instead of draws."""
    rng = np.random.default_rng(0)
    measured = np.concatenate([rng.normal(-0.5, 0.5, 9), rng.normal(0.5, 0.5, 9)])
    found = draw_groups(draw_alone(measured, rng, 1000), ["A"] * 9 + ["B"] * 9, 0)
    mean, spread = np.linspace(-2.5, 2.5, 401)[:, None], np.linspace(0.01, 3.0, 300)
    variance = spread**2 + ERROR**2
    log_p = [
        (-0.5 * (y[:, None, None] - mean) ** 2 / variance - 0.5 * np.log(variance)).sum(axis=0) - mean**2
        for y in (measured[:9], measured[9:])
    ]
    p = [np.exp(each - max(each.max() for each in log_p)) for each in log_p]
    of_spread = p[0].sum(axis=0) * p[1].sum(axis=0) * np.exp(-(spread**2))
    of_spread /= of_spread.sum()
    assert found.spreads[:, 0].mean() == pytest.approx(of_spread @ spread, abs=0.03)
    for group in range(2):
        expected = (mean * p[group] / p[group].sum(axis=0)).sum(axis=0) @ of_spread
        assert found.means[:, group, 0].mean() == pytest.approx(expected, abs=0.04)


@pytest.mark.parametrize("size", [9])
def test_intervals_hold_as_often_as_they_say(size):
    """Over 15 pairs of groups drawn from the prior; a share of .8 has a standard error of .1 then."""
    rng, held = np.random.default_rng(1), np.zeros((15, 3))
    for row in range(len(held)):
        means, spread = np.sqrt(0.5) * rng.standard_normal(2), np.sqrt(0.5) * abs(rng.standard_normal())
        own = np.repeat(means, size) + spread * rng.standard_normal(2 * size)
        measured = own + ERROR * rng.standard_normal(2 * size)
        drawn = draw_groups(draw_alone(measured, rng), ["A"] * size + ["B"] * size, row)
        differences = drawn.means[:, 1, 0] - drawn.means[:, 0, 0]
        for column, (values, true) in enumerate(
            [(drawn.means[:, 0, 0], means[0]), (drawn.spreads[:, 0], spread), (differences, means[1] - means[0])]
        ):
            low, high = np.quantile(values, [0.1, 0.9])
            held[row, column] = low <= true <= high
    assert (np.abs(held.mean(axis=0) - 0.8) < 0.3).all()


def test_people_are_pulled_to_their_group_and_few_draws_are_warned_of():
    rng = np.random.default_rng(2)
    measured = np.array([-0.1, 0.0, 0.1, 0.05, -0.05, 1.5])
    own, people = draw_alone(measured, rng), [f"P{i}" for i in range(6)]
    drawn = draw_groups(own, ["A"] * 6, 0)
    assert drawn.people[:, 5, 0].mean() < own[5].mean()
    said = describe_groups(FREE, people, ["A"] * 6, drawn)
    assert {*said} == {"groups", "spread", "ratios", "people", "effective_draws"}
    assert not said["ratios"]
    far = [*own[:5], rng.uniform(-8.0, 8.0, own[5].shape)]
    lines = list_groups(describe_groups(FREE, people, ["A"] * 6, draw_groups(far, ["A"] * 6, 0)))
    assert lines[0].startswith("group A: push_error ")
    assert "fewer than 10 effective draws of P5: use more --draws" in lines[-1]
