"""``affordance study trust``: measures calibration, costs of faults, robustness of the program, and cost at scale.

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
    "sbc_p_value": "p of the chi-squared test that ranks of true densities are uniform: the smallest over two noise "
    "models and two densities, times four (Bonferroni), at most 1",
    "coverage50": "share of true densities in central 50 % intervals, mean of both noise models; likewise 80, 90",
    "efficiency_vs_cramer_rao": "Cramer-Rao bound divided by the variance of the unrestricted posterior, means over "
    "draws; of the two noise models, the value further from 1",
    "faults": "by name; density_error is the median of |believed/true - 1| after six trials, p_correct as in reach",
    "p_correct_by_sensing": "p_correct of reach with changed settings of sensing, by moment",
    "bad_inputs_refused": "how many of bad_inputs_tried ended with exit status 2, one line that names file and key "
    "(for the arm only the file), and nothing written",
    "kills_identical": "kills (SIGKILL, of experiments in one and two processes) after which the resumed run wrote "
    "the same files, byte for byte, as a run left alone",
    "cluster_identical": "whether a run on two Dask workers of one machine, one of them killed while it had a task, "
    "wrote the same files as a local run",
    "soak_memory_growth_MB": "growth of a process from the first twentieth of soak_trials to the last",
    "parallel_efficiency_2": "wall time in one process divided by twice the wall time in two",
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
    add_jobs(parser, 2)  # the claims' bounds are meant for a machine with two cores
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Imports the parts."""
    parts = import_part("studies.trust.parts").PARTS
    return partial(_work, {name: parts[name] for name in arguments.only or KEYS}, arguments.jobs)


def _work(parts: Mapping[str, Any], jobs: int, folder: Path) -> Iterator[Findings]:
    """Runs the chosen parts; yields the findings once there are numbers for all parts."""
    for name, run in parts.items():
        print(f"{name} ...", flush=True)
        program = compute_key("", MODELS, Path(__file__).parents[1])
        write_json(folder / f"{name}.json", {**run(folder, jobs), "program": program})
    found = {name: read_numbers(folder, name) for name in KEYS}
    if missing := [name for name, numbers in found.items() if numbers is None]:
        print(f"No numbers yet for: {', '.join(missing)}")
        return
    numbers = {key: value for part in found.values() if part is not None for key, value in part.items()}
    # The sources, models and versions that stored parts depend on.
    numbers["program"] = {name: part["program"] for name, part in found.items() if part is not None}
    table = numbers.pop("faults_table")
    numbers["how"] = HOW
    write = (lambda folder: write_text(folder / "faults.md", f"{table}\n"),)
    yield Findings(numbers, describe(numbers), writers=write)


def read_numbers(folder: Path, part: str) -> dict[str, Any] | None:
    """Reads the results of a part; returns None if it has not been run. A damaged file is quarantined."""
    return read_kept(folder / f"{part}.json", (*KEYS[part], "program"))


STUDY = Study(
    "calibration, faults, errors of measurement, bad input, kills, cluster, soak and scaling",
    add_arguments,
    plan,
    on_one_thread=True,
)
