"""A blow with a mesh in contact."""

import pytest
from helpers.workshop import HAMMERS

from affordance.choice.hammer import load_hammer
from affordance.files.model_folder import MODELS
from affordance.settings import Settings
from studies.tools.blows import check_blows


def test_hammer_meets_the_nail_with_its_face_as_planned():
    (checked,) = check_blows([HAMMERS["claw hammer"]], ["choked"], load_hammer(MODELS / "nail.yaml"), Settings())
    assert checked.force == pytest.approx(checked.force_aimed, rel=0.05)
    assert checked.work == pytest.approx(checked.work_planned, rel=0.02)
    assert checked.travel > 0.01
    # The disc lies in the face that the file names.
    assert checked.blow.strike.placement.face.radius == float("inf")
    assert checked.blow.strike.placement.face.p_TS == pytest.approx([0.094, 0.062, 0], abs=1e-9)
