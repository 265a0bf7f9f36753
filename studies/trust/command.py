"""``affordance study trust``: measures calibration, costs of faults, robustness of the program, and scale.

The numbers of each part are stored, so parts can be run one at a time.
"""

import argparse
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from affordance.commands.options import add_jobs, add_out
from affordance.files.atomic import write_json, write_text
from affordance.files.model_folder import MODELS
from affordance.runs.repeats import compute_key
from studies.study import Findings, Study, Work, add_only, import_part, read_kept
from studies.trust.report import describe

HOW = {
    "sbc_p_value": "chi-squared test that ranks of true densities are uniform: smallest over two noise models and "
    "two densities, times four (Bonferroni), at most 1",
    "coverage50": "of true densities by central 50 % intervals, mean over both noise models; likewise 80 and 90",
    "efficiency_vs_cramer_rao": "Cramer-Rao bound over the unrestricted posterior's variance, means over draws; of "
    "both noise models, the one further from 1",
    "faults": "by name; density_error is the median of |believed/true - 1| after six trials, p_correct as in reach",
    "p_correct_by_sensing": "of reach, with settings changed, by moment",
    "bad_inputs_refused": "of bad_inputs_tried: exit status 2, one line that names file and key (of the arm only the "
    "file), nothing written",
    "kills_identical": "of kills with SIGKILL, of experiments in one and two processes: files after resuming equal "
    "those of a run left alone, byte for byte",
    "cluster_identical": "files of a run on two Dask workers of one machine, one killed while it had a task, equal "
    "those of a local run",
    "soak_memory_growth_MB": "of a process, from the first twentieth of soak_trials to the last",
    "parallel_efficiency_2": "wall time in one process over twice that in two",
}
# Parts of the study, and the keys that each must provide, for the report and metrics.json.
KEYS: dict[str, tuple[str, ...]] = {
    "calibration": (
        "sbc_p_value",
        *("coverage50", "coverage80", "coverage90"),
        "efficiency_vs_cramer_rao",
        "efficiency",
        "calibration",
        "sbc_draws",
    ),
    "faults": ("faults", "faults_table"),
    "sensing": ("p_correct_by_sensing",),
    "bad_input": ("bad_inputs_tried", "bad_inputs_refused"),
    "kills": ("kills", "kills_identical", "kill_moments"),
    "cluster": ("cluster_identical",),
    "soak": ("soak_trials", "soak_memory_growth_MB", "soak_time_drift"),
    "scaling": ("parallel_efficiency_2", "scaling"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_only(parser, KEYS, "parts")
    add_jobs(parser, 2)  # as on the machine for which the claims' bounds are meant
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Imports the parts."""
    parts = import_part("studies.trust.parts").PARTS
    return partial(_work, {name: parts[name] for name in arguments.only or KEYS}, arguments.jobs)


def _work(parts: Mapping[str, Any], jobs: int, folder: Path) -> Iterator[Findings]:
    """Runs the chosen parts; yields the findings if numbers of all parts exist."""
    for name, run in parts.items():
        print(f"{name} ...", flush=True)
        program = compute_key("", MODELS, Path(__file__).parents[1])
        write_json(folder / f"{name}.json", {**run(folder, jobs), "program": program})
    found = {name: read_numbers(folder, name) for name in KEYS}
    if missing := [name for name, numbers in found.items() if numbers is None]:
        print(f"No numbers yet of: {', '.join(missing)}")
        return
    numbers = {key: value for part in found.values() if part is not None for key, value in part.items()}
    # Sources, models and versions on which stored parts depend.
    numbers["program"] = {name: part["program"] for name, part in found.items() if part is not None}
    table = numbers.pop("faults_table")
    numbers["how"] = HOW
    write = (lambda folder: write_text(folder / "faults.md", f"{table}\n"),)
    yield Findings(numbers, describe(numbers), writers=write)


def read_numbers(folder: Path, part: str) -> dict[str, Any] | None:
    """Reads the results of a part; returns None if it was not run. A damaged file is quarantined."""
    return read_kept(folder / f"{part}.json", (*KEYS[part], "program"))


STUDY = Study(
    "calibration, faults, errors of measurement, bad input, kills, cluster, soak and scaling",
    add_arguments,
    plan,
    on_one_thread=True,
)
