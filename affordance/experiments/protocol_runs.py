"""Protocols as experiments, by name or path: loaded, and rehearsed on made-up measurements before anything runs."""

from pathlib import Path

from affordance.experiments.definition import Experiment
from affordance.experiments.hammer.experiment import HammerExperiment
from affordance.experiments.holding import HoldExperiment
from affordance.experiments.lifting import LiftExperiment
from affordance.experiments.protocol_building import (
    build_choice_experiment,
    build_hold_experiment,
    build_lift_experiment,
)
from affordance.experiments.reach import ReachExperiment
from affordance.experiments.rehearsal import check_number_names, rehearse_claims, rehearse_experiment
from affordance.experiments.shared.presented import PresentedExperiment
from affordance.experiments.shared.report_names import (
    EVENTS,
    FACTS,
    OF_CHOICES,
    OF_LIFTS,
    OF_SECOND_TOOL,
    list_number_names,
)
from affordance.files.model_folder import MODELS
from affordance.named_settings import NO_CHANGES, Changes
from affordance.protocols.protocol import Protocol, check_folder_is_free, find_protocol, load_protocol
from affordance.reporting.plain_report import check_names
from affordance.settings import DEFAULT_SETTINGS, Settings

type ProtocolExperiment = HoldExperiment | LiftExperiment | ReachExperiment | HammerExperiment


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
    if isinstance(experiment, PresentedExperiment):
        check_number_names(experiment, list_given(experiment))
    check_names(experiment.report, list_names(experiment))
    if isinstance(experiment, PresentedExperiment):
        rehearse_claims(experiment, rehearse_experiment(experiment))
    return experiment


def build_experiment(
    protocol: Protocol,
    path: Path,
    models: Path,
    seed: int,
    settings: Settings,
    changes: Changes = NO_CHANGES,
) -> ProtocolExperiment:
    """Builds the experiment of a protocol; see ``load_protocol_experiment``."""
    if protocol.is_closed_form:
        return build_lift_experiment(protocol, path, models, seed, settings, changes)
    if protocol.has_choices:
        return build_choice_experiment(protocol, path, models, seed, settings, changes)
    return build_hold_experiment(protocol, path, models, seed, settings, changes)


def load_hold_experiment(
    name: str, models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS
) -> HoldExperiment:
    """Loads a protocol with simulated presentations; see ``load_protocol_experiment``."""
    path = find_protocol(name, models)
    return build_hold_experiment(load_protocol(path), path, models, seed, settings)


def load_choice_experiment(
    name: str, models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS
) -> ReachExperiment | HammerExperiment:
    """Loads a protocol of choices; see ``load_protocol_experiment``."""
    path = find_protocol(name, models)
    return build_choice_experiment(load_protocol(path), path, models, seed, settings)


def list_names(experiment: ProtocolExperiment) -> frozenset[str]:
    """Lists the numbers and facts that the report of a protocol may name."""
    numbers = list_number_names(experiment.numbers) if isinstance(experiment, PresentedExperiment) else ()
    return list_given(experiment) | {*numbers}


def list_given(experiment: ProtocolExperiment) -> frozenset[str]:
    """Lists the numbers and facts that every protocol of this type has, whatever numbers it defines itself."""
    if isinstance(experiment, ReachExperiment | HammerExperiment):
        second = (*OF_SECOND_TOOL, *experiment.names_of_second_tool) if len(experiment.novel) > 1 else ()
        return frozenset({*FACTS, *EVENTS, *OF_CHOICES, *experiment.names_of_task, *second})
    if isinstance(experiment, LiftExperiment):
        return frozenset({*FACTS, *OF_LIFTS})
    events = EVENTS if experiment.experience is not None else ()
    learners = {"learners"} if len(experiment.learners) > 1 else set()
    people = {"people"} if any(experiment.people) else set()
    return frozenset({*FACTS, *events, *experiment.list_facts(None, {})} | learners | people)
