"""Correct grip of a tool: the one of least work in simulations without errors of vision, arm or sensors.

The true costs are those of the real objects with a fault-free arm and sensors, however features are observed and
whatever faults are active while observers learn.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from affordance.choice.ranking import TIE
from affordance.exceptions import BadValueError
from affordance.objects.tool import Tool
from affordance.proprioception.faults import NO_FAULTS
from affordance.settings import Settings
from affordance.vision.features import FeatureSource, VisionError


class Simulated(Protocol):
    """Simulation of a task."""

    @property
    def work(self) -> float:
        """Absolute work of the joints, [J]."""


def remove_errors(settings: Settings) -> Settings:
    """Returns settings without errors: true features, arm and sensors without a fault."""
    return replace(settings, feature_source=FeatureSource.FEATURES, vision_error=VisionError(), faults=NO_FAULTS)


def find_cheaper_grip(simulated: Mapping[str, Simulated]) -> str:
    """Returns the name of the grip of least absolute work; all grips are known to complete the task."""
    return min(simulated, key=lambda grip: simulated[grip].work)


def check_one_grip_is_cheaper(path: Path, tool: Tool, works: Sequence[float]) -> None:
    """Refuses a tool whose two cheapest grips cost the same, as neither would be correct.

    Raises:
        BadValueError: The two least works are equal within the tolerance of a tie.
    """
    cheapest, second, *others = sorted(works)
    if second <= cheapest * (1.0 + TIE):
        grips = "both grips" if not others else f"two of its {len(works)} grips"
        problem = f"costs {cheapest:g} J in {grips}, must have a cheaper one"
        raise BadValueError(path, f"tools: {tool.name}", problem)


def find_grip_of_densest(tool: Tool, *, at_hand: bool) -> str:
    """Returns the name of the grip with the densest material nearest to the hand, or farthest from it."""

    def measure(held: Tool) -> float:
        densest = max(held.components, key=lambda part: part.material.density)
        return float(np.linalg.norm(densest.X_TE[:3, 3]))

    distances = {grip: measure(held) for grip, held in tool.list_gripped().items()}
    return (min if at_hand else max)(distances, key=distances.__getitem__)
