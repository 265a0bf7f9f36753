"""Inertia of a tool as stated by the data set."""

import pytest
from numpy.testing import assert_allclose

from affordance.exceptions import BadValueError
from affordance.files.model_folder import MODELS
from studies.tools.data_set import DataSet

_STATED = """OBJECT:
  NAME: a clamp
  MASS: 0.5
  COM_WRT_MESH: [0.1, 0, 0.02]
  INERTIA_WRT_COM: [[1e-3, 0, 0], [0, 2e-3, 0], [0, 0, 3e-3]]
MESH: {}
"""


def test_true_inertia_is_read_and_bad_numbers_are_named(tmp_path):
    path = tmp_path / "data" / "Workshop Tools Dataset" / "Clamp" / "Inertia.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(_STATED)
    data = DataSet(tmp_path, MODELS)
    truth = data.read_truth("Clamp")
    assert truth.mass == 0.5
    assert_allclose(truth.p_FBcm, [0.1, 0.0, 0.02])
    assert_allclose(truth.I_BBcm_F.diagonal(), [1e-3, 2e-3, 3e-3])
    for old, new, message in (
        ("0.5", "50", "OBJECT.MASS: is 50, must be from 1e-06 to 20"),
        ("[0.1, 0, 0.02]", "[0.1, 0]", r"OBJECT.COM_WRT_MESH: is \[0.1, 0\], must be a list of 3 numbers"),
        ("[0, 2e-3, 0], ", "", "OBJECT.INERTIA_WRT_COM: is .*, must be a list with at least 3 entries"),
    ):
        path.write_text(_STATED.replace(old, new, 1))
        with pytest.raises(BadValueError, match=message):
            data.read_truth("Clamp")
