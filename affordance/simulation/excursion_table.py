"""How far the hand moves at release, for hundreds of lifts: simulated at some beliefs, interpolated between.

The outstretched arm has no closed form for this: a belief that is a seventh too light makes it unstable, to first
order, against turning its forearm, and what it sinks by is decided by what is beyond.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.tool import Tool
from affordance.simulation.clamp_trial import run_clamp_and_release
from affordance.simulation.trial import TrialRunner

# Believed over true weight where it is simulated: closer where the hand moves little.
_FACTORS = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0])


class ExcursionTable(NamedTuple):
    """Movements of the hand after release from a clamp, for one object.

    Attributes:
        force: Upward force before release, that is the believed weight, (K,), increasing, [N].
        excursion: The farthest that the hand went up or, negative, down from where it was, (K,), [m].
    """

    force: Array
    excursion: Array

    def interpolate(self, force: Array) -> Array:
        """Excursions at forces before release, both of one shape; between what is simulated off by at most 1 %.

        Raises:
            ValueError: A force lies outside the table.
        """
        low, high = self.force[[0, -1]]
        if force.min() < low or force.max() > high:
            found = f"{force.min():g} to {force.max():g}"
            raise ValueError(f"forces are from {found} N, must be from {low:g} to {high:g}")
        excursion: Array = PchipInterpolator(self.force, self.excursion)(force)
        return excursion


def tabulate_excursions(runner: TrialRunner, tool: Tool, *, duration: float) -> ExcursionTable:
    """Simulates clamp and release for beliefs from three tenths to twice the true weight, some 0.3 s each.

    Args:
        runner: Runs it.
        tool: The object, of one colour.
        duration: How long it is held after release, [s].

    Raises:
        ValueError: The object shows more than one colour.
    """
    colours = {part.looks_like.colour for part in tool.components}
    if len(colours) > 1:
        raise ValueError(f"{tool.name} shows {len(colours)} colours, must show one")
    (colour,) = colours
    density = tool.mass / sum(part.shape.volume for part in tool.components)
    records = [
        run_clamp_and_release(
            runner, tool, MaterialMemory.from_densities({colour: factor * density}), duration=duration, seed=(0,)
        )[1]
        for factor in _FACTORS
    ]
    force, excursion = np.array([(record.force, record.excursion) for record in records]).T
    return ExcursionTable(force, excursion)
