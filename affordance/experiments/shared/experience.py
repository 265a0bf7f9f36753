"""Learning block with the objects of Simulation II, which Simulations II to IV share.

In these simulations, an observer holds the same objects in the same order with the same measurement errors. Its
memories are therefore computed once, and stored in a separate folder.
"""

import logging
from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr

from affordance.arrays import about
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory_file import format_memory, parse_memory
from affordance.experiments.shared.holds import describe_holds, tabulate_holds
from affordance.experiments.shared.observers import Setup, run_observers
from affordance.objects.tool import Tool, list_colours
from affordance.runs.random_streams import Stream
from affordance.simulation.trial import Observer, get_runner
from affordance.simulation.trial_record import TrialRecord

_LOG = logging.getLogger(__name__)

DURATION = 3.0  # duration of each hold, [s]
REPETITIONS = 3  # number of holds of each object


def gain_experience(setup: Setup, tools: Sequence[Tool]) -> xr.Dataset:
    """Simulates observers that hold each object several times in random order.

    Returns:
        Dataset with ``memories`` (observer, moment), JSON texts before the first trial and after each trial;
        ``object`` (observer, trial), the index of the held object; ``outlier`` (observer, trial), True for outlier
        trials; and the variables of ``describe_holds`` (observer, trial).
    """
    data = run_observers("experience", setup, observe, tuple(tools))
    outliers = int(data.outlier.sum())
    rejected = int(data.samples_rejected.sum())
    if outliers or rejected:
        _LOG.warning(
            "experience: %d samples were rejected, and %d of %d trials are 5-sigma outliers",
            rejected,
            outliers,
            data.outlier.size,
        )
    return data


def observe(setup: Setup, tools: Sequence[Tool], observer: int) -> xr.Dataset:
    """Simulates one observer, and returns its part of the dataset of ``gain_experience``."""
    order, memories, records = hold(setup, tools, observer)
    return xr.Dataset(
        {
            "memories": (
                "moment",
                [format_memory(memory).encode() for memory in memories],
                about("1", "memory as JSON"),
            ),
            "object": ("trial", order, about("1", "index of the object")),
            "outlier": (
                "trial",
                [each.is_outlier for each in records],
                about("1", "whether the trial is a 5-sigma outlier"),
            ),
            **describe_holds([tools[index] for index in order], memories, records, setup.settings),
        }
    )


def hold(
    setup: Setup, tools: Sequence[Tool], observer: int
) -> tuple[list[int], list[MaterialMemory], list[TrialRecord]]:
    """Simulates holds of the objects by one observer in random order.

    Colours that are not recognised with certainty are forgotten after the trial.

    Returns:
        Index of the held object in each trial, memories before the first trial and after each trial, and the record
        of each trial.
    """
    settings, colours = setup.settings, list_colours(tools)
    memory = setup.start_memory(observer).add_colours(colours, settings.prior).restrict_to(colours)
    hand = Observer(get_runner(settings), memory, duration=DURATION, remembered=colours)
    order = draw_order(setup, len(tools), observer)
    memories, records = [memory], []
    for trial, index in enumerate(order):
        records.append(hand.hold(tools[index], (setup.seed, observer, trial)))
        setup.remember(records[-1])
        memories.append(hand.memory)
    return order, memories, records


def draw_order(setup: Setup, count: int, observer: int) -> list[int]:
    """Draws the order of objects for an observer, with a random permutation per repetition."""
    rng = np.random.default_rng([setup.seed, observer, Stream.ORDER])
    return [int(index) for _ in range(REPETITIONS) for index in rng.permutation(count)]


def recall(setup: Setup, experience: xr.Dataset, observer: int, trial: int) -> MaterialMemory:
    """Loads an observer's memory after a number of trials."""
    learner = setup.settings.learner.of_observers([observer])
    return parse_memory(experience.memories.values[observer, trial].item(), learner)


def count_events(experience: xr.Dataset) -> dict[str, int]:
    """Counts rejected samples and outlier trials, for metrics.json."""
    return {
        "samples_rejected": int(experience.samples_rejected.sum()),
        "trials_outlier": int(experience.outlier.sum()),
    }


def tabulate_experience(experience: xr.Dataset, tools: Sequence[Tool], learner: str) -> pd.DataFrame:
    """Tabulates the holds, with the columns of lifts.csv."""
    return tabulate_holds(experience, tools, learner=learner, block="learning", objects=experience.object.values)
