"""Striking point of a real tool."""

import numpy as np
import pytest
from helpers.workshop import HAMMERS

from affordance import MODELS, load_hammer
from affordance.control.swing import find_target, plan_swing


@pytest.mark.parametrize("name", HAMMERS)
def test_tool_strikes_with_its_face_where_that_is_clear_of_the_hand(model, name):
    tool = HAMMERS[name]
    for grip in tool.grips:
        held = tool.gripped_by(grip)
        found = find_target(
            model, held.components, q_start=model.arm.home, offset_W=np.zeros(3), direction_W=np.array([0, 0, -1.0])
        )
        assert found.radius == np.inf
        (face, pose) = next((face, part.X_TE) for part in held.components for face in part.strikes)
        p_TS, normal_T = face.express(pose)
        if grip.name == "head":  # the face lies under the hand: the end of the handle strikes
            assert found.p_TS[0] > 0.1 > p_TS[0]
        else:
            np.testing.assert_allclose(found.p_TS, p_TS)
            np.testing.assert_allclose(found.normal_T, normal_T)


@pytest.mark.parametrize("name", HAMMERS)
def test_face_looks_at_the_nail_when_it_strikes(model, name):
    """The face's normal is along the blow at impact to 1e-4, though the face may look up at the start."""
    task = load_hammer(MODELS / "nail.yaml")
    held = HAMMERS[name].gripped_by(next(grip for grip in HAMMERS[name].grips if grip.name == "handle"))
    target = task.find_target(model, held.components)
    swing = plan_swing(model, target, speed=3.0, duration=task.duration)
    model.set_posture(swing.q_end)
    normal_W = model.compute_hand_pose().rotation().matrix() @ target.normal_T
    np.testing.assert_allclose(normal_W, target.direction_W, atol=1e-4)
