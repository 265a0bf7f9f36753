from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from scipy.stats import norm

from affordance.extensions.payload.posterior.body_posterior import WeightedBodies
from affordance.extensions.payload.posterior.payload_belief import (
    QUANTITIES,
    UNITS,
    PayloadBelief,
    describe_bodies,
    find_hidden_direction,
    summarise,
)
from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.objects.inertia import compute_point_parameters


def build_belief(bodies, weights, **known):
    """Belief about a body after a run of two joints, with other knowledge of it."""
    two = np.ones(2)
    return PayloadBelief(
        source="run.csv",
        analysis="made up",
        bodies=WeightedBodies(bodies, weights, np.arange(len(weights))),
        prior_bodies=SolidPrior.for_hand().draw_parameters(np.random.default_rng(1), 500),
        channel_names=("a", "b"),
        unit="N m",
        gains=np.ones((2, 2)),
        load_friction=0.0 * two,
        noise_sd=two,
        agreement=two,
        assumptions=(),
        notes=(),
        fit=SimpleNamespace(evidence=SimpleNamespace(is_at_rest=False)),
        **known,
    )


@pytest.fixture(scope="module")
def bodies():
    return SolidPrior.for_hand().draw_parameters(np.random.default_rng(0), 400)


def test_bodies_are_described_as_drake_shifts_them(bodies):
    for pi, found in zip(bodies[:20], describe_bodies(bodies), strict=False):
        m, p, G = pi[0], pi[1:4] / pi[0], pi[4:] / pi[0]
        about_centre = SpatialInertia(m, p, UnitInertia(*G)).Shift(p).CalcRotationalInertia()
        expected = [*about_centre.get_moments(), *about_centre.get_products()]
        assert_allclose(found, [m, *p, *expected], rtol=1e-9, atol=1e-12)
    assert len(QUANTITIES) == len(UNITS) == 10
    assert [UNITS[QUANTITIES.index(name)] for name in ("mass", "c_z", "I_xx", "I_yz")] == ["kg", "m", *["kg m^2"] * 2]


def test_intervals_are_those_of_weighted_samples():
    """Evenly spread points weighted by a normal density have its mean, SD and percentiles."""
    x = np.linspace(-6.0, 6.0, 4001)
    mean, sd = np.arange(10.0), 0.5 + np.arange(10.0)
    weights = norm.pdf(x) / norm.pdf(x).sum()
    order = np.random.default_rng(2).permutation(len(x))
    found = summarise(mean + sd * x[order, None], weights[order])
    for values, z in zip(found, (0.0, None, -0.67449, 0.67449, -1.64485, 1.64485), strict=True):
        assert_allclose(values, sd if z is None else mean + z * sd, atol=3e-3 * sd.max())


def test_interval_of_the_mass_is_that_of_mass_alone(bodies):
    weights = np.random.default_rng(3).dirichlet(np.ones(len(bodies)))
    belief = build_belief(bodies, weights)
    low, high = belief.mass_interval90
    assert weights[bodies[:, 0] < low].sum() == pytest.approx(0.05, abs=0.01)
    assert weights[bodies[:, 0] > high].sum() == pytest.approx(0.05, abs=0.01)
    content = belief.to_dict()
    assert content["mass_interval90"] == [low, high]
    assert "densities_kg_m3" not in content  # no camera saw it
    assert belief._repr_html_().count("<tr>") == 11


def test_what_is_as_wide_as_the_prior_was_not_seen(bodies):
    unseen = build_belief(bodies, np.full(len(bodies), 1.0 / len(bodies))).unseen
    assert [sentence.split(" (")[0] for sentence in unseen] == ["mass", "centre of mass", "moments of inertia"]
    assert "(I_xx, I_yy, I_zz)" in unseen[2]
    one = bodies[:1] * (1.0 + 1e-3 * np.random.default_rng(4).standard_normal((400, 1)))
    assert build_belief(one, np.full(400, 1 / 400)).unseen == ()
    # The scale saw the mass.
    weighed = build_belief(bodies, np.full(len(bodies), 1 / len(bodies)), calibration=SimpleNamespace())
    assert [sentence.split(" (")[0] for sentence in weighed.unseen] == ["centre of mass", "moments of inertia"]


def test_few_independent_samples_are_warned_of_and_a_belief_prints_in_a_line(bodies):
    weights = np.full(len(bodies), 1e-9)
    weights[:20] = 1.0
    belief = build_belief(bodies, weights / weights.sum())
    assert any("samples are effective: intervals are inaccurate" in warning for warning in belief.warnings)
    assert repr(belief).startswith("PayloadBelief(")
    assert repr(belief).endswith("400 samples, 1 warnings; run.csv)")


def test_a_payload_is_set_as_far_as_it_was_seen(bodies):
    one = bodies[:1] * (1.0 + 1e-3 * np.random.default_rng(4).standard_normal((400, 1)))
    seen = build_belief(one, np.full(400, 1 / 400))
    assert seen.hidden == frozenset()
    assert_allclose(seen.setting.parameters, seen.parameters, rtol=1e-2)
    assert build_belief(bodies, np.full(len(bodies), 1 / len(bodies))).setting is None
    # Samples with the same mass and centre of mass, and moments of any size.
    vague = one.copy()
    vague[:, 4:] += (bodies[:400, 4:] - one[:, 4:]) * 10.0
    known_place = build_belief(vague, np.full(400, 1 / 400))
    assert known_place.setting.inertia is None
    assert known_place.setting.parameters[0] == pytest.approx(seen.mass)


def test_hardly_any_mass_is_not_said_to_be_unseen(bodies):
    light = bodies[:400] * (1e-3 / bodies[:400, :1]) * np.random.default_rng(5).lognormal(size=(400, 1))
    belief = build_belief(light, np.full(400, 1 / 400))
    assert belief.unseen[0].startswith("mass (mass): little or nothing is held (90 % from ")
    assert belief.is_light
    assert belief.shows_mass
    assert belief.to_dict()["mass_seen"] is True
    assert belief.setting is None


def test_a_mass_is_seen_from_how_far_its_interval_has_narrowed(bodies):
    """A mass with an SD of 0.3 of itself is seen and one of 0.6 is not; the interval before the run is named."""
    spread = np.random.default_rng(5).lognormal(size=(400, 1))
    for sd, is_seen in ((0.3, True), (0.6, False)):
        sigma = np.sqrt(np.log(1.0 + sd**2))
        some = bodies[:1] / bodies[0, 0] * np.exp(sigma * np.log(spread) / np.log(spread).std())
        belief = build_belief(some, np.full(400, 1 / 400))
        assert belief.marginals.sd[0] / belief.mass == pytest.approx(sd, rel=0.3)
        assert belief.shows_mass is belief.to_dict()["mass_seen"] is is_seen
        assert not belief.is_light
        if not is_seen:
            low, high = np.quantile(belief.prior_bodies[:, 0], [0.05, 0.95])
            assert f"kg, before the run from {low:.2g} to {high:.2g})" in belief.unseen[0]


_PRIOR = SolidPrior.for_hand().draw_parameters(np.random.default_rng(1), 2000)
_DIRECTION = np.array([0.0, 0.6, 0.8])


@pytest.mark.parametrize("known", [True, False])
def test_the_direction_is_that_along_which_the_centre_of_mass_is_as_open_as_before(known):
    """Along y and z alone the spread is .6 and .8 of that of the direction, so that no coordinate is as open."""
    rng = np.random.default_rng(0)
    spread = (_PRIOR[:, 1:4] / _PRIOR[:, :1]).std(axis=0).max()
    along = 0.3 * spread if known else spread
    centres = 0.002 * rng.standard_normal((2000, 3)) + along * rng.standard_normal((2000, 1)) * _DIRECTION
    bodies = np.array([compute_point_parameters(centre) for centre in centres])
    found = find_hidden_direction(bodies, np.full(2000, 1.0 / 2000), _PRIOR)
    if known:
        assert found is None
    else:
        assert found == pytest.approx(_DIRECTION, abs=0.01)
