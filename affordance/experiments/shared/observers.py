"""Who is simulated, as a protocol says it: arm, noise, vision, learners and what they are told."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, describe_choice
from affordance.objects.colour import Colour
from affordance.proprioception.torque_noise import WeberNoise
from affordance.protocols.object_entries import ProtocolObjects, find_file
from affordance.protocols.protocol import Protocol
from affordance.settings import Settings
from affordance.vision.features import FeatureSource


def apply_observers(
    protocol: Protocol, path: Path, models: Path, settings: Settings
) -> tuple[Settings, tuple[Learner, ...]]:
    """Settings with the arm, noise and vision that a protocol asks for, and its learners."""
    observers = protocol.observers
    if observers.vision is not None:
        settings = replace(settings, feature_source=FeatureSource(observers.vision))
    if observers.noise is not None:
        settings = replace(settings, noise=WeberNoise(**observers.noise.model_dump()))
    if observers.arm is not None:
        settings = replace(settings, arm=find_file(observers.arm, "observers.arm", path, models))
    learners = tuple(observers.learners or [settings.learner])
    return replace(settings, learner=learners[0]), learners


def list_told(
    protocol: Protocol, path: Path, objects: ProtocolObjects, learners: Sequence[Learner]
) -> tuple[tuple[Colour, float], ...]:
    """Densities that observers are told, by the colour of the material.

    Raises:
        BadValueError: No object is of such a material, or observers learn by kinds.
    """
    materials = {part.material.name: part.material for tool in objects.tools for part in tool.components}
    for index, name in enumerate(protocol.observers.told):
        if name not in materials:
            raise BadValueError(path, f"observers.told[{index}]", describe_choice(name, materials))
        if tuple(learners) != (Learner.DENSITY,):
            raise BadValueError(path, "observers.told", "is given, must not be where observers learn by kinds")
    return tuple((materials[name].colour, materials[name].density) for name in protocol.observers.told)
