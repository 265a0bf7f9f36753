"""Layout of a protocol's presentations, the same for every observer, and the measures taken in each."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.protocols.block_entries import ActionEntry, BlockEntry
from affordance.protocols.number_entries import OF_OBJECTS, Measure

# Measures that need a simulated motion.
_OF_MOTION = frozenset(
    {
        *(Measure.DROP, Measure.LIFT, Measure.EXCURSION, Measure.EXCURSION_GRIP, Measure.EXCURSION_CENTRE_OF_MASS),
        *(Measure.DEVIATION, Measure.RISES, Measure.LOG_EVIDENCE),
        *(Measure.PERIODS_LIMITED, Measure.PERIODS_FAILED, Measure.SAMPLES_REJECTED),
    }
)
# Measures that need an object in the hand.
_OF_FEELING = frozenset({Measure.P_VALUE, Measure.OUTLIER})
# Measures that need a reach.
_OF_REACHES = frozenset({Measure.WORK, Measure.PATH_ERROR})
# Measures that need a simulation, whatever the action.
_OF_SIMULATION = frozenset({Measure.COM_ERROR, Measure.INERTIA_ERROR, Measure.DENSITIES})


class Layout(NamedTuple):
    """Layout of the K measured presentations of a protocol: its blocks, and the index of the block of each, (K,)."""

    blocks: Sequence[BlockEntry]
    block: NDArray[np.intp]
    is_closed_form: bool

    def find_measured(self, measure: Measure) -> NDArray[np.bool_]:
        """Returns a mask of the presentations in which a measure is taken, (K,)."""
        if measure is Measure.STOPPED:
            taken = np.array([block.is_chosen for block in self.blocks])
        else:
            taken = np.array([is_measured_in(measure, block.do, self.is_closed_form) for block in self.blocks])
        found: NDArray[np.bool_] = taken[self.block]
        return found

    def list_measures(self) -> list[Measure]:
        """Lists the measures taken in at least one presentation, and the numbers of the objects."""
        return [each for each in Measure if each in OF_OBJECTS or self.find_measured(each).any()]


def lay_out(blocks: Sequence[BlockEntry], groups: Mapping[str, Sequence[int]], *, is_closed_form: bool) -> Layout:
    """Lays out the measured presentations of a protocol; blocks of choices present nothing."""
    counts = [count_presentations(block, groups) if block.measured else 0 for block in blocks]
    return Layout(tuple(blocks), np.repeat(np.arange(len(blocks)), counts), is_closed_form)


def count_presentations(block: BlockEntry, groups: Mapping[str, Sequence[int]]) -> int:
    """Counts the presentations of a block, the same for every observer."""
    if block.do.choose is not None:
        return 0
    return block.repetitions * len(groups[block.objects]) * block.times


def is_measured_in(measure: Measure, action: ActionEntry, is_closed_form: bool) -> bool:
    """Returns whether a measure is taken in presentations with an action."""
    if measure is Measure.FORCE:
        return action.clamp is not None or (is_closed_form and action.look is not None)
    if measure in _OF_REACHES:
        return action.reach is not None
    if measure in _OF_FEELING:
        return action.look is None and action.choose is None
    if measure in _OF_MOTION:
        return not is_closed_form and action.look is None and action.choose is None
    if measure in _OF_SIMULATION:
        return not is_closed_form
    return True
