import json

import numpy as np
import pytest
import xarray
from scipy.io import netcdf_file

from affordance.extensions.payload.netcdf import LabelledArray, Trajectories, write_trajectories


def read(path):
    with xarray.open_dataset(path, engine="scipy") as dataset:
        return dataset.load()


def test_arrays_come_back_with_labels_and_units(tmp_path, rng):
    q = rng.normal(size=(2, 5, 3))
    times = np.linspace(0, 1, 5)
    trajectories = Trajectories(
        {
            "time": LabelledArray(("time",), times, "s", "time"),
            "q": LabelledArray(("trial", "time", "joint"), q, "rad", "joint angles"),
        },
        {"joint": ["a", "b", "c"]},
    )
    write_trajectories(tmp_path / "deep" / "t.nc", trajectories)
    found = read(tmp_path / "deep" / "t.nc")
    np.testing.assert_array_equal(found["q"].values, q)
    assert found["q"].dims == ("trial", "time", "joint")
    assert found["q"].attrs == {"units": "rad", "long_name": "joint angles"}
    assert found["joint"].values.tolist() == ["a", "b", "c"]
    assert dict(found.sizes) == {"time": 5, "trial": 2, "joint": 3}
    # The coordinate of its own dimension, so that values are found by time.
    assert "time" in found.coords
    np.testing.assert_array_equal(found["q"].sel(time=times[3], joint="b").values, q[:, 3, 1])


def test_names_of_any_script_and_with_commas_come_back(tmp_path):
    names = ["Öl-Stab", "锤子", "a, b and c", "line one\nline two", "'quoted' \"twice\""]
    values = LabelledArray(("trial",), np.arange(5.0), "m", "Höhe, gemessen")
    write_trajectories(tmp_path / "t.nc", Trajectories({"a": values}, {"trial": names}))
    found = read(tmp_path / "t.nc")
    assert found["trial"].values.tolist() == names
    assert found["a"].sel(trial="a, b and c") == 2.0
    assert found["a"].attrs["long_name"] == "Höhe, gemessen"


def test_file_is_netcdf_3_that_other_readers_read(tmp_path, rng):
    q = rng.normal(size=(2, 4))
    labelled = LabelledArray(("trial", "time"), q, "rad", "joint angles")
    write_trajectories(tmp_path / "t.nc", Trajectories({"q": labelled}, {"trial": ["one", "other"]}))
    assert (tmp_path / "t.nc").read_bytes()[:4] == b"CDF\x02"
    with netcdf_file(tmp_path / "t.nc", mmap=False) as file:
        np.testing.assert_array_equal(file.variables["q"][:], q)
        assert (file.variables["q"].units, file.variables["q"].long_name) == (b"rad", b"joint angles")


@pytest.mark.parametrize(
    "values", [np.array([True, False, True]), np.array([3, -1, 2**40]), np.array([0.1, np.nan, np.inf])]
)
def test_whole_numbers_truths_and_numbers_that_are_none_come_back(tmp_path, values):
    write_trajectories(tmp_path / "t.nc", Trajectories({"a": LabelledArray(("time",), values, "1", "")}, {}))
    np.testing.assert_array_equal(read(tmp_path / "t.nc")["a"].values, values.astype(float))


def test_axes_or_names_that_disagree_leave_no_file(tmp_path):
    three, four = (LabelledArray(("time",), np.zeros(length), "s", "") for length in (3, 4))
    for trajectories in (
        Trajectories({"a": three, "b": four}, {}),
        Trajectories({"a": three}, {"time": ["one", "two"]}),
    ):
        with pytest.raises(ValueError, match="conflicting sizes for dimension 'time'"):
            write_trajectories(tmp_path / "t.nc", trajectories)
        assert list(tmp_path.iterdir()) == []


def test_names_that_no_array_is_along_make_no_dimension(tmp_path):
    """Names along which no array lies add no dimension, so that a data frame has 12 rows instead of 24."""
    names = ["small", 'größer, "odd"']
    lifts = LabelledArray(("observer", "lift"), np.zeros((3, 4)), "1", "place of the object among the names")
    write_trajectories(tmp_path / "t.nc", Trajectories({"tool": lifts}, {"object": names}))
    found = read(tmp_path / "t.nc")
    assert dict(found.sizes) == {"observer": 3, "lift": 4}
    assert len(found.to_dataframe()) == 12
    assert json.loads(found.attrs["object"]) == names
