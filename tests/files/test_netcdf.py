import numpy as np
import pytest
from scipy.io import netcdf_file

from affordance.files.netcdf import Labelled, write_trajectories


def test_arrays_come_back_with_labels_and_units(tmp_path, rng):
    q = rng.normal(size=(2, 5, 3))
    times = np.linspace(0, 1, 5)
    write_trajectories(
        tmp_path / "t.nc",
        {
            "time": Labelled(("time",), times, "s", "time"),
            "q": Labelled(("trial", "time", "joint"), q, "rad", "joint angles"),
        },
        {"joint": ["a", "b", "c"]},
    )
    with netcdf_file(tmp_path / "t.nc", mmap=False) as file:
        np.testing.assert_array_equal(file.variables["q"][:], q)
        assert file.variables["q"].dimensions == ("trial", "time", "joint")
        assert (file.variables["q"].units, file.variables["q"].long_name) == (b"rad", b"joint angles")
        assert file.joint_names == b"a, b, c"
        assert file.dimensions == {"time": 5, "trial": 2, "joint": 3}


def test_names_of_any_script_come_back(tmp_path):
    values = Labelled(("trial",), np.zeros(2), "m", "")
    write_trajectories(tmp_path / "t.nc", {"a": values}, {"trial": ["Öl-Stab", "锤子"]})
    with netcdf_file(tmp_path / "t.nc", mmap=False) as file:
        assert file.trial_names.decode() == "Öl-Stab, 锤子"


def test_axes_that_disagree_leave_no_file(tmp_path):
    with pytest.raises(ValueError):  # noqa: PT011 (NumPy words it)
        write_trajectories(
            tmp_path / "t.nc",
            {
                "a": Labelled(("time",), np.zeros(3), "s", ""),
                "b": Labelled(("time",), np.zeros(4), "s", ""),
            },
            {},
        )
    assert list(tmp_path.iterdir()) == []
