"""Simulated observers as a protocol describes them: arm, noise, vision, learners and known densities."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, describe_choice
from affordance.named_settings import NO_CHANGES, Changes, change_settings
from affordance.objects.colour import Colour
from affordance.proprioception.torque_noise import WeberNoise
from affordance.protocols.object_entries import ProtocolObjects, find_file
from affordance.protocols.protocol import Protocol
from affordance.settings import Settings
from affordance.vision.features import FeatureSource

# Settings that have a key of their own in ``observers``.
_OWN_WORDS = {"learners": "learner", "vision": "feature_source", "noise": "noise"}


def apply_observers(
    protocol: Protocol, path: Path, models: Path, settings: Settings, changes: Changes = NO_CHANGES
) -> tuple[Settings, tuple[Learner, ...]]:
    """Returns the settings with the arm, noise and vision that a protocol asks for, and its learners.

    Args:
        protocol: Protocol, whose ``settings`` are applied first.
        path: File of the protocol.
        models: Folder of models.
        settings: Settings to start from.
        changes: Settings by name that a user asks for, applied last.

    Raises:
        BadValueError: A setting is wrong, or given twice.
    """
    observers = protocol.observers
    named = [*protocol.settings, *changes]
    for own, name in _OWN_WORDS.items():
        if getattr(observers, own) is not None and any(each.partition(".")[0] == name for each in named):
            problem = f"is given with observers.{own}, only one of them must be"
            raise BadValueError(path, f"settings.{name}", problem)
    if observers.vision is not None:
        settings = replace(settings, feature_source=FeatureSource(observers.vision))
    if observers.noise is not None:
        settings = replace(settings, noise=WeberNoise(**observers.noise.model_dump()))
    if observers.arm is not None:
        settings = replace(settings, arm=find_file(observers.arm, "observers.arm", path, models))
    settings = change_settings(change_settings(settings, protocol.settings, path), changes)
    learners = tuple(observers.learners or [settings.learner])
    return replace(settings, learner=learners[0]), learners


def list_told(
    protocol: Protocol, path: Path, objects: ProtocolObjects, learners: Sequence[Learner]
) -> tuple[tuple[Colour, float], ...]:
    """Lists the densities that observers know from the start, by colour of the material, [kg/m^3].

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
