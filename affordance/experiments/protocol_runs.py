"""From a protocol's file to the experiment that runs it."""

from pathlib import Path

from affordance.choice.hammer import Hammer, load_hammer
from affordance.choice.reach import Reach
from affordance.control.start_posture import check_start
from affordance.control.timed_path import load_path
from affordance.exceptions import BadValueError
from affordance.experiments.definition import Experiment
from affordance.experiments.hammer.experiment import HammerExperiment
from affordance.experiments.holding import QUARTILES, HoldExperiment
from affordance.experiments.lifting import build_lift_experiment
from affordance.experiments.reach import ReachExperiment
from affordance.experiments.shared.checks import check_durations, check_tools_can_be_held
from affordance.experiments.shared.experience import build_experience
from affordance.experiments.shared.hold_measures import EXPECTED
from affordance.experiments.shared.observers import apply_observers, list_told
from affordance.files.model_folder import MODELS
from affordance.named_settings import NO_CHANGES, Changes
from affordance.plant.arm import load_arm
from affordance.protocols.object_entries import ProtocolObjects, build_objects, find_file
from affordance.protocols.protocol import Protocol, find_protocol, load_protocol
from affordance.settings import DEFAULT_SETTINGS, Settings


def load_protocol_experiment(
    name: str,
    models: Path = MODELS,
    seed: int = 0,
    settings: Settings = DEFAULT_SETTINGS,
    changes: Changes = NO_CHANGES,
) -> Experiment:
    """Loads a protocol, by its name or path; changes are settings by name, which come after those of the protocol.

    Raises:
        BadValueError: A file is wrong, or the objects are not as the protocol requires.
        ModelFileError: The arm cannot be loaded or is not fit.
    """
    path = find_protocol(name, models)
    protocol = load_protocol(path)
    if protocol.is_closed_form:
        return build_lift_experiment(protocol, path, models, seed, settings, changes)
    if any(block.do.choose is not None for block in protocol.blocks):
        return build_choice_experiment(protocol, path, models, seed, settings, changes)
    return build_hold_experiment(protocol, path, models, seed, settings, changes)


def load_hold_experiment(
    name: str, models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS
) -> HoldExperiment:
    """Loads a protocol of simulated presentations; see ``load_protocol_experiment``."""
    path = find_protocol(name, models)
    return build_hold_experiment(load_protocol(path), path, models, seed, settings)


def load_choice_experiment(
    name: str, models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS
) -> ReachExperiment | HammerExperiment:
    """Loads a protocol of choices; see ``load_protocol_experiment``."""
    path = find_protocol(name, models)
    return build_choice_experiment(load_protocol(path), path, models, seed, settings)


def build_hold_experiment(
    protocol: Protocol, path: Path, models: Path, seed: int, settings: Settings, changes: Changes = NO_CHANGES
) -> HoldExperiment:
    """Builds the experiment of a protocol of simulated presentations.

    Raises:
        BadValueError: A file is wrong, or the objects are not as the protocol requires.
        ModelFileError: The arm cannot be loaded or is not fit.
    """
    settings, learners = apply_observers(protocol, path, models, settings, changes)
    check_durations(protocol, path, settings)
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
        learners=learners,
        told=list_told(protocol, path, objects, learners),
        models=models,
        seed=seed,
        settings=settings,
        quantiles=tuple(sorted({*QUARTILES, *(entry.quantile for entry in entries)})),
        expects=any(entry.measure in EXPECTED for entry in entries),
        numbers=protocol.numbers,
        figures=protocol.figures,
    )


def build_choice_experiment(
    protocol: Protocol, path: Path, models: Path, seed: int, settings: Settings, changes: Changes = NO_CHANGES
) -> ReachExperiment | HammerExperiment:
    """Builds the experiment of a protocol of choices.

    Raises:
        BadValueError: A file is wrong, or objects or blocks are not as they must be.
        ModelFileError: The arm cannot be loaded or is not fit.
    """
    settings, learners = apply_observers(protocol, path, models, settings, changes)
    check_durations(protocol, path, settings)
    objects = build_objects(protocol.objects, path, models)
    told = list_told(protocol, path, objects, learners)
    *_, last = protocol.blocks
    experience = build_experience(protocol.blocks[0], objects, learners, told, seed, settings)
    if len(protocol.blocks) != 2 or last.do.choose is None or not last.ask_after_each or experience is None:
        problem = "must be two: shuffled holds that teach and are not measured, and a choice with ask_after_each"
        raise BadValueError(path, "blocks", problem)
    choice = last.do.choose
    task_file = find_file(choice.reach or choice.hammer or "", path, models)
    task: Reach | Hammer = Reach(load_path(task_file)) if choice.reach else load_hammer(task_file)
    start = task.path.start if isinstance(task, Reach) else task.start
    check_start(task_file, "start" if choice.reach else "blow.start", start, load_arm(settings.arm))
    assert protocol.novel is not None  # a choice is about them
    novel = build_objects(protocol.novel, path, models)
    check_colours_known(novel, objects)
    check_tools_can_be_held(objects.path, experience.tools, settings)
    held = [gripped for tool in novel.tools for gripped in tool.list_gripped().values()]
    check_tools_can_be_held(novel.path, held, settings, start)
    common = (protocol.name, path, experience, novel.tools, models, task_file, novel.path)
    return ReachExperiment(*common, task) if isinstance(task, Reach) else HammerExperiment(*common, task)


def check_colours_known(novel: ProtocolObjects, objects: ProtocolObjects) -> None:
    """Refuses novel objects of a colour that no object held before has.

    Raises:
        BadValueError: There is one.
    """
    known = {part.looks_like.colour for tool in objects.tools for part in tool.components}
    for tool in novel.tools:
        unknown = {part.looks_like.name for part in tool.components if part.looks_like.colour not in known}
        if unknown:
            problem = f"looks like {', '.join(sorted(unknown))}, must look like what {objects.path.name} is made of"
            raise BadValueError(novel.path, f"tools: {tool.name}", problem)
