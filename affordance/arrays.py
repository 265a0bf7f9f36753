"""Array types, attributes of labelled arrays, and read-only arrays of frozen dataclasses."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

type Array = NDArray[np.float64]
type Mask = NDArray[np.bool_]
# Arrays by name.
type Arrays = Mapping[str, NDArray[Any]]


def about(units: str, long_name: str) -> dict[str, str]:
    """Builds a variable's attributes: its unit ("1" if dimensionless) and its meaning."""
    return {"units": units, "long_name": long_name}


def store_read_only(instance: object, **arrays: NDArray[Any]) -> None:
    """Makes arrays read-only, and stores them as fields of a frozen dataclass."""
    for name, array in arrays.items():
        array.setflags(write=False)
        object.__setattr__(instance, name, array)
