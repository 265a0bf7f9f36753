"""Array types for annotations, and read-only arrays of frozen dataclasses."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

type Array = NDArray[np.float64]
type Mask = NDArray[np.bool_]


def store_read_only(instance: object, **arrays: NDArray[Any]) -> None:
    """Makes arrays read-only, and stores them as fields of a frozen dataclass."""
    for name, array in arrays.items():
        array.setflags(write=False)
        object.__setattr__(instance, name, array)
