import re
import xml.etree.ElementTree as ET
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD
from numpy.testing import assert_allclose
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RotationalInertia, SpatialInertia, UnitInertia
from scipy.stats import norm

from affordance.identification.posterior.body_posterior import WeightedBodies
from affordance.identification.posterior.payload_belief import (
    QUANTITIES,
    UNITS,
    PayloadBelief,
    describe_bodies,
    list_payload_settings,
    summarise,
)
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.objects.inertia import parameters_from_spatial_inertia

_LINES = list_payload_settings(PAYLOAD)
_CENTRE = PAYLOAD[1:4] / PAYLOAD[0]


def build_belief(bodies, weights, **known):
    """What a run of two joints left of a body, with what else is known of it."""
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
        fit=None,
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
    """Points evenly spread, weighted by a normal density, have its percentiles."""
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
    assert any("samples count: take intervals with caution" in warning for warning in belief.warnings)
    assert repr(belief).startswith("PayloadBelief(")
    assert repr(belief).endswith("400 samples, 1 warnings; run.csv)")


def test_urdf_is_read_as_the_same_body():
    element = ET.fromstring(_LINES["URDF"])
    text = f"<robot name='r'><link name='l'>{ET.tostring(element, encoding='unicode')}</link></robot>"
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(text, "urdf")
    body = plant.GetBodyByName("l")
    plant.WeldFrames(plant.world_frame(), body.body_frame())
    plant.Finalize()
    read = parameters_from_spatial_inertia(body.CalcSpatialInertiaInBodyFrame(plant.CreateDefaultContext()))
    assert_allclose(read, PAYLOAD, rtol=1e-4, atol=1e-6)


def test_urscript_has_moments_about_the_centre_of_mass():
    numbers = [
        float(number) for number in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", _LINES["Universal Robots (URScript)"])
    ]
    mass, centre, moments = numbers[0], numbers[1:4], numbers[4:]
    assert_allclose(mass, PAYLOAD[0], rtol=1e-4)
    assert_allclose(centre, _CENTRE, atol=1e-5)
    assert_allclose(moments[0], PAYLOAD[4] - mass * (_CENTRE[1] ** 2 + _CENTRE[2] ** 2), rtol=1e-3)


def test_drake_line_can_be_run():
    inertia = eval(
        _LINES["Drake (Python)"], {"SpatialInertia": SpatialInertia, "RotationalInertia": RotationalInertia}
    )
    assert_allclose(parameters_from_spatial_inertia(inertia), PAYLOAD, rtol=1e-4, atol=1e-6)


def test_libfranka_has_a_symmetric_matrix():
    numbers = re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", _LINES["Franka (libfranka)"])
    matrix = np.array([float(number) for number in numbers[4:]]).reshape(3, 3)
    assert_allclose(matrix, matrix.T)
    assert (np.linalg.eigvalsh(matrix) > 0.0).all()
