"""A repeat that workers of a cluster can import; tests put this folder on their path."""

import os
import time

import numpy as np


def note_and_draw(folder, repeat):
    """Takes long enough for a worker to be killed in it, and notes where it ran."""
    (folder / f"{os.getpid()}_{repeat}").touch()
    time.sleep(0.3)
    return {"drawn": np.random.default_rng([5, repeat]).normal(size=3)}
