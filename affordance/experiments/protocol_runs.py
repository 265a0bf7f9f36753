"""Protocols as experiments, by name or path: loaded, and rehearsed on made-up measurements before anything runs."""

from pathlib import Path

from affordance.belief.learner import Learner
from affordance.choice.hammer import Hammer, load_hammer
from affordance.choice.reach import Reach
from affordance.control.start_posture import check_start
from affordance.control.timed_path import load_path
from affordance.exceptions import BadValueError
from affordance.experiments.chosen_holds import build_chooser
from affordance.experiments.closed_form import ClosedForm
from affordance.experiments.definition import Experiment
from affordance.experiments.hammer import Hammering
from affordance.experiments.protocol_parts import (
    Told,
    apply_observers,
    check_colours_known,
    check_durations,
    check_logs,
    check_one_course,
    check_several_grips,
    check_suits_closed_form,
    check_tools_can_be_held,
    list_told,
    load_paths,
    load_people,
)
from affordance.experiments.reach import Reaching
from affordance.experiments.rehearsal import check_number_names, rehearse_claims, rehearse_experiment
from affordance.experiments.shared.choice_task import ChoiceTask
from affordance.experiments.shared.choosing import ChoiceExperiment
from affordance.experiments.shared.experience import build_experience
from affordance.experiments.shared.hold_measures import EXPECTED
from affordance.experiments.shared.presented import QUARTILES, Means, PresentationExperiment
from affordance.experiments.shared.protocol_figures import draw_figures
from affordance.experiments.simulated import Simulated
from affordance.files.model_folder import MODELS
from affordance.named_settings import NO_CHANGES, Changes
from affordance.plant.load import load_arm
from affordance.protocols.number_entries import OF_OBJECTS, Measure
from affordance.protocols.object_entries import ProtocolObjects, build_objects, find_file
from affordance.protocols.presentations import check_blocks, list_changed
from affordance.protocols.protocol import Protocol, check_folder_is_free, find_protocol, load_protocol
from affordance.reporting.section import check_names
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.features import FeatureSource

# Facts of every experiment.
FACTS = ("repeats", "seed", "camera_caption", "faults", "few_observers")
# Numbers of experience that protocols share.
EVENTS = ("samples_rejected", "trials_outlier")
# Numbers and facts of every choice, and those that a second tool adds.
OF_CHOICES = (
    *("p_correct", "p_correct_ci95", "p_correct_bayes", "p_correct_bayes_ci95", "effort_flips", "correct_grip"),
    *("energy_ratio_true", "tools", "off_axis_2mm_change", "density_true", "energy_true", "effort_true"),
    *("periods_limited", "first", "others", "materials", "num_trials", "least_effort_grip"),
)
OF_SECOND_TOOL = (
    *("p_correct_headed_tool", "p_correct_headed_tool_ci95"),
    *("correct_grip_headed_tool", "energy_true_headed_tool"),
)

type ProtocolExperiment = PresentationExperiment | ChoiceExperiment


def load_protocol_experiment(
    name: str,
    models: Path = MODELS,
    seed: int = 0,
    settings: Settings = DEFAULT_SETTINGS,
    changes: Changes = NO_CHANGES,
) -> Experiment:
    """Loads a protocol by its name or path; changes are settings by name, applied after those of the protocol.

    A wrong file, or objects that do not meet the requirements, raise a BadValueError, an unusable arm a
    ModelFileError.
    """
    path = find_protocol(name, models)
    protocol = load_protocol(path)
    check_folder_is_free(protocol.name, path, models)
    experiment = build_experiment(protocol, path, models, seed, settings, changes)
    if isinstance(experiment, PresentationExperiment):
        check_number_names(experiment, list_given(experiment))
    check_names(experiment.report, list_names(experiment))
    if isinstance(experiment, PresentationExperiment):
        rehearse_claims(experiment, rehearse_experiment(experiment))
    return experiment


def load_hold_experiment(
    name: str, models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS
) -> PresentationExperiment:
    """Loads a protocol of presentations without its rehearsal; see ``load_protocol_experiment``."""
    path = find_protocol(name, models)
    experiment = build_experiment(load_protocol(path), path, models, seed, settings)
    assert isinstance(experiment, PresentationExperiment)  # or it were one of choices
    return experiment


def load_choice_experiment(
    name: str, models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS
) -> ChoiceExperiment:
    """Loads a protocol of choices; see ``load_protocol_experiment``."""
    path = find_protocol(name, models)
    experiment = build_experiment(load_protocol(path), path, models, seed, settings)
    assert not isinstance(experiment, PresentationExperiment)  # or it had no choices
    return experiment


def build_experiment(
    protocol: Protocol, path: Path, models: Path, seed: int, settings: Settings, changes: Changes = NO_CHANGES
) -> ProtocolExperiment:
    """Builds the experiment of a protocol; see ``load_protocol_experiment``."""
    if protocol.is_closed_form and protocol.observers.vision == FeatureSource.PIXELS.value:
        raise BadValueError(path, "observers.vision", "is 'pixels', must be 'features' of lifts in closed form")
    settings, learners = apply_observers(protocol, path, models, settings, changes)
    if protocol.is_closed_form:
        check_suits_closed_form(protocol, settings)
    else:
        check_durations(protocol, path, settings)
    objects = build_objects(protocol.objects, path, models)
    check_blocks(path, protocol.blocks, objects)
    told = list_told(protocol, path, objects, learners)
    build = build_choices if protocol.has_choices else build_presentations
    return build(protocol, path, models, objects, learners, told, seed, settings)


def build_presentations(
    protocol: Protocol,
    path: Path,
    models: Path,
    objects: ProtocolObjects,
    learners: tuple[Learner, ...],
    told: Told,
    seed: int,
    settings: Settings,
) -> PresentationExperiment:
    """Builds the experiment of a protocol of presentations; see ``build_experiment``."""
    check_tools_can_be_held(objects.path, objects.tools, settings)
    if changed := list_changed(protocol.blocks, objects):
        check_tools_can_be_held(path, changed, settings)
    numbers = protocol.numbers.values()
    if protocol.is_closed_form:
        means: Means = ClosedForm()
        quantiles = {entry.quantile for entry in numbers if entry.measure is Measure.DENSITY}
    else:
        paths = load_paths(protocol, path, models, settings)
        check_logs(path, protocol.blocks, objects, paths, settings)
        check_one_course(path, protocol.blocks)
        chooser = None
        if protocol.novel is not None:  # whose tasks decide what is held
            novel = build_objects(protocol.novel, path, models, "novel")
            chooser = build_chooser(path, protocol.blocks, novel, objects, models)
        means = Simulated(any(entry.measure in EXPECTED for entry in numbers), paths, chooser)
        quantiles = {*QUARTILES, *(entry.quantile for entry in numbers)}
    return PresentationExperiment(
        protocol.name,
        path,
        objects,
        tuple(protocol.blocks),
        learners,
        told,
        models,
        seed,
        settings,
        tuple(sorted(quantiles)),
        means,
        protocol.build_report(path),
        protocol.numbers,
        protocol.figures,
        load_people(protocol, path, models, objects),
        draw_figures,
    )


def build_choices(
    protocol: Protocol,
    path: Path,
    models: Path,
    objects: ProtocolObjects,
    learners: tuple[Learner, ...],
    told: Told,
    seed: int,
    settings: Settings,
) -> ChoiceExperiment:
    """Builds the experiment of a protocol of choices; see ``build_experiment``."""
    *_, last = protocol.blocks
    experience = build_experience(protocol.blocks[0], objects, learners, told, seed, settings)
    if len(protocol.blocks) != 2 or last.do.choose is None or not last.ask_after_each or experience is None:
        problem = "must be two: shuffled holds that teach and are not measured, and a choice with ask_after_each"
        raise BadValueError(path, "blocks", problem)
    choice = last.do.choose
    key = f"blocks[1].do.choose.{'reach' if choice.reach else 'hammer'}"
    task_file = find_file(choice.reach or choice.hammer or "", key, path, models)
    task: Reach | Hammer = Reach(load_path(task_file)) if choice.reach else load_hammer(task_file)
    adapter: ChoiceTask = Reaching(task) if isinstance(task, Reach) else Hammering(task)
    start = task.path.start if isinstance(task, Reach) else task.start
    check_start(task_file, "start" if choice.reach else "blow.start", start, load_arm(settings.arm))
    assert protocol.novel is not None  # a choice is about them
    novel = build_objects(protocol.novel, path, models, "novel")
    check_colours_known(novel, objects)
    check_tools_can_be_held(objects.path, experience.tools, settings)
    check_several_grips(novel)
    held = [gripped for tool in novel.tools for gripped in tool.list_gripped().values()]
    check_tools_can_be_held(novel.path, held, settings, start)
    return ChoiceExperiment(
        protocol.name,
        path,
        experience,
        novel.tools,
        models,
        task_file,
        novel.path,
        protocol.blocks[0].name,
        protocol.build_report(path),
        adapter,
    )


def list_names(experiment: ProtocolExperiment) -> frozenset[str]:
    """Lists the numbers, with their intervals, and facts that the report of a protocol may name."""
    numbers = experiment.numbers if isinstance(experiment, PresentationExperiment) else {}
    intervals = {
        f"{name}_ci95"
        for name, entry in numbers.items()
        if entry.interval and entry.measure not in (*OF_OBJECTS, Measure.DENSITIES)
    }
    return list_given(experiment) | {*numbers} | intervals


def list_given(experiment: ProtocolExperiment) -> frozenset[str]:
    """Lists the numbers and facts that every protocol of this type has, whatever numbers it defines itself."""
    if not isinstance(experiment, PresentationExperiment):
        second = (*OF_SECOND_TOOL, *experiment.adapter.names_of_second_tool) if len(experiment.novel) > 1 else ()
        return frozenset({*FACTS, *EVENTS, *OF_CHOICES, *experiment.adapter.names, *second})
    every = experiment.means.is_closed_form
    given = {
        *FACTS,
        *experiment.list_facts(None, {}),
        *(EVENTS if experiment.experience is not None else ()),
        *(["learners"] if every or len(experiment.learners) > 1 else []),
        *(["people"] if every or any(experiment.people) else []),
        *(["kappa"] if every else []),
    }
    return frozenset(given)
