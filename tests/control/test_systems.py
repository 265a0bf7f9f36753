"""The controller as a system of its own; more of it is in tests/simulation/test_systems.py."""

import numpy as np
import pytest
from helpers.seen_objects import ONE_MATERIAL, detect_parts
from pydrake.common.value import Value

from affordance.belief.density_belief import PointEstimate, Prior
from affordance.control.hold import Hold
from affordance.control.systems import MpcController
from affordance.settings import DEFAULT_SETTINGS


class Hurry(Hold):
    """A hold that plans ahead only half as far."""

    def choose_horizon(self, time, longest):
        return 0.5 * longest


@pytest.fixture
def controller(arm):
    return MpcController(
        arm,
        settings=DEFAULT_SETTINGS.mpc,
        control_period=DEFAULT_SETTINGS.control_period,
        point_estimate=PointEstimate.MODE,
        angle_margin=0.0,
    )


def control(controller, arm, task, q):
    """The torques at a posture at rest, and the counts after two control periods in it."""
    context = controller.CreateDefaultContext()
    belief = detect_parts(ONE_MATERIAL, Prior(mode=1000.0, sd=4000.0, deviation_sd=100.0))
    controller.GetInputPort("belief").FixValue(context, Value(belief))
    controller.GetInputPort("goal").FixValue(context, Value(task))
    controller.GetInputPort("state").FixValue(context, np.concatenate([q, np.zeros(7)]))
    for _ in range(2):
        context.SetDiscreteState(controller.EvalUniquePeriodicDiscreteUpdate(context))
    return controller.GetOutputPort("tau").Eval(context), controller.get_counts(context)


def test_control_periods_without_a_plan_are_counted(controller, arm, caplog):
    _, counts = control(controller, arm, Hold(arm.home), np.full(7, np.nan))
    assert counts == (0, 2)
    assert "the state is not finite" in caplog.text


def test_a_goal_in_half_the_time_takes_four_times_the_acceleration(controller, arm):
    """The acceleration at first is -6 d / T^2 in continuous time, from a displacement d at rest."""
    q = arm.home + 0.01 * np.ones(7)
    at_rest, _ = control(controller, arm, Hold(q), q)
    calm, hurried = (control(controller, arm, task(arm.home), q)[0] - at_rest for task in (Hold, Hurry))
    np.testing.assert_allclose(hurried, 4.0 * calm, rtol=0.15, atol=0.02)
