import numpy as np
from numpy.testing import assert_allclose
from pydrake.systems.framework import DiagramBuilder

from affordance.plant.clamp import STIFFNESS
from affordance.plant.load import add_arm

AWAY = 0.01 * np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0])


def test_clamp_pushes_back_until_it_lets_go():
    """The closed clamp is a spring between the hand's places then and now, [N]; an open one exerts no force."""
    builder = DiagramBuilder()
    arm = add_arm(builder, has_clamp=True)
    context = arm.plant.CreateDefaultContext()
    arm.plant.SetPositions(context, arm.home)
    before = arm.hand.CalcPoseInWorld(context).translation()
    forces = {}
    for name, act in (("open", lambda _: None), ("closed", arm.clamp.close), ("released", arm.clamp.release)):
        arm.plant.SetPositions(context, arm.home)
        act(context)
        arm.plant.SetPositions(context, arm.home + AWAY)
        forces[name] = arm.clamp.compute_force(context)
    moved = arm.hand.CalcPoseInWorld(context).translation() - before
    assert np.linalg.norm(moved) > 1e-3
    assert_allclose(forces["closed"], STIFFNESS * moved, rtol=0.02)
    assert not forces["open"].any()
    assert not forces["released"].any()
