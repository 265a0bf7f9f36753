"""What observers learn before they are tested: holding honest objects, block by block.

Simulations II to IV share it: observer r of a seed holds the same objects in the same order and feels the same, so
that what was learned in one experiment is what the other two choose by.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory import Memory
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.random_streams import Stream
from affordance.runs.repeats import compute_key, run_repeats
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.trial import TrialRecord, get_runner

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class ExperienceConfig:
    """How experience is gained.

    Attributes:
        tools: The honest objects; every block holds each of them once, in random order.
        seed: Root of every random draw.
        settings: What all simulations share.
        duration: How long each object is held, [s].
        num_trials: How many holds, a multiple of the number of objects.
    """

    tools: tuple[Tool, ...]
    seed: int = 0
    settings: Settings = DEFAULT_SETTINGS
    duration: float = 3.0
    num_trials: int = 6

    def __post_init__(self) -> None:
        """Checks the number of trials.

        Raises:
            ValueError: It is not a positive multiple of the number of objects.
        """
        if self.num_trials < 1 or self.num_trials % len(self.tools):
            raise ValueError(f"num_trials is {self.num_trials}, must be a positive multiple of {len(self.tools)}")

    @property
    def colours(self) -> tuple[Colour, ...]:
        """The colours of all objects, in the order of their components."""
        return tuple(dict.fromkeys(part.looks_like.colour for tool in self.tools for part in tool.components))


def _count_none() -> NDArray[np.intp]:
    return np.zeros((0, 0), dtype=np.intp)


@dataclass(frozen=True)
class Experience:
    """The memories of many observers.

    Attributes:
        colours: Colours of the materials, M of them.
        precision: Of the belief before the first and after each of K trials, (repeats, K + 1, M, M).
        information_vector: Of the same, (repeats, K + 1, M).
        order: Which object was held in each trial, (repeats, K).
        rejected: How many samples of each trial were refused, (repeats, K); empty if none can have been.
        surprising: Whether each trial was grossly surprising, (repeats, K); empty if none can have been.
    """

    colours: tuple[Colour, ...]
    precision: Array
    information_vector: Array
    order: NDArray[np.intp]
    rejected: NDArray[np.intp] = field(default_factory=_count_none)
    surprising: NDArray[np.intp] = field(default_factory=_count_none)

    @property
    def num_repeats(self) -> int:
        """How many observers."""
        return len(self.order)

    @property
    def num_trials(self) -> int:
        """How many trials K."""
        return int(self.order.shape[1])

    def count_faults(self) -> dict[str, int]:
        """What went wrong in all trials, as metrics.json has it."""
        return {"samples_rejected": int(self.rejected.sum()), "trials_surprising": int(self.surprising.sum())}

    def recall(self, repeat: int, num_trials: int) -> MaterialMemory:
        """The memory of an observer after a number of trials."""
        return MaterialMemory(
            self.colours,
            DensityBelief(self.precision[repeat, num_trials], self.information_vector[repeat, num_trials]),
        )


def draw_order(config: ExperienceConfig, repeat: int) -> list[int]:
    """Draws the order of the objects for an observer, block by block."""
    rng = np.random.default_rng([config.seed, repeat, Stream.ORDER])
    num_blocks = config.num_trials // len(config.tools)
    return [int(index) for _ in range(num_blocks) for index in rng.permutation(len(config.tools))]


def run_trials(config: ExperienceConfig, repeat: int) -> tuple[list[Memory], list[TrialRecord]]:
    """Runs an observer's K trials; returns K + 1 memories, the first before any of them, and the records."""
    runner = get_runner(config.settings)
    memory: Memory = MaterialMemory().add_colours(config.colours, config.settings.prior)
    memories, records = [memory], []
    for trial, index in enumerate(draw_order(config, repeat)):
        seed = (config.seed, repeat, trial)
        record = runner.run_hold(config.tools[index], memory, duration=config.duration, seed=seed)
        # A look that was not recognised for certain is forgotten; what it taught of the others is not.
        memory = record.memory.restrict_to(config.colours)
        memories.append(memory)
        records.append(record)
    return memories, records


def gain_experience(config: ExperienceConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Runs an observer's trials, and notes what they taught.

    Returns: ``precision`` (K + 1, M, M), ``information_vector`` (K + 1, M), and ``order``, ``log_evidence``,
        ``rejected`` and ``surprising``, (K,) each.
    """
    memories, records = run_trials(config, repeat)
    return {
        "precision": np.stack([memory.belief.precision for memory in memories]),
        "information_vector": np.stack([memory.belief.information_vector for memory in memories]),
        "order": np.array(draw_order(config, repeat), dtype=np.intp),
        "log_evidence": np.array([record.log_evidence for record in records]),
        "rejected": np.array([record.samples.rejected for record in records], dtype=np.intp),
        "surprising": np.array([record.surprising for record in records], dtype=np.intp),
    }


def collect_experience(config: ExperienceConfig, folder: Path, *, repeats: int, jobs: int) -> Experience:
    """Runs the observers that a folder does not hold yet, and returns all of them; says what went wrong in trials.

    Args:
        config: How experience is gained.
        folder: Keeps them, for all experiments that share the configuration.
        repeats: How many observers, at least 1.
        jobs: How many processes, at least 1.
    """
    kept = folder / compute_key(config, config.settings.arm.parent)
    arrays: Mapping[str, NDArray[Any]] = run_repeats(
        kept, partial(gain_experience, config), repeats=repeats, jobs=jobs, description="experience"
    )
    names = ("precision", "information_vector", "order", "rejected", "surprising")
    experience = Experience(config.colours, *(arrays[name] for name in names))
    counts = experience.count_faults()
    if any(counts.values()):
        _LOG.warning(
            "experience: %d samples were refused, and %d of %d trials are grossly surprising",
            counts["samples_rejected"],
            counts["trials_surprising"],
            experience.order.size,
        )
    return experience
