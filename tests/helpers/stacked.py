"""Arrays of several runs as one of each name."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def stack(runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Returns the runs' arrays by name, each with one more axis in front: the run."""
    return {name: np.stack([run[name] for run in runs]) for name in runs[0]}
