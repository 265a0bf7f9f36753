"""Holding still: the static torque of a posture, and nothing else."""

import numpy as np
import pytest
from helpers.one_option import HELD, SETTINGS

from affordance.choice.keep import Keep
from affordance.exceptions import AffordanceError
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel


def test_hold_bears_the_static_torque_of_the_posture(arm: Arm) -> None:
    bent = Keep(4.0, (("elbow_flexion", 1.2),))
    cost = bent.build_cost(ArmModel(arm), HELD.components, SETTINGS)
    pi = HELD.parameters[None]
    model = ArmModel(arm)
    model.set_payload(HELD.parameters)
    model.set_posture(arm.find_posture({"elbow_flexion": 1.2}))
    tau = model.compute_inverse_dynamics(np.zeros(arm.num_joints))
    found, demand = cost.compute(pi), cost.compute_demand(pi)
    assert found.work == 0.0
    assert found.effort == pytest.approx(4.0 * tau @ tau)
    np.testing.assert_allclose(demand.loads[:, 0], np.abs(tau) / arm.limits.tau_max, rtol=1e-9, atol=1e-12)
    gravity = 9.81
    assert demand.force == pytest.approx(HELD.mass * gravity, rel=1e-3)


def test_posture_that_the_arm_cannot_take_names_joint_and_bound(arm: Arm) -> None:
    with pytest.raises(AffordanceError, match="sets elbow_flexion to 6 rad, must be from"):
        Keep(4.0, (("elbow_flexion", 6.0),)).build_cost(ArmModel(arm), HELD.components, SETTINGS)
