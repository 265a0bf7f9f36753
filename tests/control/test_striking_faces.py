"""Striking point of a real tool."""

import numpy as np
import pytest
from helpers.workshop import HAMMERS

from affordance import MODELS, Settings, load_hammer
from affordance.control.swing import HAND, find_target, plan_swing


@pytest.mark.parametrize("name", HAMMERS)
def test_tool_strikes_with_its_face_unless_the_hand_covers_it(model, name):
    tool = HAMMERS[name]
    for grip in tool.grips:
        held = tool.gripped_by(grip)
        found = find_target(
            model, held.components, q_start=model.arm.home, offset_W=np.zeros(3), direction_W=np.array([0, 0, -1.0])
        )
        assert found.radius == np.inf
        (face, pose) = next((face, part.X_TE) for part in held.components for face in part.strikes)
        p_TS, normal_T = face.express(pose)
        np.testing.assert_allclose(found.p_TS, p_TS)
        np.testing.assert_allclose(found.normal_T, normal_T)
        assert (found.p_TS[0] <= HAND) == (grip.name == "head")
        if grip.name == "head":
            cost = load_hammer(MODELS / "nail.yaml").build_cost(model, held.components, Settings())
            assert (cost.swings, cost.infeasible_reason) == ((), "the face is in the hand in this grip")


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
