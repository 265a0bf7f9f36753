"""Writes trajectories in NetCDF 3, an open format for labelled arrays that most languages read."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.files.atomic import write_atomic


class LabelledArray(NamedTuple):
    """Array with the names of its axes, its SI unit and its meaning; stored as floating-point numbers."""

    dimensions: tuple[str, ...]
    values: Array | NDArray[np.bool_] | NDArray[np.intp]
    units: str
    meaning: str


class Trajectories(NamedTuple):
    """Arrays by name; an array whose only dimension has its own name is that dimension's coordinate.

    Dimensions with the same name have the same length. ``names`` are the names of the entries along a dimension
    without a coordinate, in any script. If no array has that dimension, they are the names that an array of indices
    refers to; these are stored as a JSON attribute.
    """

    variables: Mapping[str, LabelledArray]
    names: Mapping[str, Sequence[str]]


def write_trajectories(path: Path, trajectories: Trajectories) -> None:
    """Writes trajectories to a NetCDF file, atomically."""
    arrays = {
        name: (dimensions, np.asarray(values, dtype=float), {"units": units, "long_name": meaning})
        for name, (dimensions, values, units, meaning) in trajectories.variables.items()
    }
    coordinates = {name: array for name, array in arrays.items() if array[0] == (name,)}
    variables = {name: array for name, array in arrays.items() if name not in coordinates}
    names = {name: list(entries) for name, entries in trajectories.names.items()}
    axes = {axis for each in arrays.values() for axis in each[0]}
    # A dimension that no array has would multiply the rows of a data frame.
    unused = {name: json.dumps(names.pop(name), ensure_ascii=False) for name in set(names) - axes}
    dataset = xarray.Dataset(variables, coords={**coordinates, **names}, attrs=unused)
    write_atomic(path, lambda temporary: dataset.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT"))
