"""Simulation of the observers who gain experience, in parallel processes; their memories are cached."""

import logging
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.belief.kind_memory import start_memory
from affordance.belief.memory_file import format_memory
from affordance.belief.object_belief import Memory
from affordance.experiments.shared.experience import Experience, ExperienceConfig, draw_order
from affordance.files.model_files import list_arm_files
from affordance.runs.random_streams import Stream
from affordance.runs.repeats import compute_key, run_repeats
from affordance.simulation.trial import Observer, get_runner
from affordance.simulation.trial_record import TrialRecord

_LOG = logging.getLogger(__name__)


def run_trials(config: ExperienceConfig, repeat: int) -> tuple[list[Memory], list[TrialRecord]]:
    """Runs an observer's K trials; returns the K + 1 memories, the first before any of them, and the records.

    A colour that was not recognised with certainty is forgotten after its trial; the rest of the update is kept.
    """
    start = start_memory(config.settings.learner, (config.seed, repeat, Stream.KINDS))
    memory = start.add_colours(config.colours, config.settings.prior).restrict_to(config.colours)
    observer = Observer(get_runner(config.settings), memory, duration=config.duration, remembered=config.colours)
    memories: list[Memory] = [memory]
    records = []
    for trial, index in enumerate(draw_order(config, repeat)):
        records.append(observer.hold(config.tools[index], (config.seed, repeat, trial)))
        memories.append(observer.memory)
    return memories, records


def gain_experience(config: ExperienceConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Runs an observer's trials, and returns the memories and measurements as arrays.

    Returns: ``precision`` (K + 1, M, M), ``information_vector`` (K + 1, M), and ``order``, ``log_evidence``,
        ``p_value``, ``rejected`` and ``outlier``, (K,) each; and ``memories`` (K + 1,), as JSON text.
    """
    memories, records = run_trials(config, repeat)
    return {
        "precision": np.stack([memory.belief.precision for memory in memories]),
        "information_vector": np.stack([memory.belief.information_vector for memory in memories]),
        "order": np.array(draw_order(config, repeat), dtype=np.intp),
        "log_evidence": np.array([record.log_evidence for record in records]),
        "p_value": np.array([record.p_value for record in records]),
        "rejected": np.array([record.samples.rejected for record in records], dtype=np.intp),
        "outlier": np.array([record.is_outlier for record in records], dtype=np.intp),
        "memories": np.array([format_memory(memory).encode() for memory in memories]),
    }


def collect_experience(config: ExperienceConfig, folder: Path, *, repeats: int, jobs: int) -> Experience:
    """Runs the observers that a folder does not hold yet, logs trials that went wrong, and returns all observers."""
    kept = folder / compute_key(config, list_arm_files(config.settings.arm))
    arrays: Mapping[str, NDArray[Any]] = run_repeats(
        kept, partial(gain_experience, config), repeats=repeats, jobs=jobs, description="experience"
    )
    names = ("precision", "information_vector", "order", "rejected", "outlier")
    more = {name: arrays[name] for name in ("memories", "p_value") if name in arrays}
    experience = Experience(config.colours, *(arrays[name] for name in names), **more)
    counts = experience.count_events()
    if any(counts.values()):
        _LOG.warning(
            "experience: %d samples were rejected, and %d of %d trials are 5-sigma outliers",
            counts["samples_rejected"],
            counts["trials_outlier"],
            experience.order.size,
        )
    return experience
