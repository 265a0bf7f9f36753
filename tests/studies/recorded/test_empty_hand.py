import numpy as np
import pytest
from helpers.generated_runs import Truth, generate_run

from affordance.identification.evidence.gains import build_nominal_gains
from affordance.identification.settings import DEFAULT_SETTINGS, SignalKind
from studies.recorded.empty_hand import ApparentPayload, weigh_empty_hand


def test_error_of_the_mass_is_that_of_the_first_parameter():
    covariance = np.diag([4.0, *np.full(9, 0.01)])
    covariance[0, 1] = covariance[1, 0] = 0.1
    assert ApparentPayload(np.zeros(10), covariance).mass_sd == pytest.approx(2.0)


def test_what_the_motion_does_not_show_stays_as_it_was_thought_to_be(robot):
    """SDs after the run are all below the prior's, and one is more than half of it."""
    rng = np.random.default_rng(3)
    run = generate_run(robot, None, truth=Truth(noise_sd=5.0, friction=(0.3, 0.2, 0.1)), rng=rng, duration=14.0)
    gains = build_nominal_gains(robot.joint_names, SignalKind.JOINT_TORQUE, DEFAULT_SETTINGS)
    found = weigh_empty_hand(robot, run, gains, DEFAULT_SETTINGS)
    share = np.sqrt(np.diag(found.covariance)) / np.array([5.0, *[0.5] * 3, *[0.1] * 6])
    assert (share < 1.0).all()
    assert share.max() > 0.5
    assert (np.abs(found.parameters) < 4.0 * np.sqrt(np.diag(found.covariance))).all()
