"""Arm of an infant: lengths and masses against the cited numbers, bodies that can exist, and a hold."""

import numpy as np
import pytest

from affordance import MaterialMemory
from affordance.experiments.shared.objects import read_tools
from affordance.files.model_folder import MODELS
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import Settings
from affordance.simulation.trial import TrialRunner

# Means of infants of 9 to 11 months, [m] (Snyder and others 1977): lengths, and girths of upper arm and forearm.
LENGTHS = {"upper_arm": 0.145, "forearm": 0.196 - 0.089, "hand": 0.089}
GIRTHS = {"upper_arm": 0.148, "forearm": 0.143}
# Body masses, [kg]: median of boys of 10 months (WHO 2006), and the adult of the other arm; an adult's shares of it
# (Winter 2009).
BODY_MASS, ADULT_MASS = 9.16, 73.0
SHARES = {"upper_arm": 0.028, "forearm": 0.016, "hand": 0.006}


@pytest.fixture(scope="module")
def infant():
    return load_arm(MODELS / "infant.dmd.yaml")


def get_inertia(arm, body):
    return arm.plant.GetBodyByName(body).default_spatial_inertia()


@pytest.mark.parametrize("segment", LENGTHS)
def test_segments_have_cited_lengths_and_masses(infant, segment):
    found = get_inertia(infant, segment)
    assert 2.0 * found.get_com()[0] == pytest.approx(LENGTHS[segment])
    assert found.get_mass() == pytest.approx(SHARES[segment] * BODY_MASS, rel=1e-3)


def test_reach_and_mass_are_the_sums_of_the_segments(infant):
    model = ArmModel(infant)
    model.set_posture(infant.home)
    np.testing.assert_allclose(model.compute_hand_pose().translation()[:2], [sum(LENGTHS.values()), 0.0], atol=1e-12)
    mass = infant.plant.CalcTotalMass(infant.plant.CreateDefaultContext())
    assert mass == pytest.approx(sum(SHARES.values()) * BODY_MASS + 5 * 1e-4, rel=1e-3)


@pytest.mark.parametrize("segment", GIRTHS)
def test_masses_are_near_those_of_cylinders_of_the_measured_girth(infant, segment):
    """Cylinders of 1 g/cm^3; a forearm tapers from where its girth is measured."""
    cylinder = 1000.0 * GIRTHS[segment] ** 2 / (4.0 * np.pi) * LENGTHS[segment]
    assert get_inertia(infant, segment).get_mass() == pytest.approx(cylinder, rel=0.2)


def test_bodies_can_exist(infant):
    """Moments about centres of mass are positive, and none exceeds the sum of the two others."""
    segments = [*LENGTHS, "base", "shoulder_1", "shoulder_2", "elbow_1", "wrist_1"]
    for name in segments:
        found = get_inertia(infant, name)
        mass, centre = found.get_mass(), found.get_com()
        about_origin = found.CalcRotationalInertia().CopyToFullMatrix3()
        about_com = about_origin - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        small, middle, large = np.linalg.eigvalsh(about_com)
        assert small > 0.0
        assert large <= (small + middle) * (1.0 + 1e-9)


def test_limits_are_those_of_the_adult_but_for_efforts_scaled_by_body_mass(infant, arm):
    assert infant.joint_names == arm.joint_names
    for name in ("q_lower", "q_upper", "v_max"):
        np.testing.assert_array_equal(getattr(infant.limits, name), getattr(arm.limits, name))
    np.testing.assert_allclose(infant.limits.tau_max, BODY_MASS / ADULT_MASS * arm.limits.tau_max, rtol=2e-3)
    np.testing.assert_array_equal(infant.home, arm.home)


def test_a_known_rod_is_held_level_and_an_unknown_one_sinks():
    """The whole loop: a rod of the infant's size, of brass, known and not."""
    rod = read_tools(MODELS, "tools/ladder.yaml")[0].scaled(1.0, 0.44)
    runner = TrialRunner(Settings(arm=MODELS / "infant.dmd.yaml"))
    known = runner.run_hold(rod, MaterialMemory.from_densities({"brass": 8500.0}), duration=0.6)
    unknown = runner.run_hold(rod, MaterialMemory(), duration=0.6)
    assert np.abs(known.height_centre).max() < 1e-3
    assert unknown.height_centre.min() < -0.05
    assert (known.counts.failed, known.overloaded) == (0, ())
