"""Times functions in alternation, so that the load of the machine affects all of them alike."""

import time
from collections.abc import Callable, Mapping

import numpy as np


def time_by_turns(
    calls: Mapping[str, Callable[[], object]], *, turns: int = 21, calls_per_turn: int = 20
) -> dict[str, float]:
    """Times functions in turns; returns for each name the median over turns of the mean time per call, [s]."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        call()
    for _ in range(turns):
        for name, call in calls.items():
            start = time.perf_counter()
            for _ in range(calls_per_turn):
                call()
            times[name].append((time.perf_counter() - start) / calls_per_turn)
    return {name: float(np.median(values)) for name, values in times.items()}
