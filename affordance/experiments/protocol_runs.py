"""Protocols as experiments, by name or path: loaded, and rehearsed on made-up measurements before anything runs."""

from collections.abc import Mapping
from pathlib import Path

from affordance.experiments.definition import Experiment
from affordance.experiments.protocol_building import build_experiment
from affordance.experiments.rehearsal import check_number_names, rehearse_claims, rehearse_experiment
from affordance.experiments.shared.choosing import ChoiceExperiment
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.files.model_folder import MODELS
from affordance.named_settings import NO_CHANGES, Changes
from affordance.protocols.number_entries import OF_OBJECTS, Measure, NumberEntry
from affordance.protocols.protocol import check_folder_is_free, find_protocol, load_protocol
from affordance.reporting.plain_report import check_names
from affordance.settings import DEFAULT_SETTINGS, Settings

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

    Raises:
        BadValueError: A file is wrong, or the objects are not as the protocol requires.
        ModelFileError: The arm cannot be loaded or is not usable.
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


def list_number_names(entries: Mapping[str, NumberEntry]) -> list[str]:
    """Lists the names of a protocol's numbers and of their intervals."""
    with_interval = [
        name
        for name, entry in entries.items()
        if entry.interval and entry.measure not in OF_OBJECTS and entry.measure is not Measure.DENSITIES
    ]
    return [*entries, *(f"{name}_ci95" for name in with_interval)]


def list_names(experiment: ProtocolExperiment) -> frozenset[str]:
    """Lists the numbers and facts that the report of a protocol may name."""
    numbers = list_number_names(experiment.numbers) if isinstance(experiment, PresentationExperiment) else ()
    return list_given(experiment) | {*numbers}


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
