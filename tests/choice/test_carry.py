"""Carrying: the grip on its path and the tool level, as planned and as simulated."""

import numpy as np
import pytest
from helpers.one_option import HELD, KNOWN, SETTINGS
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.choice.carry import Carry, Keep
from affordance.choice.tasks import load_task
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel
from affordance.simulation.trial import TrialRunner


def measure_carrying(arm: Arm, q: Array) -> tuple[Array, Array]:
    """Positions of the hand, and its angles from the first orientation, by Drake."""
    model, places, turns = ArmModel(arm), [], []
    for row in q:
        model.set_posture(row)
        X_WH = model.compute_hand_pose()
        places.append(X_WH.translation())
        turns.append(X_WH.rotation().matrix())
    angles = [Rotation.from_matrix(turn @ turns[0].T).magnitude() for turn in turns]
    return np.array(places), np.array(angles)


def test_what_is_carried_stays_level_on_its_path(arm: Arm) -> None:
    task = load_task(MODELS, "carry")
    assert isinstance(task, Carry)
    cost = task.build_cost(ArmModel(arm), HELD.components, SETTINGS)
    assert cost.infeasible_reason == ""
    places, angles = measure_carrying(arm, cost.motion.q[::20])
    times = cost.motion.control_period * np.arange(len(cost.motion.q))[::20]
    trajectory = task.path.build_trajectory()
    asked = np.array([trajectory.value(time)[:, 0] for time in times])
    assert np.linalg.norm(places - places[0] - asked, axis=1).max() < task.path.tolerance
    assert angles.max() < task.tilt
    assert np.linalg.norm(places[-1] - places[0]) > 0.3


def test_what_is_carried_stays_level_in_simulation(arm: Arm) -> None:
    """Path and tilt stay within their tolerances in Drake's plant, with a controller that knows the densities."""
    task = load_task(MODELS, "carry")
    assert isinstance(task, Carry)
    carrying = task.begin(ArmModel(arm))
    record = TrialRunner(SETTINGS).run(HELD, carrying, KNOWN, duration=task.duration)
    places, angles = measure_carrying(arm, record.q[::20])
    asked = np.array([carrying.compute_reference(time)[0] for time in record.times[::20]])
    assert np.linalg.norm(places - asked, axis=1).max() < task.path.tolerance
    assert angles.max() < task.tilt


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
