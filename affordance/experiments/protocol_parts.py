"""Parts of the experiment of a protocol: observers, objects, paths and people, read from its files and checked."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from affordance.belief.learner import Learner
from affordance.control.start_posture import Start, check_start
from affordance.control.timed_path import TimedPath, load_path
from affordance.exceptions import (
    BadArgumentError,
    BadValueError,
    InfeasibleError,
    ModelFileError,
    describe_choice,
)
from affordance.named_settings import NO_CHANGES, Changes, change_settings
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.arm import Arm
from affordance.plant.load import load_arm, parse_arm
from affordance.proprioception.faults import NO_FAULTS
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.torque_noise import WeberNoise
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.object_entries import ProtocolObjects, find_file
from affordance.protocols.people import People, check_table
from affordance.protocols.people_tables import load_people_lifts, load_published
from affordance.protocols.presentations import count_presentations
from affordance.protocols.protocol import Protocol
from affordance.settings import Settings
from affordance.simulation.static_lifts import check_closed_form
from affordance.simulation.trial import check_duration
from affordance.vision.features import FeatureSource

type Told = tuple[tuple[Colour, float], ...]

# Settings that have a key of their own in ``observers``.
# Most rows of the logs of an observer's motions, of some 600 bytes each.
_MOST_ROWS = 2_000_000
_OWN_WORDS = {"learners": "learner", "vision": "feature_source", "noise": "noise"}


def apply_observers(
    protocol: Protocol, path: Path, models: Path, settings: Settings, changes: Changes = NO_CHANGES
) -> tuple[Settings, tuple[Learner, ...]]:
    """Returns the settings with the arm, noise and vision that a protocol asks for, and its learners.

    The protocol's ``settings`` are applied first, changes that a user asks for last. One that is wrong, or given
    twice, raises a BadValueError.
    """
    observers = protocol.observers
    named = [*protocol.settings, *changes]
    for own, name in _OWN_WORDS.items():
        if getattr(observers, own) is not None and any(each.partition(".")[0] == name for each in named):
            problem = f"is given with observers.{own}, only one of them may be"
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


def list_told(protocol: Protocol, path: Path, objects: ProtocolObjects, learners: Sequence[Learner]) -> Told:
    """Lists densities known from the start, by colour, [kg/m^3]; learners by kinds raise a BadValueError."""
    materials = {part.material.name: part.material for tool in objects.tools for part in tool.components}
    for index, name in enumerate(protocol.observers.told):
        if name not in materials:
            raise BadValueError(path, f"observers.told[{index}]", describe_choice(name, materials))
        if tuple(learners) != (Learner.DENSITY,):
            raise BadValueError(path, "observers.told", "is given, must be omitted where observers learn by kinds")
    return tuple((materials[name].colour, materials[name].density) for name in protocol.observers.told)


def check_suits_closed_form(protocol: Protocol, settings: Settings) -> None:
    """Raises a BadValueError for a setting that the closed form does not support."""
    check_closed_form(settings)
    if settings.feature_source is not FeatureSource.FEATURES:
        raise BadValueError("--vision", "", f"is 'pixels', must be 'features' of {protocol.name}, in closed form")
    if settings.faults != NO_FAULTS:
        problem = f"is given, must be omitted for {protocol.name}, whose lifts in closed form support none"
        raise BadValueError("--fault", "", problem)


def load_paths(protocol: Protocol, path: Path, models: Path, settings: Settings) -> Mapping[int, TimedPath]:
    """Loads the paths of reaches, by the index of their block; a wrong path or start raises a BadValueError."""
    paths = {}
    for index, block in enumerate(protocol.blocks):
        if block.do.reach is not None:
            file = find_file(block.do.reach.path, f"blocks[{index}].do.reach.path", path, models)
            paths[index] = load_path(file)
            check_start(file, "start", paths[index].start, load_arm(settings.arm))
            try:
                check_duration(paths[index].duration, settings)
            except BadArgumentError as error:
                raise BadValueError(file, "duration", error.problem) from error
    return paths


def check_logs(
    path: Path,
    blocks: Sequence[BlockEntry],
    objects: ProtocolObjects,
    paths: Mapping[int, TimedPath],
    settings: Settings,
) -> None:
    """Raises a BadValueError if an observer's motions would take too much memory: their logs are kept to its end."""
    seconds = sum(
        count_presentations(block, objects.groups) * (paths[i].duration if i in paths else block.do.duration)
        for i, block in enumerate(blocks)
    )
    most = _MOST_ROWS * settings.log_period
    if seconds > most:
        problem = f"hold objects for {seconds:g} s in all, must for at most {most:g} s at a log_period of"
        problem = f"{problem} {settings.log_period:g} s"
        raise BadValueError(path, "blocks", problem)


def load_people(protocol: Protocol, path: Path, models: Path, objects: ProtocolObjects) -> People:
    """Loads people's results from the files that a protocol names, and checks that they are of the protocol."""
    table = lifts = None
    if protocol.published is not None:
        table = load_published(find_file(protocol.published, "published", path, models))
        check_table(table, protocol.numbers)
    if protocol.people is not None:
        file = find_file(protocol.people, "people", path, models)
        lifts = load_people_lifts(file, objects, protocol.blocks)
    return People(table, lifts)


def check_one_course(path: Path, blocks: Sequence[BlockEntry]) -> None:
    """Raises a BadValueError if measured motions are of different courses, which no figure could compare."""
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
        problem = f"is {what} after a {first} in blocks[{one}], must be the same or not measured ('measured: false')"
        raise BadValueError(path, f"blocks[{other}].do", problem)


def check_colours_known(novel: ProtocolObjects, objects: ProtocolObjects) -> None:
    """Raises a BadValueError for a novel object with a colour that no object held before has."""
    known = {part.looks_like.colour for tool in objects.tools for part in tool.components}
    for tool in novel.tools:
        unknown = {part.looks_like.name for part in tool.components if part.looks_like.colour not in known}
        if unknown:
            problem = f"looks like {', '.join(sorted(unknown))}, must look like what {objects.path.name} is made of"
            raise BadValueError(novel.path, f"tools: {tool.name}", problem)


def check_several_grips(novel: ProtocolObjects) -> None:
    """Raises a BadValueError for a novel object with fewer than two grips, of which nothing could be chosen."""
    for tool in novel.tools:
        if len(tool.grips) < 2:
            problem = f"has {len(tool.grips)} entries, must have at least 2 to choose from"
            raise BadValueError(novel.path, f"tools: {tool.name}.grips", problem)


def check_durations(protocol: Protocol, path: Path, settings: Settings) -> None:
    """Raises a BadValueError for a presentation that ends before the first sample: nothing would be measured."""
    for index, block in enumerate(protocol.blocks):
        if block.do.duration:
            try:
                check_duration(block.do.duration, settings)
            except BadArgumentError as error:
                raise BadValueError(path, f"blocks[{index}].do.duration", error.problem) from error


def check_tools_can_be_held(path: Path, tools: Sequence[Tool], settings: Settings, start: Start = ()) -> None:
    """Checks the static torque of every joint, in the start posture of a task or at home, against its limit.

    A tool that is too heavy for a joint raises an InfeasibleError, an arm that cannot be loaded or cannot hold itself
    a ModelFileError, and a posture out of its reach an AffordanceError.
    """
    arm = load_arm(settings.arm)
    _load_shapes(arm, settings.arm)
    hold = StaticHold(arm, arm.find_posture(dict(start)))
    posture = "start" if start else "home"
    for tool in tools:
        # Otherwise the arm's own weight, in wrong units perhaps, would be blamed on the tool.
        for joint, torque, bound in arm.find_overloads(hold.tau_arm):
            problem = f"loads {joint} with {torque:.3g} N m in the {posture} posture with an empty hand"
            raise ModelFileError(settings.arm, f"{problem}, must be at most {bound:.3g} N m")
        overloads = arm.find_overloads(hold.tau_arm + hold.Y @ tool.parameters)
        if overloads:
            joint, torque, bound = max(overloads, key=lambda each: each.torque / each.bound)
            problem = f"weighs {tool.mass:.3g} kg and loads {joint} with {torque:.3g} N m in the {posture} posture"
            raise InfeasibleError(path, f"tools: {tool.name}", f"{problem}, must be at most {bound:.3g} N m")


@lru_cache(maxsize=16)
def _load_shapes(arm: Arm, directives: Path) -> None:
    """Loads an arm's shapes too, once per version of its files; else their ModelFileError appears in replays only."""
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    parse_arm(plant, directives)
