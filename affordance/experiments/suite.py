"""Catalogue of the experiments, and runs of several of them into one folder."""

import importlib
import logging
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from affordance.arguments import check_kind
from affordance.control.participant import Participant
from affordance.exceptions import (
    AffordanceError,
    BadArgumentError,
    BadValueError,
    InfeasibleError,
    SeeingError,
    describe_choice,
)
from affordance.experiments.observers import Setup
from affordance.experiments.prediction import ObserverNumbers
from affordance.experiments.results import Results, write_results
from affordance.files.atomic import remove_leftovers
from affordance.files.constraints import FileName, run_check
from affordance.plant.load import load_arm
from affordance.reporting.report import note_left_out, remove_section, write_report
from affordance.robots.changes import read_lacks
from affordance.runs.cluster import use_cluster
from affordance.runs.commit import find_commit
from affordance.runs.program_errors import blame_program
from affordance.runs.program_file import load_program
from affordance.runs.repeats import check_folder, end_processes, prepare_folder
from affordance.vision.pixels.rgbd import save_frame

_LOG = logging.getLogger(__name__)


class Experiment(NamedTuple):
    """Functions and constants of an experiment.

    Attributes:
        run: Runs the experiment.
        read: Reads and checks its files without simulating anything.
        predict: Computes the numbers of each observer of every learner; None if the experiment cannot be predicted.
        observers: Default number of observers (OBSERVERS in the module).
        needs: Tasks that the arm must be able to do (NEEDS). The experiment is left out if the import of the arm
            found that it cannot do one of them.
        no_memory: Reason why a lasting memory cannot learn from it (NO_MEMORY); empty if it can.
        every_learner: Whether observers of every learner are simulated, a user's learner included (EVERY_LEARNER).
    """

    run: Callable[[Setup], Results]
    read: Callable[[Setup], Any] = lambda setup: None
    predict: Callable[[Setup], ObserverNumbers] | None = None
    observers: int = 200
    needs: tuple[str, ...] = ()
    no_memory: str = ""
    every_learner: bool = False

    @classmethod
    def of(cls, module: ModuleType) -> "Experiment":
        """Returns the experiment of a module: its functions, and its constants, whose names are in capitals."""
        names = {each: each if each in ("run", "read", "predict") else each.upper() for each in cls._fields}
        return cls(**{each: getattr(module, name) for each, name in names.items() if hasattr(module, name)})


# The paper's experiments, and all of `affordance run all`, in order; each is a module of this folder.
OF_THE_PAPER = ("weight", "com", "reach", "hammer", "vision")
NAMES = (*OF_THE_PAPER, "linear_plus", "linear_plus_plus", "spoilt_family", "two_families", "next_lift", "ladder")
# Designs for a laboratory that nobody has done yet; `run all` leaves them out.
DESIGNS = ("two_ends", "shallow_family", "illusions")
# Experiments in which a simulated arm holds the objects; settings of participants have no effect on them.
_HELD = (*OF_THE_PAPER, "next_lift", "ladder")
# Folders of comparisons between finished runs; a new run makes them out of date.
COMPARISONS = ("agreement", "vision_comparison")
# Folders of results that no user's table or experiment may write to.
_TAKEN = (*NAMES, *DESIGNS, *COMPARISONS, "arms", "frames")


class SuiteResult(NamedTuple):
    """Outcome of running several experiments.

    Attributes:
        report: Path of the report, an HTML page.
        left_out: Reason why an experiment could not be done, by name.
        findings: Finding of each experiment that was done, in a sentence, by name.
    """

    report: Path
    left_out: dict[str, str]
    findings: dict[str, str]


def find_experiment(name: str) -> Experiment:
    """Finds an experiment by its name; raises a BadArgumentError for an unknown name."""
    if name not in (*NAMES, *DESIGNS):
        raise BadArgumentError("experiment", "", describe_choice(name, (*NAMES, *DESIGNS)))
    module = importlib.import_module(
        f"affordance.experiments.{name}"
    )  # imported here, so that nobody waits for the others
    return Experiment.of(module)


@contextmanager
def open_experiment(word: str) -> Iterator[tuple[str, Experiment]]:
    """Finds an experiment by its name, or loads it from a user's Python file.

    While the experiment is open, errors in the file are reported with their line.

    Args:
        word: Name of an experiment, or path of a file that ends in .py.

    Yields: Name of the experiment, and the experiment.
    """
    path = Path(word)
    if path.suffix != ".py":
        yield word, find_experiment(word)
        return
    name = check_own_name(path)
    with blame_program(path):
        module = load_program(path, "experiment")
        if not callable(getattr(module, "run", None)):
            raise BadValueError(path, "run", "is missing, must be a function of a Setup that returns Results")
        yield name, Experiment.of(module)


def check_own_name(path: Path) -> str:
    """Returns the name of a file without suffix, which names its results; raises a BadValueError if unusable."""
    try:
        run_check("", FileName().check, path.stem)
    except BadArgumentError as error:
        raise BadValueError(path, "", f"names the folder of its results, which {error.problem}") from error
    if path.stem in _TAKEN:
        problem = f"would write to the results of {path.stem}, must have another name, such as my_{path.name}"
        raise BadValueError(path, "", problem)
    return path.stem


def run_suite(
    names: Sequence[str] | str | Mapping[str, Experiment],
    setup: Setup,
    *,
    cluster: str | None = None,
    begin: Callable[[Sequence[str]], None] | None = None,
    announce: Callable[[Path], None] | None = None,
) -> SuiteResult:
    """Runs experiments, and writes a report on all results in the folder of results.

    If several experiments are run, those that cannot be done are left out, and named in the log and the report.

    Args:
        names: Name of one experiment, or names of several; or a user's own experiments, by name.
        setup: Setup of all experiments; each writes to a subfolder of its name in the folder of results.
        cluster: Address of a Dask scheduler that runs the observers; None for processes on this machine.
        begin: Function called before the first run, with the names of the experiments that can be done.
        announce: Function called with the path of the report after the first of several experiments.

    Raises:
        BadValueError: There is no such experiment, a file of the models is wrong, the folder cannot be written to, or
            the cluster cannot be used. Nothing was written.
        ModelFileError: The arm cannot be loaded or used. Nothing was written.
        SeeingError: Features cannot be extracted from a picture, which was saved in OUT/frames.
        AffordanceError: No experiment can be done; the message gives the reason for the first one.
    """
    names = (names,) if isinstance(names, str) else names
    check_kind("setup", setup, Setup)
    known = names if isinstance(names, Mapping) else {name: find_experiment(name) for name in names}
    check_folder(setup.out)  # before planning, which takes minutes
    find_commit()  # now, as it is cached: the commit of the code that runs, not of the files at the end
    if setup.settings.faults.stuck_joint:  # the arm must have this joint
        setup.settings.faults.find_stuck(load_arm(setup.settings.arm).joint_names)
    attempts = _Attempts(len(known))
    found = [
        name
        for name, each in known.items()
        if attempts.make(name, partial(_read, name, each, setup), InfeasibleError)
    ]
    findings: dict[str, str] = {}
    if begin is not None:
        begin(found)
    try:
        with use_cluster(cluster, setup.models) if cluster is not None else nullcontext():
            for name in found:
                start = time.perf_counter()
                for results in attempts.make(name, partial(known[name].run, setup)):
                    prepare_folder(setup.out / name)
                    remove_leftovers(setup.out)
                    write_results(results, name, setup, start)
                    findings[name] = results.finding
                    end_processes()
                    if len(found) > 1:
                        report = write_report(setup.out)
                        if announce is not None and len(findings) == 1:
                            announce(report)
    except SeeingError as error:
        raise save_frame(error, prepare_folder(setup.out) / "frames", type(error).__name__) from error
    for name in (*attempts.left_out, *COMPARISONS):
        remove_section(setup.out / name)  # left by an earlier run, perhaps with other models
    note_left_out(setup.out, attempts.left_out, done=list(findings))
    return SuiteResult(write_report(setup.out), attempts.left_out, findings)


def rehearse(name: str, experiment: Experiment, setup: Setup) -> None:
    """Runs one observer and the whole analysis, up to figures and report, into a temporary folder.

    The observer itself is stored, so it is not run again. Raises a BadValueError if ``run`` does not return Results.
    """
    one, start = replace(setup, observers=1, jobs=1), time.perf_counter()
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")  # from statistics over a single observer
        results = experiment.run(one)
        if not isinstance(results, Results):
            raise BadValueError(f"{name}.py", "run", f"returns a {type(results).__name__}, must return Results")
        write_results(results, name, replace(one, out=Path(folder)), start)


def _read(name: str, experiment: Experiment, setup: Setup) -> None:
    """Checks that an experiment can be done with a setup, and reads its files."""
    lacks = read_lacks(setup.models)
    for need in experiment.needs:
        if need in lacks:
            problem = f"cannot be run with this arm; its import reported: {lacks[need]}"
            raise InfeasibleError(setup.settings.arm, need, problem)
    if setup.known and experiment.no_memory:
        raise BadValueError("--memory", "", f"has no effect on {name}, {experiment.no_memory}")
    if name in _HELD and setup.settings.participant != Participant():
        problem = f"has no effect on {name}, in which objects are held; it applies to lifts only"
        raise BadValueError("--set", "participant", problem)
    experiment.read(setup)


class _Attempts:
    """Collects errors by experiment, so that the other experiments can still be run."""

    def __init__(self, number: int) -> None:
        """Sets the number of experiments."""
        self.left_out: dict[str, str] = {}
        self._number = number
        self._first: AffordanceError | None = None

    def make[T](
        self, name: str, make: Callable[[], T], expected: type[AffordanceError] = AffordanceError
    ) -> tuple[T, ...]:
        """Calls a function for an experiment; returns its result in a tuple, empty if an expected error occurs.

        Other errors and SeeingErrors are passed on. If no experiment is left, the first error is raised.
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
