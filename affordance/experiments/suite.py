"""Catalogue of the experiments, and runs of several of them into one folder."""

import importlib
import logging
import os
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from affordance.arguments import JOBS, REPEATS, check_kind, check_seed, check_whole
from affordance.exceptions import AffordanceError, InfeasibleError, SeeingError
from affordance.experiments.definition import Experiment
from affordance.experiments.runner import run_experiment
from affordance.files.atomic import remove_leftovers
from affordance.files.constraints import StrPath, check_path
from affordance.files.model_folder import MODELS, import_study
from affordance.named_settings import NO_CHANGES, Changes, change_settings
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.proprioception.faults import load_faults
from affordance.reporting.report import note_left_out, remove_section, write_report
from affordance.robots.changes import read_lacks
from affordance.runs.cluster import use_cluster
from affordance.runs.repeats import check_folder, end_processes, prepare_folder
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.pixels.rgbd import save_frame

_LOG = logging.getLogger(__name__)

# Experiments of `affordance run all`, in order: protocols that come with the models, and last a study.
EXPERIMENTS = ("weight", "com", "reach", "hammer", "vision")
# Number of simulated observers unless another is given.
DEFAULT_REPEATS = 200
# Sections that compare finished runs (studies/side_by_side): a new run makes them stale.
_COMPARISONS = ("agreement", "vision_comparison")
# Tasks that an experiment needs; if the import of an arm could not fit one, the experiment is not planned.
_NEEDS = {"weight": ("objects",), "com": ("objects",), "reach": ("objects", "path"), "hammer": ("objects", "blow")}


class SuiteResult(NamedTuple):
    """Report of several experiments, and the reasons why some of them could not be done, by name."""

    report: Path
    left_out: dict[str, str]


def load_experiment(
    name: StrPath,
    models: StrPath = MODELS,
    seed: int = 0,
    settings: Settings = DEFAULT_SETTINGS,
    changes: Changes = NO_CHANGES,
) -> Experiment:
    """Loads the study of vision, or a protocol by its name or path.

    Args:
        name: Name of an experiment, or name or path of a protocol.
        models: Folder with arm, materials and tools.
        seed: Root of every random draw.
        settings: Settings of all simulations; a protocol may change them.
        changes: Settings by name, applied after those of the protocol.

    Raises:
        BadValueError: A file or a setting is wrong, or the objects do not make the experiment.
        ModelFileError: The arm cannot be loaded or is not usable.
    """
    name, models = str(check_path("name", name)), check_path("models", models)
    (seed,) = check_seed(check_kind("seed", seed, int))
    check_kind("settings", settings, Settings)
    if name != "vision":
        protocols: Any = importlib.import_module("affordance.experiments.protocol_runs")
        found: Experiment = protocols.load_protocol_experiment(name, models, seed, settings, changes)
        return found
    experiment: Experiment = import_study(name).load(models, seed, change_settings(settings, changes))
    return experiment


def run_suite(
    names: Sequence[str | Experiment],
    out: StrPath,
    *,
    models: StrPath = MODELS,
    seed: int = 0,
    repeats: int = DEFAULT_REPEATS,
    jobs: int = 1,
    faults: Sequence[str] = (),
    cluster: str | None = None,
    changes: Changes = NO_CHANGES,
    announce: Callable[[Path], None] | None = None,
) -> SuiteResult:
    """Runs experiments and writes the report of all that the folder holds.

    If several experiments are run, those that cannot be done are left out and named in the log and the report.

    Args:
        names: Names of EXPERIMENTS, names or paths of protocols, or experiments; one may be given as a string.
        out: Folder for the results; each experiment has a subfolder of its name.
        models: Folder with arm, materials and tools.
        seed: Root of every random draw, at least 0.
        repeats: Number of simulated observers, or of robustness settings, at least 1.
        jobs: Number of processes, at least 1; ignored with a cluster.
        faults: Names of the faults to switch on, from faults.yaml of the models.
        cluster: Address of a Dask scheduler that runs the repeats; None for processes of this machine.
        changes: Settings that differ from their defaults, by name: ``{"learner": "kinds_map"}``.
        announce: Function that is given the report after the first of several experiments, which then grows.

    Raises:
        BadValueError: A file of the models is wrong, the folder cannot be written to, or the cluster is not usable;
            nothing was written.
        ModelFileError: The arm cannot be loaded or is not usable; nothing was written.
        SeeingError: The features cannot be extracted from a picture; it was saved in OUT/frames.
        AffordanceError: No experiment can be done; the message gives the reason for the first.
    """
    names = [names] if isinstance(names, str | Path) else list(names)
    out, models = check_path("out", out), check_path("models", models)
    repeats, jobs = check_whole("repeats", repeats, REPEATS), check_whole("jobs", jobs, JOBS)
    check_folder(out)  # before planning, which takes minutes
    settings = Settings(arm=models / ARM.name)
    if faults:
        joint_names = load_arm(settings.arm).joint_names
        settings = replace(settings, faults=load_faults(models / "faults.yaml", faults, joint_names))
    attempts = _Attempts(len(names))
    experiments = [
        experiment
        for name in names
        for experiment in attempts.make(
            _find_name(name), partial(_load_fitted, name, models, seed, settings, changes), InfeasibleError
        )
    ]
    for experiment in experiments:
        experiment.check_repeats(repeats)
    try:
        with use_cluster(cluster, models) if cluster is not None else nullcontext():
            planned = [
                (experiment, plan)
                for experiment in experiments
                for plan in attempts.make(experiment.name, partial(experiment.plan, jobs))
            ]
            prepare_folder(out)
            folders = [prepare_folder(out / experiment.name) for experiment, _ in planned]
            remove_leftovers(out)
            for (experiment, plan), folder in zip(planned, folders, strict=True):
                run = partial(run_experiment, experiment, plan, folder, repeats=repeats, jobs=jobs)
                attempts.make(experiment.name, run)
                end_processes()
                if len(planned) > 1:
                    report = write_report(out)
                    if announce is not None and experiment is planned[0][0]:
                        announce(report)
    except SeeingError as error:
        raise save_frame(error, prepare_folder(out) / "frames", type(error).__name__) from error
    for name in (*attempts.left_out, *_COMPARISONS):
        remove_section(out / name)  # from another run, perhaps with other models
    note_left_out(out, attempts.left_out, done=[experiment.name for experiment, _ in planned])
    return SuiteResult(write_report(out), attempts.left_out)


def _find_name(name: StrPath | Experiment) -> str:
    return Path(name).stem if isinstance(name, str | os.PathLike) else name.name


def _load_fitted(name: str | Experiment, models: Path, seed: int, settings: Settings, changes: Changes) -> Experiment:
    """Loads an experiment unless the import of the arm has found that it cannot be done."""
    if not isinstance(name, str | os.PathLike):
        return name
    lacks = read_lacks(models)
    for need in _NEEDS.get(name, ()):
        if need in lacks:
            raise InfeasibleError(
                models / ARM.name, need, f"cannot be done by this arm, as its import found: {lacks[need]}"
            )
    experiment = load_experiment(name, models, seed, settings, changes)
    if experiment.settings.faults.stuck_joint:  # which the arm must have
        experiment.settings.faults.find_stuck(load_arm(experiment.settings.arm).joint_names)
    return experiment


class _Attempts:
    """Collects the errors of some of several experiments, by name, so that the others can be done."""

    def __init__(self, number: int) -> None:
        """Sets the number of experiments."""
        self.left_out: dict[str, str] = {}
        self._number = number
        self._first: AffordanceError | None = None

    def make[T](
        self, name: str, make: Callable[[], T], expected: type[AffordanceError] = AffordanceError
    ) -> tuple[T, ...]:
        """Returns a function's result for an experiment in a tuple, empty if an expected error leaves it out.

        An unexpected error, a SeeingError, or the first error if no experiment is left is raised.
        """
        try:
            return (make(),)
        except SeeingError:
            raise
        except expected as error:
            self._first = self._first or error
            self.left_out[name] = str(error)
            if len(self.left_out) == self._number:
                raise self._first from None
            _LOG.warning("%s is left out: %s", name, error)
            return ()
