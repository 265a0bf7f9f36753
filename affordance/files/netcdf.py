"""Trajectories in netCDF 3, an open format of labelled arrays that most languages read."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from scipy.io import netcdf_file

from affordance.arrays import Array
from affordance.files.atomic import write_atomic


class Labelled(NamedTuple):
    """An array with its meaning.

    Attributes:
        dimensions: Name of each axis.
        values: The numbers.
        units: SI.
        meaning: In words.
    """

    dimensions: tuple[str, ...]
    values: Array
    units: str
    meaning: str


def write_trajectories(path: Path, variables: Mapping[str, Labelled], labels: Mapping[str, list[str]]) -> None:
    """Writes variables to a netCDF file, whole.

    Args:
        path: The file.
        variables: Arrays by name; those that share a dimension agree in its length.
        labels: For some dimensions, the name of each entry; kept as text attributes of the file,
            in UTF-8.
    """

    def write(temporary: Path) -> None:
        with netcdf_file(temporary, "w") as file:
            for dimension, names in labels.items():
                setattr(file, f"{dimension}_names", ", ".join(names).encode())  # SciPy writes text as ASCII only
            for name, variable in variables.items():
                for dimension, length in zip(variable.dimensions, variable.values.shape, strict=True):
                    if dimension not in file.dimensions:
                        file.createDimension(dimension, length)
                stored = file.createVariable(name, "d", variable.dimensions)
                stored[:] = variable.values
                stored.units = variable.units
                stored.long_name = variable.meaning

    write_atomic(path, write)
