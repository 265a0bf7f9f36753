"""Repeats whose processes grow from the second on, as they do from one experiment to a larger one."""

import sys
import time
from pathlib import Path

import numpy as np

from affordance.results import run_repeats

_KEPT = []


def grow(repeat):
    """Keeps what joblib takes for a leak; it looks once a second."""
    time.sleep(1.1)
    _KEPT.append(np.ones(40_000_000 * (len(_KEPT) == 1)))
    return {"size": np.array(sum(array.nbytes for array in _KEPT))}


if __name__ == "__main__":
    from growing_repeats import grow as found_by_workers

    sizes = run_repeats(Path(sys.argv[1]), found_by_workers, repeats=8, jobs=2, description="test")["size"]
    print(sizes.max())
