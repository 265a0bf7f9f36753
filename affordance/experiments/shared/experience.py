"""Experience that observers gain before they are tested, by holding objects block by block.

Simulations II to IV share it: observer r of a seed holds the same objects in the same order with the same errors of
measurement, so the memories of one experiment also serve the choices of the other two.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, list_colours
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.runs.random_streams import Stream
from affordance.settings import DEFAULT_SETTINGS, Settings


@dataclass(frozen=True)
class ExperienceConfig:
    """Configuration of the experience that observers gain in holds of a duration, [s].

    Every block holds each object once, in random order; the number of trials is a multiple of that of the objects.
    """

    tools: tuple[Tool, ...]
    seed: int = 0
    settings: Settings = DEFAULT_SETTINGS
    duration: float = 3.0
    num_trials: int = 6

    def __post_init__(self) -> None:
        """Raises a ValueError if the number of trials is no positive multiple of the number of objects."""
        if self.num_trials < 1 or self.num_trials % len(self.tools):
            raise ValueError(f"num_trials is {self.num_trials}, must be a positive multiple of {len(self.tools)}")

    @property
    def colours(self) -> tuple[Colour, ...]:
        """Colours of all objects, in the order of their components."""
        return list_colours(self.tools)


@dataclass(frozen=True)
class Experience:
    """Memories of many observers."""

    colours: tuple[Colour, ...]  # colours of the M materials
    precision: Array  # precision of the belief before the first and after each of K trials, (repeats, K + 1, M, M)
    information_vector: Array  # information vector of the same beliefs, (repeats, K + 1, M)
    order: NDArray[np.intp]  # index of the object held in each trial, (repeats, K)
    # Number of samples rejected in each trial, (repeats, K); empty if rejection was impossible.
    rejected: NDArray[np.intp] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.intp))
    # 1 where a trial was a 5-sigma outlier, (repeats, K); empty if outliers were impossible.
    outlier: NDArray[np.intp] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.intp))
    # Memories at the same moments, with the objects that were held, as JSON text, (repeats, K + 1); empty if only the
    # beliefs about materials are known.
    memories: NDArray[np.bytes_] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bytes_))
    # P-value of the torques measured in each trial, (repeats, K); empty if unknown.
    p_value: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def num_repeats(self) -> int:
        """Number of observers."""
        return len(self.order)

    @property
    def num_trials(self) -> int:
        """Number of trials K."""
        return int(self.order.shape[1])

    def count_events(self) -> dict[str, int]:
        """Counts rejected samples and outliers over all trials, as in metrics.json."""
        return {"samples_rejected": int(self.rejected.sum()), "trials_outlier": int(self.outlier.sum())}


def draw_order(config: ExperienceConfig, repeat: int) -> list[int]:
    """Draws the order of the objects for an observer, block by block."""
    rng = np.random.default_rng([config.seed, repeat, Stream.ORDER])
    num_blocks = config.num_trials // len(config.tools)
    return [int(index) for _ in range(num_blocks) for index in rng.permutation(len(config.tools))]


def build_experience(
    block: BlockEntry,
    objects: ProtocolObjects,
    learners: Sequence[Learner],
    told: Sequence[tuple[Colour, float]],
    seed: int,
    settings: Settings,
) -> ExperienceConfig | None:
    """Builds the experience of a first block; None if the block is measured, or more than plain shuffled holds."""
    plain = block.do.hold is not None and block.teaches and block.order == "shuffled" and block.first is None
    if block.measured or not plain or block.times > 1 or block.gradual or told or len(learners) > 1:
        return None
    tools = tuple(objects.select(block.objects))
    return ExperienceConfig(tools, seed, settings, block.do.duration, block.repetitions * len(tools))
