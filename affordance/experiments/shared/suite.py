"""Runs several experiments, and writes their results and a report to one folder."""

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


# Simulations of the paper; each is a module of the package ``affordance.experiments``.
OF_THE_PAPER = ("weight", "com", "reach", "hammer")


class SuiteResult(NamedTuple):
    """Results of several experiments.

    Attributes:
        report: Path of the report, an HTML page.
        left_out: Reason for each experiment that could not be run, by name.
        findings: Main result of each other experiment in one sentence, by name.
    """

    report: Path
    left_out: dict[str, str]
    findings: dict[str, str]


def find_experiment(name: str) -> Experiment:
    """Returns an experiment of the paper by name.

    Raises:
        BadArgumentError: The name is unknown.
    """
    if name not in OF_THE_PAPER:
        raise BadArgumentError("experiment", "", describe_choice(name, OF_THE_PAPER))
    # The import is deferred to save the time of importing all experiments.
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

    Experiments that cannot be run are skipped if there are others. Log and report contain the reason.

    Args:
        names: One or several names of experiments of the paper, or a mapping of other experiments by name.
        setup: Setup of all experiments. Each writes to a subfolder in the folder of results.
        begin: Function that is called before the first run with the names of all experiments that can be run.
        announce: Function that is called with the path of the report after the first of several experiments.

    Raises:
        BadArgumentError: There is no experiment of this name.
        BadValueError: A file of the models is invalid, or the folder cannot be written to. Nothing was written.
        ModelFileError: The arm cannot be loaded or used. Nothing was written.
        SeeingError: Features cannot be extracted from a picture, which was saved in OUT/frames.
        AffordanceError: No experiment can be run. The message contains the reason for the first.
    """
    names = (names,) if isinstance(names, str) else names
    check_kind("setup", setup, Setup)
    known = names if isinstance(names, Mapping) else {name: find_experiment(name) for name in names}
    check_folder(setup.out)  # checked before planning, which takes minutes
    find_commit()  # cached now, because files may change during the run
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
        remove_section(setup.out / name)  # may remain from an earlier run with other models
    note_left_out(setup.out, reasons, done=list(findings))
    return SuiteResult(write_report(setup.out), reasons, findings)


def rehearse(name: str, experiment: Experiment, setup: Setup) -> None:
    """Tests an experiment with one observer, whose figures and report are written to a temporary folder.

    The results of the observer are stored for the actual run.

    Raises:
        BadValueError: The function ``run`` does not return Results.
    """
    one, start = replace(setup, observers=1, jobs=1), time.perf_counter()
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")  # statistics of a single observer cause warnings
        results = experiment.run(one)
        if not isinstance(results, Results):
            raise BadValueError(f"{name}.py", "run", f"returns a {type(results).__name__}, must return Results")
        write_results(results, name, replace(one, out=Path(folder)), start)


def _read(name: str, experiment: Experiment, setup: Setup) -> None:
    """Checks that an experiment can be run with a setup, and reads its files."""
    lacks = read_lacks(setup.models)
    for need in experiment.needs:
        if need in lacks:
            problem = f"cannot be run with this arm; its import reported: {lacks[need]}"
            raise InfeasibleError(setup.settings.arm, need, problem)
    if setup.known and experiment.no_memory:
        raise BadValueError("--memory", "", f"has no effect on {name}, {experiment.no_memory}")
    experiment.read(setup)
