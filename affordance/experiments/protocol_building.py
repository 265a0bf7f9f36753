"""Construction of an experiment from its protocol: every file that it names is read and checked, nothing is run."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from affordance.belief.learner import Learner
from affordance.choice.hammer import Hammer, load_hammer
from affordance.choice.reach import Reach
from affordance.control.start_posture import check_start
from affordance.control.timed_path import load_path
from affordance.exceptions import BadValueError
from affordance.experiments.hammer.experiment import HammerExperiment
from affordance.experiments.holding import HoldExperiment
from affordance.experiments.lifting import LiftExperiment
from affordance.experiments.reach import ReachExperiment
from affordance.experiments.shared.checks import check_durations, check_tools_can_be_held
from affordance.experiments.shared.experience import build_experience
from affordance.experiments.shared.hold_measures import EXPECTED
from affordance.experiments.shared.observers import apply_observers, list_told
from affordance.experiments.shared.presented import QUARTILES
from affordance.named_settings import NO_CHANGES, Changes
from affordance.plant.load import load_arm
from affordance.proprioception.faults import NO_FAULTS
from affordance.protocols.block_checks import check_blocks, list_changed
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.number_entries import Measure
from affordance.protocols.object_entries import ProtocolObjects, build_objects, find_file
from affordance.protocols.people import People, check_table
from affordance.protocols.people_lifts import load_people_lifts
from affordance.protocols.protocol import Protocol
from affordance.protocols.published import load_published
from affordance.settings import Settings
from affordance.simulation.static_lifts import check_closed_form
from affordance.vision.features import FeatureSource


def build_hold_experiment(
    protocol: Protocol, path: Path, models: Path, seed: int, settings: Settings, changes: Changes = NO_CHANGES
) -> HoldExperiment:
    """Builds the experiment of a protocol with simulated presentations.

    Raises:
        BadValueError: A file is wrong, or the objects are not as the protocol requires.
        ModelFileError: The arm cannot be loaded or is not usable.
    """
    settings, learners = apply_observers(protocol, path, models, settings, changes)
    check_durations(protocol, path, settings)
    common = build_common(protocol, path, models, settings, learners)
    quantiles = {entry.quantile for entry in protocol.numbers.values()}
    paths = {}
    for index, block in enumerate(protocol.blocks):
        if block.do.reach is not None:
            key = f"blocks[{index}].do.reach.path"
            file = find_file(block.do.reach.path, key, path, models)
            paths[index] = load_path(file)
            check_start(file, "start", paths[index].start, load_arm(settings.arm))
    check_one_course(path, protocol.blocks)
    return HoldExperiment(
        **common,
        seed=seed,
        quantiles=tuple(sorted({*QUARTILES, *quantiles})),
        expects=any(entry.measure in EXPECTED for entry in protocol.numbers.values()),
        paths=paths,
    )


def build_lift_experiment(
    protocol: Protocol, path: Path, models: Path, seed: int, settings: Settings, changes: Changes = NO_CHANGES
) -> LiftExperiment:
    """Builds the experiment of a protocol of lifts in closed form.

    Raises:
        BadValueError: A file is wrong, or the closed form does not support what the protocol asks for.
        ModelFileError: The arm cannot be loaded or is not usable.
    """
    if protocol.observers.vision == FeatureSource.PIXELS.value:
        raise BadValueError(path, "observers.vision", "is 'pixels', must be 'features' of lifts in closed form")
    settings, learners = apply_observers(protocol, path, models, settings, changes)
    check_closed_form(settings)
    if settings.feature_source is not FeatureSource.FEATURES:
        raise BadValueError("--vision", "", f"is 'pixels', must be 'features' of {protocol.name}, in closed form")
    if settings.faults != NO_FAULTS:
        raise BadValueError(
            "--fault", "", f"is given, must not be of {protocol.name}, whose lifts in closed form know none"
        )
    asked = {entry.quantile for entry in protocol.numbers.values() if entry.measure is Measure.DENSITY}
    common = build_common(protocol, path, models, settings, learners)
    return LiftExperiment(**common, seed=seed, quantiles=tuple(sorted(asked)))


def build_common(
    protocol: Protocol, path: Path, models: Path, settings: Settings, learners: tuple[Learner, ...]
) -> dict[str, Any]:
    """Reads and checks everything that experiments with presented objects have in common.

    Raises:
        BadValueError: A file is wrong, or the objects are not as the protocol requires.
        ModelFileError: The arm cannot be loaded or is not usable.
    """
    objects = build_objects(protocol.objects, path, models)
    check_blocks(path, protocol.blocks, objects)
    check_tools_can_be_held(objects.path, objects.tools, settings)
    if changed := list_changed(protocol.blocks, objects):
        check_tools_can_be_held(path, changed, settings)
    return {
        "name": protocol.name,
        "section": path,
        "objects": objects,
        "blocks": tuple(protocol.blocks),
        "learners": learners,
        "told": list_told(protocol, path, objects, learners),
        "models": models,
        "settings": settings,
        "report": protocol.build_report(path),
        "numbers": protocol.numbers,
        "figures": protocol.figures,
        "people": load_people(protocol, path, models, objects),
    }


def load_people(protocol: Protocol, path: Path, models: Path, objects: ProtocolObjects) -> People:
    """Loads people's results from the files that a protocol names.

    Raises:
        BadValueError: A file is missing or wrong, or has numbers or objects that the protocol lacks.
    """
    table = lifts = None
    if protocol.published is not None:
        table = load_published(find_file(protocol.published, "published", path, models))
        check_table(table, protocol.numbers)
    if protocol.people is not None:
        file = find_file(protocol.people, "people", path, models)
        lifts = load_people_lifts(file, objects, protocol.blocks)
    return People(table, lifts)


def check_one_course(path: Path, blocks: Sequence[BlockEntry]) -> None:
    """Refuses measured motions logged at different times, which no figure could compare.

    Raises:
        BadValueError: The measured blocks differ in their action, duration or path.
    """
    courses: dict[tuple[str, object], int] = {}
    for index, block in enumerate(blocks):
        action = block.do
        done = "hold" if action.hold else "clamp" if action.clamp else "reach" if action.reach else ""
        if block.measured and done:
            courses.setdefault((done, action.duration or action.reach), index)
    if len(courses) > 1:
        (first, _), (second, _) = list(courses)[:2]
        one, other = list(courses.values())[:2]
        what = f"a {second}" if first != second else f"a {second} of another course"
        problem = f"is {what} after a {first} in blocks[{one}], must be like it or not measured ('measured: false')"
        raise BadValueError(path, f"blocks[{other}].do", problem)


def build_choice_experiment(
    protocol: Protocol, path: Path, models: Path, seed: int, settings: Settings, changes: Changes = NO_CHANGES
) -> ReachExperiment | HammerExperiment:
    """Builds the experiment of a protocol of choices.

    Raises:
        BadValueError: A file is wrong, or the objects or blocks do not suit a choice.
        ModelFileError: The arm cannot be loaded or is not usable.
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
    key = f"blocks[1].do.choose.{'reach' if choice.reach else 'hammer'}"
    task_file = find_file(choice.reach or choice.hammer or "", key, path, models)
    task: Reach | Hammer = Reach(load_path(task_file)) if choice.reach else load_hammer(task_file)
    start = task.path.start if isinstance(task, Reach) else task.start
    check_start(task_file, "start" if choice.reach else "blow.start", start, load_arm(settings.arm))
    assert protocol.novel is not None  # a choice is about them
    novel = build_objects(protocol.novel, path, models, "novel")
    check_colours_known(novel, objects)
    check_tools_can_be_held(objects.path, experience.tools, settings)
    held = [gripped for tool in novel.tools for gripped in tool.list_gripped().values()]
    check_tools_can_be_held(novel.path, held, settings, start)
    files = (models, task_file, novel.path)
    names = (*files, protocol.blocks[0].name)
    common = (protocol.name, path, experience, novel.tools, *names, protocol.build_report(path))
    return ReachExperiment(*common, task) if isinstance(task, Reach) else HammerExperiment(*common, task)


def check_colours_known(novel: ProtocolObjects, objects: ProtocolObjects) -> None:
    """Refuses novel objects with a colour that no object held before has.

    Raises:
        BadValueError: A novel object has such a colour.
    """
    known = {part.looks_like.colour for tool in objects.tools for part in tool.components}
    for tool in novel.tools:
        unknown = {part.looks_like.name for part in tool.components if part.looks_like.colour not in known}
        if unknown:
            problem = f"looks like {', '.join(sorted(unknown))}, must look like what {objects.path.name} is made of"
            raise BadValueError(novel.path, f"tools: {tool.name}", problem)
