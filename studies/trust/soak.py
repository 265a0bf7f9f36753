"""Ten thousand trials in one process: does memory grow, or the time of a trial?"""

import gc
import time
from typing import Any, NamedTuple

import numpy as np
import psutil

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.simulation.trial import TrialRunner

NUM_TRIALS = 10_000
NUM_BLOCKS = 20
# Short, as what a trial leaves behind does not depend on how long it lasts; long enough for two samples, [s].
DURATION = 0.2


class Soak(NamedTuple):
    """Found after each block of trials: memory, [MB], and processor time a trial, [s]; (NUM_BLOCKS,) each."""

    memory: Array
    seconds: Array


def soak(*, trials: int = NUM_TRIALS) -> Soak:
    """Runs trials, each with another object and seed, by turns."""
    experiment = load_hold_experiment("weight")
    runner, process = TrialRunner(experiment.settings), psutil.Process()
    per_block = trials // NUM_BLOCKS
    memory, seconds = [], []
    for block in range(NUM_BLOCKS):
        begun = time.process_time()
        for number in range(per_block):
            tool = experiment.tools[number % len(experiment.tools)]
            runner.run_hold(tool, MaterialMemory(), duration=DURATION, seed=(block, number))
        seconds.append((time.process_time() - begun) / per_block)
        gc.collect()
        memory.append(process.memory_info().rss / 1e6)
    return Soak(np.array(memory), np.array(seconds))


def measure(*, trials: int = NUM_TRIALS) -> tuple[Soak, dict[str, Any]]:
    """Soaks; returns what was found, and the numbers of metrics.json.

    The first block fills caches: growth and drift are those since.
    """
    found = soak(trials=trials)
    quarter = NUM_BLOCKS // 4
    return found, {
        "soak_trials": trials // NUM_BLOCKS * NUM_BLOCKS,
        "soak_memory_growth_MB": float(found.memory[-1] - found.memory[0]),
        "soak_time_drift": float(np.median(found.seconds[-quarter:]) / np.median(found.seconds[1 : 1 + quarter])),
    }
