"""Soak test: memory and time of a trial over ten thousand trials in one process."""

import gc
import time
from typing import Any, NamedTuple

import numpy as np
import psutil

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.experiments import weight
from affordance.experiments.observers import Setup
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import TrialRunner

NUM_TRIALS = 10_000
NUM_BLOCKS = 20
# Duration of a trial, [s]: short, because what a trial leaves behind does not depend on it, but long enough for two
# samples.
DURATION = 0.2


class Soak(NamedTuple):
    """Memory, [MB], and processor time per trial, [s], after each block of trials, (NUM_BLOCKS,) each."""

    memory: Array
    seconds: Array


def measure(*, trials: int = NUM_TRIALS) -> tuple[Soak, dict[str, Any]]:
    """Runs trials with alternating objects, each with its own seed; returns measurements and the numbers to write.

    The first block fills caches, so growth and drift are measured from its end.
    """
    tools = weight.read(Setup())
    runner, process = TrialRunner(DEFAULT_SETTINGS), psutil.Process()
    per_block, quarter = trials // NUM_BLOCKS, NUM_BLOCKS // 4
    memory, seconds = np.empty(NUM_BLOCKS), np.empty(NUM_BLOCKS)
    for block in range(NUM_BLOCKS):
        begun = time.process_time()
        for number in range(per_block):
            runner.run_hold(tools[number % len(tools)], MaterialMemory(), duration=DURATION, seed=(block, number))
        seconds[block] = (time.process_time() - begun) / per_block
        gc.collect()
        memory[block] = process.memory_info().rss / 1e6
    return Soak(memory, seconds), {
        "soak_trials": per_block * NUM_BLOCKS,
        "soak_memory_growth_MB": float(memory[-1] - memory[0]),
        "soak_time_drift": float(np.median(seconds[-quarter:]) / np.median(seconds[1 : 1 + quarter])),
    }
