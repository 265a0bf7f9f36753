"""A blow with a mesh in contact."""

import pytest
from helpers.workshop import HAMMERS
from pydrake.multibody.plant import CoulombFriction

from affordance.choice.hammer import load_hammer
from affordance.files.model_folder import MODELS
from affordance.plant import contact
from affordance.settings import Settings
from affordance.simulation.trial import get_runner
from studies.tools.blows import check_blows


def check(tool, grip):
    (checked,) = check_blows([HAMMERS[tool]], [grip], load_hammer(MODELS / "nail.yaml"), Settings())
    return checked


def test_hammer_meets_the_nail_with_its_face_as_planned():
    checked = check("machinist hammer", "handle")
    assert checked.force == pytest.approx(checked.force_aimed, rel=0.05)
    assert checked.work == pytest.approx(checked.work_planned, rel=0.02)
    assert checked.travel > 0.01
    # The disc lies in the face that the file names.
    assert checked.blow.strike.placement.face.radius == float("inf")
    assert checked.blow.strike.placement.face.p_TS == pytest.approx([0.214, 0, -0.048], abs=1e-9)


def test_friction_on_the_nail_is_what_raises_the_peak_above_the_plan(monkeypatch):
    """The peak without friction is the planned one to 1 %, as the plan's effective mass is that of a free face."""
    assert 1.0 < (rough := check("claw hammer", "choked")).force / rough.force_aimed < 1.1
    get_runner.cache_clear()
    monkeypatch.setattr(contact, "_FRICTION", CoulombFriction(static_friction=0.0, dynamic_friction=0.0))
    smooth = check("claw hammer", "choked")
    get_runner.cache_clear()
    assert smooth.force == pytest.approx(smooth.force_aimed, rel=0.01)
    assert smooth.force < rough.force
    assert smooth.work == pytest.approx(rough.work, rel=1e-3)
