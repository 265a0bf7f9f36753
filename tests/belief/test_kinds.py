from dataclasses import replace

import numpy as np
import pytest

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.kinds import (
    KindPrior,
    Kinds,
    KnownObject,
    Membership,
    OwnDensities,
    assign,
    find_twins,
    merge,
    teach,
    tidy,
)
from affordance.belief.likelihood import Likelihood

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation_sd=100.0)
FIRST = KindPrior(1000.0, 4000.0)


def build(colours, lifts, priors=None):
    """Kinds of colours that were taught by lifts, from the density, its error and the kind of each lift."""
    kinds = Kinds().add(colours, [FIRST] * len(colours) if priors is None else priors)
    belief = kinds.belief
    for density, sd, kind in lifts:
        likelihood = Likelihood(np.array([[sd**-2]]), np.array([density * sd**-2]), 0.0)
        belief = teach(belief, [kind], likelihood, PRIOR.deviation_sd)
    return replace(kinds, belief=belief)


def populate(kinds, memberships):
    """Adds objects of one colour each to kinds, by the kind of each object."""
    objects = tuple(KnownObject((), (kinds.colours[kind],), (Membership(kind, 2, 0.9),)) for kind in memberships)
    return replace(kinds, objects=objects)


def test_a_lift_of_two_colours_teaches_the_kinds_it_was_judged_to_be_of(rng):
    """Mean and covariance agree with inference in moments in which the object's two deviations are unknowns too."""
    belief = DensityBelief.from_moments([5000.0, 900.0, 3000.0], np.diag([300.0, 200.0, 400.0]) ** 2)
    R, y, sd = rng.normal(size=(4, 2)), rng.normal(size=4) * 3000.0, 250.0
    taught = teach(belief, [2, 0], Likelihood(R.T @ R / sd**2, R.T @ y / sd**2, 0.0), PRIOR.deviation_sd)
    H = np.zeros((4, 5))  # three kinds, two deviations
    H[:, [2, 0]] = R
    H[:, 3:] = R
    mean = np.array([5000.0, 900.0, 3000.0, 0.0, 0.0])
    covariance = np.diag([300.0, 200.0, 400.0, 100.0, 100.0]) ** 2
    gain = covariance @ H.T @ np.linalg.inv(H @ covariance @ H.T + sd**2 * np.eye(4))
    np.testing.assert_allclose(taught.untruncated_mean, (mean + gain @ (y - H @ mean))[:3], rtol=1e-9)
    np.testing.assert_allclose(taught.covariance, (covariance - gain @ H @ covariance)[:3, :3], rtol=1e-7, atol=1e-6)


def test_merged_kinds_believe_what_one_kind_would_have_learned():
    lifts = [(5000.0, 300.0, 0), (5100.0, 150.0, 1), (2000.0, 200.0, 2), (4900.0, 250.0, 1)]
    priors = [FIRST, KindPrior(5500.0, 11_000.0), FIRST]
    merged = merge(populate(build((0, 0, 1), lifts, priors), [0, 1, 1, 2]), 0, 1)
    together = build((0, 1), [(5000.0, 300.0, 0), (5100.0, 150.0, 0), (2000.0, 200.0, 1), (4900.0, 250.0, 0)])
    assert merged.colours == (0, 1)
    assert merged.priors == (FIRST, FIRST)
    np.testing.assert_allclose(merged.belief.precision, together.belief.precision, rtol=1e-12)
    np.testing.assert_allclose(merged.belief.information_vector, together.belief.information_vector, rtol=1e-12)
    assert [known.memberships[0].kind for known in merged.objects] == [0, 0, 0, 1]


@pytest.mark.parametrize(("difference", "are_twins"), [(0.0, True), (90.0, True), (110.0, False), (500.0, False)])
def test_twins_differ_by_less_than_objects_of_one_material(difference, are_twins):
    kinds = build((0, 1, 0), [(5000.0 + difference * (k % 3 == 0), 30.0, 2 * (k % 3 == 0)) for k in range(3000)])
    assert find_twins(kinds, PRIOR.deviation_sd) == ((0, 2) if are_twins else None)


def test_kinds_of_different_colours_are_no_twins():
    assert find_twins(build((0, 1), [(5000.0, 30.0, k % 2) for k in range(200)]), PRIOR.deviation_sd) is None


def test_kinds_about_which_little_is_known_are_no_twins():
    assert find_twins(build((0, 0), [(5000.0, 300.0, 0), (5000.0, 300.0, 1)]), PRIOR.deviation_sd) is None


def test_twins_become_one_and_its_members_leave_no_trace():
    kinds = populate(build((0, 0), [(5000.0, 100.0, k % 2) for k in range(80)]), [0, 0, 1])
    own = OwnDensities((0,), DensityBelief.from_moments([5000.0], [[400.0]]))
    kinds = replace(kinds, objects=(*kinds.objects[:2], kinds.objects[2]._replace(own=own)))
    tidied = tidy(kinds, PRIOR)
    assert tidied.colours == (0,)
    assert tidied.objects[2].own.columns == ()


def test_a_forgotten_kind_leaves_the_others_as_they_were():
    belief = DensityBelief.from_moments([5000.0, 900.0, 3000.0], [[9e4, 3e4, 2e4], [3e4, 4e4, 1e4], [2e4, 1e4, 16e4]])
    priors = (FIRST, KindPrior(5000.0, 10_000.0), KindPrior(3000.0, 6000.0))
    tidied = tidy(populate(Kinds((0, 0, 1), belief, (), priors), [0, 2, 2]), PRIOR)
    assert tidied.colours == (0, 1)
    assert tidied.priors == (priors[0], priors[2])
    np.testing.assert_allclose(tidied.belief.untruncated_mean, [5000.0, 3000.0])
    np.testing.assert_allclose(tidied.belief.covariance, [[9e4, 2e4], [2e4, 16e4]])
    assert [known.memberships[0].kind for known in tidied.objects] == [0, 1, 1]


def test_a_colour_never_lifted_keeps_its_kind():
    tidied = tidy(populate(build((0, 1), [(5000.0, 100.0, 0)]), [0]), PRIOR)
    assert tidied.colours == (0, 1)


def test_an_object_counts_its_lifts_as_a_member_of_its_kind():
    kinds = populate(build((0, 0), [(5000.0, 100.0, 0), (900.0, 100.0, 1)]), [0, 0])
    stayed = assign(kinds, kinds.objects[0], 0, [(0, 0.7)])
    assert stayed.objects[0].memberships == (Membership(0, 3, 0.7),)
    left = assign(kinds, kinds.objects[0], 0, [(1, 0.6)])
    assert left.objects[0].memberships == (Membership(1, 1, 0.6),)
    came = assign(kinds, KnownObject((), (0,), (Membership(0, 0, 1.0),)), None, [(0, 0.8)])
    assert came.objects[2].memberships == (Membership(0, 1, 0.8),)


def test_the_most_populous_kind_has_most_objects_and_of_equals_is_the_oldest():
    kinds = build((0, 0, 1), [])
    assert populate(kinds, [1, 1, 0]).find_most_populous(0) == 1
    assert populate(kinds, [1, 0, 2, 2]).find_most_populous(0) == 0


@pytest.mark.parametrize(
    ("mean", "sd", "scale"), [(0.0, 400.0, 400.0), (-300.0, 400.0, 500.0), (5000.0, 0.0, 5000.0)]
)
def test_a_further_kind_has_the_scale_of_what_the_most_populous_may_weigh(mean, sd, scale):
    """It is sqrt(mean^2 + sd^2): of a kind that was hardly felt, a mean near zero or below it tells no scale."""
    belief = DensityBelief.from_moments([mean, 7000.0], np.diag([sd + 1e-6, 300.0]) ** 2)
    kinds = populate(Kinds((0, 1), belief, (), (FIRST, FIRST)), [0, 0, 1])
    assert kinds.predict_new(0, PRIOR, 2.0) == pytest.approx((scale, 2.0 * scale))


@pytest.mark.parametrize(("sd", "are_twins"), [(145.0, True), (152.0, False)])
@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_twins_are_more_probable_than_not(sd, are_twins, correlation):
    """Kinds are twins if the SD of their difference is below 100 / 0.6745 = 148.3: P(|difference| < 100) > 1/2."""
    variance = sd**2 / (2.0 * (1.0 - correlation))
    belief = DensityBelief.from_moments([5000.0, 5000.0], variance * np.array([[1, correlation], [correlation, 1]]))
    assert find_twins(Kinds((0, 0), belief, (), (FIRST, FIRST)), 100.0) == ((0, 1) if are_twins else None)
