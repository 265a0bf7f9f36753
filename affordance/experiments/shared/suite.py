"""Runs experiments into one folder, and writes a report on them."""

import importlib
import logging
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from affordance.arguments import check_kind
from affordance.exceptions import (
    AffordanceError,
    BadArgumentError,
    BadValueError,
    InfeasibleError,
    SeeingError,
    describe_choice,
)
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results, write_results
from affordance.files.atomic import remove_leftovers
from affordance.files.frames import save_frame
from affordance.files.lacks import read_lacks
from affordance.plant.load import load_arm
from affordance.reporting.report import note_left_out, remove_section, write_report
from affordance.runs.repeats import check_folder, end_processes, prepare_folder
from affordance.version import find_commit

_LOG = logging.getLogger(__name__)


# The paper's simulations, in order; each is a module of the folder above.
OF_THE_PAPER = ("weight", "com", "reach", "hammer")


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
    """Returns one of the paper's experiments by name. An unknown name raises a BadArgumentError."""
    if name not in OF_THE_PAPER:
        raise BadArgumentError("experiment", "", describe_choice(name, OF_THE_PAPER))
    # Imported here, so that nobody waits for the others.
    experiment: Experiment = importlib.import_module(f"affordance.experiments.{name}").EXPERIMENT
    return experiment


def run_suite(
    names: Sequence[str] | str | Mapping[str, Experiment],
    setup: Setup,
    *,
    begin: Callable[[Sequence[str]], None] | None = None,
    announce: Callable[[Path], None] | None = None,
) -> SuiteResult:
    """Runs experiments, and writes a report on all results in a folder.

    Among several experiments, impossible ones are left out, and named in the log and the report.

    Args:
        names: Name of one of the paper's experiments, or names of several; or other experiments, by name.
        setup: Setup of all experiments; each writes to a subfolder of its name in the folder of results.
        begin: Function called before the first run, with the names of the experiments that can be done.
        announce: Function called with the path of the report after the first of several experiments.

    Raises:
        BadValueError: There is no such experiment, a file of the models is wrong, or the folder cannot be written to.
            Nothing was written.
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
    left_out: dict[str, AffordanceError] = {}

    def leave_out(name: str, error: AffordanceError) -> None:
        left_out[name] = error
        if len(left_out) == len(known):
            raise next(iter(left_out.values())) from None
        _LOG.warning("%s is left out: %s", name, error)

    for name, each in known.items():
        try:
            _read(name, each, setup)
        except InfeasibleError as error:
            leave_out(name, error)
    found = [name for name in known if name not in left_out]
    findings: dict[str, str] = {}
    if begin is not None:
        begin(found)
    for name in found:
        start = time.perf_counter()
        try:
            results = known[name].run(setup)
        except SeeingError as error:
            raise save_frame(error, prepare_folder(setup.out) / "frames", type(error).__name__) from error
        except AffordanceError as error:
            leave_out(name, error)
            continue
        prepare_folder(setup.out / name)
        remove_leftovers(setup.out)
        write_results(results, name, setup, start)
        findings[name] = results.finding
        end_processes()
        if len(found) > 1:
            report = write_report(setup.out)
            if announce is not None and len(findings) == 1:
                announce(report)
    reasons = {name: str(error) for name, error in left_out.items()}
    for name in reasons:
        remove_section(setup.out / name)  # left by an earlier run, perhaps with other models
    note_left_out(setup.out, reasons, done=list(findings))
    return SuiteResult(write_report(setup.out), reasons, findings)


def rehearse(name: str, experiment: Experiment, setup: Setup) -> None:
    """Runs one observer and the whole analysis into a temporary folder. The analysis includes figures and report.

    The observer is stored, so it does not run again. A ``run`` that does not return Results raises a BadValueError.
    """
    one, start = replace(setup, observers=1, jobs=1), time.perf_counter()
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")  # from statistics over a single observer
        results = experiment.run(one)
        if not isinstance(results, Results):
            raise BadValueError(f"{name}.py", "run", f"returns a {type(results).__name__}, must return Results")
        write_results(results, name, replace(one, out=Path(folder)), start)


def _read(name: str, experiment: Experiment, setup: Setup) -> None:
    """Checks that a setup allows an experiment, and reads its files."""
    lacks = read_lacks(setup.models)
    for need in experiment.needs:
        if need in lacks:
            problem = f"cannot be run with this arm; its import reported: {lacks[need]}"
            raise InfeasibleError(setup.settings.arm, need, problem)
    if setup.known and experiment.no_memory:
        raise BadValueError("--memory", "", f"has no effect on {name}, {experiment.no_memory}")
    experiment.read(setup)
