"""From a protocol's file to the experiment that runs it."""

from dataclasses import replace
from pathlib import Path

from affordance.belief.learners import Learner
from affordance.exceptions import BadValueError, describe_choice
from affordance.experiments.holding import QUARTILES, HoldExperiment
from affordance.experiments.shared.checks import check_tools_can_be_held
from affordance.experiments.shared.hold_measures import EXPECTED
from affordance.files.model_folder import MODELS
from affordance.objects.colour import Colour
from affordance.proprioception.torque_noise import WeberNoise
from affordance.protocols.object_entries import ProtocolObjects, build_objects, find_file
from affordance.protocols.protocol import Protocol, find_protocol, load_protocol
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.features import FeatureSource


def load_experiment(
    name: str, models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS
) -> HoldExperiment:
    """Loads a protocol of simulated presentations, by its name or path.

    Raises:
        BadValueError: A file is wrong, or the objects are not as the protocol requires.
        ModelFileError: The arm cannot be loaded or is not fit.
    """
    path = find_protocol(name, models)
    return build_hold_experiment(load_protocol(path), path, models, seed, settings)


def build_hold_experiment(
    protocol: Protocol, path: Path, models: Path, seed: int, settings: Settings
) -> HoldExperiment:
    """Builds the experiment of a protocol of simulated presentations.

    Raises:
        BadValueError: A file is wrong, or the objects are not as the protocol requires.
        ModelFileError: The arm cannot be loaded or is not fit.
    """
    settings = apply_observers(protocol, path, models, settings)
    objects = build_objects(protocol.objects, path, models)
    check_tools_can_be_held(objects.path, objects.tools, settings)
    measured = [block for block in protocol.blocks if block.measured]
    if not measured:
        raise BadValueError(path, "blocks", "has no block that is measured, must have at least one")
    if len({block.do.duration for block in measured if block.do.duration}) > 1:
        raise BadValueError(path, "blocks", "has measured blocks of several durations, must have one duration")
    entries = protocol.numbers.values()
    return HoldExperiment(
        name=protocol.name,
        section=path,
        objects=objects,
        blocks=tuple(protocol.blocks),
        learners=tuple(protocol.observers.learners),
        told=list_told(protocol, path, objects),
        models=models,
        seed=seed,
        settings=settings,
        quantiles=tuple(sorted({*QUARTILES, *(entry.quantile for entry in entries)})),
        expects=any(entry.measure in EXPECTED for entry in entries),
        numbers=protocol.numbers,
        figures=protocol.figures,
    )


def apply_observers(protocol: Protocol, path: Path, models: Path, settings: Settings) -> Settings:
    """Settings with the arm, noise and vision that a protocol asks for."""
    observers = protocol.observers
    if observers.vision is not None:
        settings = replace(settings, feature_source=FeatureSource(observers.vision))
    if observers.noise is not None:
        settings = replace(settings, noise=WeberNoise(**observers.noise.model_dump()))
    if observers.arm is not None:
        settings = replace(settings, arm=find_file(observers.arm, path, models))
    return settings


def list_told(protocol: Protocol, path: Path, objects: ProtocolObjects) -> tuple[tuple[Colour, float], ...]:
    """Densities that observers are told, by the colour of the material.

    Raises:
        BadValueError: No object is of such a material, or observers learn by kinds.
    """
    materials = {part.material.name: part.material for tool in objects.tools for part in tool.components}
    for index, name in enumerate(protocol.observers.told):
        if name not in materials:
            raise BadValueError(path, f"observers.told[{index}]", describe_choice(name, materials))
        if protocol.observers.learners != [Learner.DENSITY]:
            raise BadValueError(path, "observers.told", "is given, must not be where observers learn by kinds")
    return tuple((materials[name].colour, materials[name].density) for name in protocol.observers.told)
