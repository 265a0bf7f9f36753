"""Which grip is the right one: the task carried out with each, by an arm that mistakes nothing.

What is called true is of the objects as they are and of arm and sensors without a fault, however observers see and
whatever is wrong when they learn.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from affordance.choice.ranking import TIE
from affordance.exceptions import BadValueError
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.experiments.shared.novel_objects import hold
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, list_densities
from affordance.proprioception.faults import NO_FAULTS
from affordance.settings import Settings
from affordance.vision.features import FeatureSource, VisionError

# What the report says where faults are switched on.
WITHOUT_FAULTS = "What each grip takes, and so which one is correct, is measured without them."


class Executed(Protocol):
    """A task that was carried out."""

    @property
    def work(self) -> float:
        """Mechanical work without recovery, [J]."""


def remove_errors(settings: Settings) -> Settings:
    """Settings under which nothing is mistaken: features as they are, arm and sensors without a fault."""
    return replace(settings, feature_source=FeatureSource.FEATURES, vision_error=VisionError(), faults=NO_FAULTS)


def remove_errors_of(experience: ExperienceConfig) -> ExperienceConfig:
    """The same objects for an observer who mistakes nothing."""
    return replace(experience, settings=remove_errors(experience.settings))


def execute[Done](
    tool: Tool, settings: Settings, carry_out: Callable[[Tool, Mapping[Colour, float], Settings], Done]
) -> dict[str, Done]:
    """Carries a task out with each grip of a tool, under the true densities.

    Args:
        tool: The tool.
        settings: Those of the experiment; what they say is mistaken is not.
        carry_out: Simulates the task, given the tool as it is gripped, the densities and the settings.
    """
    densities, exact = list_densities([tool]), remove_errors(settings)
    return {grip: carry_out(held, densities, exact) for grip, held in hold(tool).items()}


def find_cheaper_grip(executed: Mapping[str, Executed]) -> str:
    """Names the grip of least work; all are known to do what is asked."""
    return min(executed, key=lambda grip: executed[grip].work)


def check_one_grip_is_cheaper(models: Path, tool: Tool, works: Sequence[float]) -> None:
    """Refuses objects of whose grips none is the correct one.

    Raises:
        BadValueError: The least works are equal.
    """
    cheaper, dearer = sorted(works)
    if dearer <= cheaper * (1.0 + TIE):
        problem = f"costs {cheaper:g} J in both grips, must have a cheaper one"
        raise BadValueError(models / "tools" / "novel.yaml", f"tools: {tool.name}", problem)


def find_grip_of_densest(tool: Tool, *, at_hand: bool) -> str:
    """Names the grip that has the densest material next to the hand, or farthest from it."""

    def measure(held: Tool) -> float:
        densest = max(held.components, key=lambda part: part.material.density)
        return float(np.linalg.norm(densest.X_TE[:3, 3]))

    distances = {grip: measure(held) for grip, held in hold(tool).items()}
    return (min if at_hand else max)(distances, key=distances.__getitem__)
