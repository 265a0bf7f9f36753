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
    """Functions of an experiment, and what is known of it before it is run.

    Attributes:
        run: Runs it.
        read: Reads and checks its files, simulating nothing.
        predict: Computes the numbers of each observer of every learner; None if it is run with one learner at a time.
        observers: Number of observers unless another is asked for, OBSERVERS.
        needs: Tasks that the arm must be able to do, NEEDS; if the import of an arm could not fit one, it is not
            planned.
        no_memory: Reason why no lasting memory can learn from it, NO_MEMORY; empty if its one observer holds objects.
        every_learner: Whether observers of every learner are simulated, and one's own is added, EVERY_LEARNER.
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
        """Returns the experiment of a module: its functions by their names, and its constants, in capital letters."""
        names = {each: each if each in ("run", "read", "predict") else each.upper() for each in cls._fields}
        return cls(**{each: getattr(module, name) for each, name in names.items() if hasattr(module, name)})


# Experiments of `affordance run all`, in order, and the others; each is a module here.
OF_THE_PAPER = ("weight", "com", "reach", "hammer", "vision")
NAMES = (*OF_THE_PAPER, "linear_plus", "linear_plus_plus", "spoilt_family", "two_families", "next_lift", "ladder")
# Designs for a laboratory; `run all` leaves them out, as nobody has done them.
DESIGNS = ("two_ends", "shallow_family")
# Experiments whose objects are held by a simulated arm, which pushes with what it believes in.
_HELD = (*OF_THE_PAPER, "next_lift", "ladder")
# Folders of what compares finished runs; it holds no longer once there is another run.
COMPARISONS = ("agreement", "vision_comparison")
# Folders of results that no table, and no experiment of a user, may write to.
_TAKEN = (*NAMES, *DESIGNS, *COMPARISONS, "arms", "frames")


class SuiteResult(NamedTuple):
    """Report of several experiments.

    Attributes:
        report: HTML page.
        left_out: Reasons why some experiments could not be done, by name.
        findings: What the others found, in a sentence each, by name.
    """

    report: Path
    left_out: dict[str, str]
    findings: dict[str, str]


def find_experiment(name: str) -> Experiment:
    """Finds an experiment by its name; raises a BadArgumentError for another one."""
    if name not in (*NAMES, *DESIGNS):
        raise BadArgumentError("experiment", "", describe_choice(name, (*NAMES, *DESIGNS)))
    module = importlib.import_module(f"affordance.experiments.{name}")  # here, as nobody waits for the other ones
    return Experiment.of(module)


@contextmanager
def open_experiment(word: str) -> Iterator[tuple[str, Experiment]]:
    """Finds an experiment by its name, or loads that of a user's Python file; yields its name too.

    Mistakes in the file are named with their line, as long as the experiment is open.
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
    """Returns the name of a file's results, its own without suffix; one that is taken, or no name, is refused."""
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
    """Runs experiments and writes the report of all that the folder of results holds.

    If several experiments are run, those that cannot be done are left out and named in the log and the report.

    Args:
        names: Name of an experiment, or several; or experiments of one's own by name.
        setup: Setup of all of them; each has a subfolder of its name in the folder of results.
        cluster: Address of a Dask scheduler that runs the observers; None for processes of this machine.
        begin: Function that is given the names of those that can be done, before the first is run.
        announce: Function that is given the report after the first of several experiments, which then grows.

    Raises:
        BadValueError: There is no such experiment, a file of the models is wrong, the folder cannot be written to, or
            the cluster is not usable; nothing was written.
        ModelFileError: The arm cannot be loaded or is not usable; nothing was written.
        SeeingError: The features cannot be extracted from a picture; it was saved in OUT/frames.
        AffordanceError: No experiment can be done; the message gives the reason for the first.
    """
    names = (names,) if isinstance(names, str) else names
    check_kind("setup", setup, Setup)
    known = names if isinstance(names, Mapping) else {name: find_experiment(name) for name in names}
    check_folder(setup.out)  # before planning, which takes minutes
    find_commit()  # which is kept: that of what runs, not of what lies there at the end
    if setup.settings.faults.stuck_joint:  # which the arm must have
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
        remove_section(setup.out / name)  # from another run, perhaps with other models
    note_left_out(setup.out, attempts.left_out, done=list(findings))
    return SuiteResult(write_report(setup.out), attempts.left_out, findings)


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
    if name in _HELD and setup.settings.participant != Participant():
        problem = f"changes nothing in {name}, whose objects are held in simulations; it is for lifts"
        raise BadValueError("--set", "participant", problem)
    experiment.read(setup)


class _Attempts:
    """Collects errors by name of the experiment, so that the other experiments can still be run."""

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
