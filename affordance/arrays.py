"""Array types, attributes of labelled arrays, symmetric matrices and read-only fields."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

type Array = NDArray[np.float64]
type Mask = NDArray[np.bool_]
# Arrays by name.
type Arrays = Mapping[str, NDArray[Any]]


def about(units: str, long_name: str) -> dict[str, str]:
    """Builds the attributes of a variable: its unit ("1" if dimensionless) and its meaning."""
    return {"units": units, "long_name": long_name}


def build_symmetric(entries: Sequence[float] | Array) -> Array:
    """Builds a symmetric matrix, (3, 3), from its entries xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def list_entries(matrix: Array) -> list[float]:
    """Lists the entries xx, yy, zz, xy, xz, yz of a symmetric matrix, (3, 3)."""
    return [float(matrix[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def store_read_only(instance: object, **arrays: NDArray[Any]) -> None:
    """Makes arrays read-only, and stores them in a frozen dataclass."""
    for name, array in arrays.items():
        array.setflags(write=False)
        object.__setattr__(instance, name, array)
