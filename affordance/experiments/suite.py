"""Catalogue of the experiments, and runs of several of them into one folder."""

import importlib
import logging
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, Protocol

from affordance.exceptions import AffordanceError, BadValueError, InfeasibleError, SeeingError, describe_choice
from affordance.experiments.observers import Setup
from affordance.experiments.prediction import ObserverNumbers
from affordance.experiments.results import Results, write_results
from affordance.files.atomic import remove_leftovers
from affordance.plant.load import load_arm
from affordance.reporting.report import note_left_out, remove_section, write_report
from affordance.robots.changes import read_lacks
from affordance.runs.cluster import use_cluster
from affordance.runs.commit import find_commit
from affordance.runs.repeats import check_folder, end_processes, prepare_folder
from affordance.vision.pixels.rgbd import save_frame

_LOG = logging.getLogger(__name__)


class Experiment(Protocol):
    """Functions of an experiment, and what is known of it before it is run."""

    @property
    def run(self) -> Callable[[Setup], Results]:
        """Runs it."""

    @property
    def read(self) -> Callable[[Setup], Any]:
        """Reads and checks its files, simulating nothing."""

    @property
    def predict(self) -> Callable[[Setup], ObserverNumbers] | None:
        """Computes the numbers of each observer of every learner; None if it is run with one learner at a time."""

    @property
    def observers(self) -> int:
        """Number of observers unless another is asked for."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Tasks that the arm must be able to do; if the import of an arm could not fit one, it is not planned."""

    @property
    def no_memory(self) -> str:
        """Reason why no lasting memory can learn from it; empty if its one observer holds objects."""

    @property
    def every_learner(self) -> bool:
        """Whether observers of every learner are simulated, so that none can be chosen."""


class ExperimentModule(NamedTuple):
    """Experiment of a module; names in capital letters are its constants OBSERVERS, NEEDS and so on."""

    run: Callable[[Setup], Results]
    read: Callable[[Setup], Any]
    predict: Callable[[Setup], ObserverNumbers] | None
    observers: int
    needs: tuple[str, ...]
    no_memory: str
    every_learner: bool


# Experiments of `affordance run all`, in order, and the others; each is a module here.
OF_THE_PAPER = ("weight", "com", "reach", "hammer", "vision")
NAMES = (*OF_THE_PAPER, "linear_plus", "linear_plus_plus", "spoilt_family", "two_families", "next_lift")
# Folders of what compares finished runs; it holds no longer once there is another run.
COMPARISONS = ("agreement", "vision_comparison")


class SuiteResult(NamedTuple):
    """Report of several experiments, and the reasons why some of them could not be done, by name."""

    report: Path
    left_out: dict[str, str]


def find_experiment(name: str) -> ExperimentModule:
    """Finds an experiment by its name; raises a BadValueError for another one."""
    if name not in NAMES:
        raise BadValueError("experiment", "", describe_choice(name, NAMES))
    module = importlib.import_module(f"affordance.experiments.{name}")  # here, as nobody waits for the other ones
    return read_module(module)


def read_module(module: ModuleType) -> ExperimentModule:
    """Reads the functions and constants of a module that is an experiment."""
    return ExperimentModule(
        module.run,
        getattr(module, "read", lambda setup: None),
        getattr(module, "predict", None),
        getattr(module, "OBSERVERS", 200),
        getattr(module, "NEEDS", ()),
        getattr(module, "NO_MEMORY", ""),
        getattr(module, "EVERY_LEARNER", False),
    )


def run_suite(
    names: Sequence[str] | Mapping[str, Experiment],
    setup: Setup,
    *,
    cluster: str | None = None,
    announce: Callable[[Path], None] | None = None,
) -> SuiteResult:
    """Runs experiments and writes the report of all that the folder of results holds.

    If several experiments are run, those that cannot be done are left out and named in the log and the report.

    Args:
        names: Names of experiments, one or more; or experiments of one's own, by name.
        setup: Setup of all of them; each has a subfolder of its name in the folder of results.
        cluster: Address of a Dask scheduler that runs the observers; None for processes of this machine.
        announce: Function that is given the report after the first of several experiments, which then grows.

    Raises:
        BadValueError: A file of the models is wrong, the folder cannot be written to, or the cluster is not usable;
            nothing was written.
        ModelFileError: The arm cannot be loaded or is not usable; nothing was written.
        SeeingError: The features cannot be extracted from a picture; it was saved in OUT/frames.
        AffordanceError: No experiment can be done; the message gives the reason for the first.
    """
    check_folder(setup.out)  # before planning, which takes minutes
    find_commit()  # which is kept: that of what runs, not of what lies there at the end
    if setup.settings.faults.stuck_joint:  # which the arm must have
        setup.settings.faults.find_stuck(load_arm(setup.settings.arm).joint_names)
    known = names if isinstance(names, Mapping) else {name: find_experiment(name) for name in names}
    attempts = _Attempts(len(known))
    found = [
        name
        for name, each in known.items()
        if attempts.make(name, partial(_read, name, each, setup), InfeasibleError)
    ]
    done: list[str] = []
    try:
        with use_cluster(cluster, setup.models) if cluster is not None else nullcontext():
            for name in found:
                start = time.perf_counter()
                for results in attempts.make(name, partial(known[name].run, setup)):
                    prepare_folder(setup.out / name)
                    remove_leftovers(setup.out)
                    write_results(results, name, setup, start)
                    done.append(name)
                    end_processes()
                    if len(found) > 1:
                        report = write_report(setup.out)
                        if announce is not None and len(done) == 1:
                            announce(report)
    except SeeingError as error:
        raise save_frame(error, prepare_folder(setup.out) / "frames", type(error).__name__) from error
    for name in (*attempts.left_out, *COMPARISONS):
        remove_section(setup.out / name)  # from another run, perhaps with other models
    note_left_out(setup.out, attempts.left_out, done=done)
    return SuiteResult(write_report(setup.out), attempts.left_out)


def rehearse(name: str, experiment: Experiment, setup: Setup) -> None:
    """Runs one observer, and with it the whole analysis up to figures and report, into a folder that is thrown away.

    The observer is kept, so that it is not run again. Results of another type raise a BadValueError.
    """
    one, start = replace(setup, observers=1, jobs=1), time.perf_counter()
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")  # of statistics over one observer
        results = experiment.run(one)
        if not isinstance(results, Results):
            raise BadValueError(f"{name}.py", "run", f"returns a {type(results).__name__}, must return Results")
        write_results(results, name, replace(one, out=Path(folder)), start)


def _read(name: str, experiment: Experiment, setup: Setup) -> None:
    """Reads the files of an experiment, unless the import of the arm has found that it cannot be done."""
    lacks = read_lacks(setup.models)
    for need in experiment.needs:
        if need in lacks:
            problem = f"cannot be done by this arm, as its import found: {lacks[need]}"
            raise InfeasibleError(setup.settings.arm, need, problem)
    if setup.known and experiment.no_memory:
        raise BadValueError("--memory", "", f"has no effect on {name}, {experiment.no_memory}")
    experiment.read(setup)


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
