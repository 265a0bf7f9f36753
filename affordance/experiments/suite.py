"""The experiments there are, and running some of them into one folder."""

import importlib
import logging
import os
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from affordance.arguments import JOBS, REPEATS, StrPath, check_kind, check_path, check_seed, check_whole
from affordance.exceptions import AffordanceError, InfeasibleError, SeeingError
from affordance.experiments.agreement import compare_tasks
from affordance.experiments.definition import Experiment
from affordance.experiments.runner import run_experiment
from affordance.experiments.shared.checks import check_stuck_joint
from affordance.experiments.vision_comparison import compare_feature_sources
from affordance.files.atomic import remove_leftovers
from affordance.files.clone import import_study
from affordance.files.model_folder import MODELS
from affordance.named_settings import NO_CHANGES, Changes, change_settings
from affordance.plant.arm import ARM, load_arm
from affordance.proprioception.faults import load_faults
from affordance.reporting.report import note_left_out, remove_section, write_report
from affordance.robots.lacks import read_lacks
from affordance.runs.cluster import use_cluster
from affordance.runs.repeats import check_folder, end_processes, prepare_folder
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.pixels.failed_frames import save_frame

_LOG = logging.getLogger(__name__)

# Those of `affordance run all`, in order; all but the last are protocols that come with the models.
EXPERIMENTS = ("weight", "com", "reach", "hammer", "vision")
# Observers that are simulated unless another number is asked for.
DEFAULT_REPEATS = 200
# The study of vision, which is of "all".
_VISION = "studies.seeing.experiment"
# Tasks that an experiment needs; one that the import of an arm could not fit is not planned again.
_NEEDS = {"weight": ("objects",), "com": ("objects",), "reach": ("objects", "path"), "hammer": ("objects", "blow")}


class SuiteResult(NamedTuple):
    """What became of the experiments that were asked for.

    Attributes:
        report: The report's path.
        left_out: Why an experiment could not be done, by its name.
    """

    report: Path
    left_out: dict[str, str]


def load_experiment(
    name: StrPath,
    models: StrPath = MODELS,
    seed: int = 0,
    settings: Settings = DEFAULT_SETTINGS,
    changes: Changes = NO_CHANGES,
) -> Experiment:
    """Loads the study of vision, or a protocol by its name or path; imported here, as vision takes long.

    Args:
        name: Name of an experiment, or name or path of a protocol.
        models: Folder with arm, materials and tools.
        seed: Root of every random draw.
        settings: Settings that all simulations share; a protocol may change them.
        changes: Settings by name, which come after those of the protocol.

    Raises:
        BadValueError: A file or a setting is wrong, or the objects do not make the experiment.
        ModelFileError: The arm cannot be loaded or is not fit.
    """
    name, models = str(check_path("name", name)), check_path("models", models)
    (seed,) = check_seed(check_kind("seed", seed, int))
    check_kind("settings", settings, Settings)
    if name != "vision":
        protocols: Any = importlib.import_module("affordance.experiments.protocol_runs")
        found: Experiment = protocols.load_protocol_experiment(name, models, seed, settings, changes)
        return found
    experiment: Experiment = import_study(_VISION).load(models, seed, change_settings(settings, changes))
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
) -> SuiteResult:
    """Runs experiments and writes the report of all that the folder holds.

    Of several experiments, those that cannot be done are left out: the log and the report name them.

    Args:
        names: Names of EXPERIMENTS, names or paths of protocols, or experiments; a name may stand alone.
        out: Folder for the results; each experiment has a subfolder of its name.
        models: Folder with arm, materials and tools.
        seed: Root of every random draw, at least 0.
        repeats: Simulated observers, of robustness settings, at least 1.
        jobs: Processes, at least 1; ignored with a cluster.
        faults: Names of what is to be wrong, from faults.yaml of the models.
        cluster: Address of a Dask scheduler that the repeats go to; None for processes of this machine.
        changes: Settings that are not as they are by default, by name: ``{"learner": "kinds_map"}``.

    Raises:
        BadValueError: A file of the models is wrong, the folder cannot be written to, or the cluster is not fit;
            nothing was written.
        ModelFileError: The arm cannot be loaded or is not fit; nothing was written.
        SeeingError: A picture does not show what is needed; it was saved in OUT/frames.
        AffordanceError: No experiment can be done; it says why the first of them cannot.
    """
    names = [names] if isinstance(names, str | Path) else list(names)
    out, models = check_path("out", out), check_path("models", models)
    repeats, jobs = check_whole("repeats", repeats, REPEATS), check_whole("jobs", jobs, JOBS)
    check_folder(out)  # before plans are made, which takes minutes
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
    except SeeingError as error:
        raise save_frame(error, prepare_folder(out) / "frames", type(error).__name__) from error
    for name in attempts.left_out:
        remove_section(out / name)  # of another run, perhaps with other models
    note_left_out(out, attempts.left_out, done=[experiment.name for experiment, _ in planned])
    compare_feature_sources(out)
    compare_tasks(out)
    return SuiteResult(write_report(out), attempts.left_out)


def _find_name(name: StrPath | Experiment) -> str:
    return Path(name).stem if isinstance(name, str | os.PathLike) else name.name


def _load_fitted(name: str | Experiment, models: Path, seed: int, settings: Settings, changes: Changes) -> Experiment:
    """Loads an experiment unless the import of the arm has found that it cannot be done.

    Raises:
        InfeasibleError: It has, or an object is too heavy.
    """
    if not isinstance(name, str | os.PathLike):
        return name
    lacks = read_lacks(models)
    for need in _NEEDS.get(name, ()):
        if need in lacks:
            raise InfeasibleError(
                models / ARM.name, need, f"cannot be done by this arm, as its import found: {lacks[need]}"
            )
    experiment = load_experiment(name, models, seed, settings, changes)
    check_stuck_joint(experiment.settings)
    return experiment


class _Attempts:
    """Keeps what goes wrong with some of several experiments, so that the others can be done.

    Attributes:
        left_out: Why an experiment cannot be done, by its name.
    """

    def __init__(self, number: int) -> None:
        """Takes how many experiments there are."""
        self.left_out: dict[str, str] = {}
        self._number = number
        self._first: AffordanceError | None = None

    def make[T](
        self, name: str, make: Callable[[], T], expected: type[AffordanceError] = AffordanceError
    ) -> tuple[T, ...]:
        """Makes something of an experiment.

        Args:
            name: Name of the experiment.
            make: Makes it.
            expected: Errors by which the experiment is left out; pictures that cannot be used are none of them.

        Returns: What was made; nothing if the experiment is left out.

        Raises:
            AffordanceError: Another error, or the first one if it leaves no experiment.
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
