"""Which grip is the correct one: the task simulated with each, by an arm that mistakes nothing.

What is called true is of the objects as they are and of arm and sensors without a fault, however features are
observed and whatever is wrong when observers learn.
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
    """A task that was simulated."""

    @property
    def work(self) -> float:
        """Absolute work of the joints, [J]."""


def remove_errors(settings: Settings) -> Settings:
    """Settings under which nothing is mistaken: true features, arm and sensors without a fault."""
    return replace(settings, feature_source=FeatureSource.FEATURES, vision_error=VisionError(), faults=NO_FAULTS)


def find_cheaper_grip(simulated: Mapping[str, Simulated]) -> str:
    """Names the grip of least absolute work; all are known to do what is asked."""
    return min(simulated, key=lambda grip: simulated[grip].work)


def check_one_grip_is_cheaper(path: Path, tool: Tool, works: Sequence[float]) -> None:
    """Refuses objects of whose grips none is the correct one.

    Raises:
        BadValueError: The least works are equal.
    """
    cheaper, dearer = sorted(works)
    if dearer <= cheaper * (1.0 + TIE):
        problem = f"costs {cheaper:g} J in both grips, must have a cheaper one"
        raise BadValueError(path, f"tools: {tool.name}", problem)


def find_grip_of_densest(tool: Tool, *, at_hand: bool) -> str:
    """Names the grip that has the densest material next to the hand, or farthest from it."""

    def measure(held: Tool) -> float:
        densest = max(held.components, key=lambda part: part.material.density)
        return float(np.linalg.norm(densest.X_TE[:3, 3]))

    distances = {grip: measure(held) for grip, held in tool.list_gripped().items()}
    return (min if at_hand else max)(distances, key=distances.__getitem__)
