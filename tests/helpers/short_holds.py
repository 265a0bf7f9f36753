"""Experiments with shorter and fewer holds, other objects or settings, and rough plans."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from affordance.choice import off_axis
from affordance.experiments.shared.choice_task import ChoicePlan
from affordance.experiments.shared.choosing import ChoiceExperiment
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.objects.tool import Tool
from affordance.settings import Settings


def with_tools(experiment: PresentationExperiment, tools: Sequence[Tool], **changes: Any) -> PresentationExperiment:
    """Returns the experiment with other objects, and other ``groups`` if these are given."""
    return replace(experiment, objects=experiment.objects._replace(tools=tuple(tools), **changes))


def shorten(
    experiment: PresentationExperiment, duration: float, repetitions: int | None = None
) -> PresentationExperiment:
    """Returns the experiment with holds of another duration, [s], and other repetitions of the first block."""
    blocks = list(experiment.blocks)
    for index, block in enumerate(blocks):
        if block.do.hold is not None:
            hold = block.do.hold.model_copy(update={"duration": duration})
            blocks[index] = block.model_copy(update={"do": block.do.model_copy(update={"hold": hold})})
    if repetitions is not None:
        blocks[0] = blocks[0].model_copy(update={"repetitions": repetitions})
    return replace(experiment, blocks=tuple(blocks))


def take_two_tools(experiment: ChoiceExperiment) -> ChoiceExperiment:
    """Returns an experiment about its first two tools, after holds of half a second, which teach nearly as much."""
    experience = replace(experiment.experience, duration=0.5)
    return replace(experiment, novel=experiment.novel[:2], experience=experience)


def choose_for_one_tool(experiment: PresentationExperiment) -> PresentationExperiment:
    """Returns an experiment whose observers choose for the sake of the first novel tool alone."""
    chooser = replace(experiment.means.chooser, tools=experiment.means.chooser.tools[:1])
    return replace(experiment, means=replace(experiment.means, chooser=chooser))


def with_settings(experiment: Any, settings: Settings) -> Any:
    """Returns the experiment with other settings; one of choices has those of its experience."""
    if isinstance(experiment, ChoiceExperiment):
        return replace(experiment, experience=replace(experiment.experience, settings=settings))
    return replace(experiment, settings=settings)


def plan_roughly(experiment: ChoiceExperiment) -> ChoicePlan:
    """Plans with parts of each tool moved in two ways only; ``choice/test_off_axis.py`` tries all of them."""
    every = off_axis.list_shifted
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(off_axis, "list_shifted", lambda tool: [*every(tool)][:2])
        return experiment.plan(jobs=1)
