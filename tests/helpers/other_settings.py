"""Experiments with other settings, for tests."""

from dataclasses import replace
from typing import Any

from affordance.experiments.shared.choosing import ChoiceExperiment
from affordance.settings import Settings


def with_settings(experiment: Any, settings: Settings) -> Any:
    """Returns the experiment with other settings; one of choices has those of its experience."""
    if isinstance(experiment, ChoiceExperiment):
        return replace(experiment, experience=replace(experiment.experience, settings=settings))
    return replace(experiment, settings=settings)
