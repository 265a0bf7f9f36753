import numpy as np
from pydrake.multibody.tree import RotationalInertia

from affordance.arrays import build_symmetric, list_entries


def test_entries_of_a_symmetric_matrix_are_in_the_order_of_drake():
    entries = (2.0, 3.0, 4.0, 0.1, -0.2, 0.3)
    matrix = build_symmetric(entries)
    np.testing.assert_array_equal(matrix, RotationalInertia(*entries).CopyToFullMatrix3())
    assert tuple(list_entries(matrix)) == entries
