"""Runs the studies of trust and scale and writes results/trust/ and its section of the report: ``make trust``.

python -m studies.trust.run [STUDY ...] runs some of them; results of the others are kept.
"""

import argparse
import os

# One thread each, as in the experiments' processes; it must be set before NumPy is loaded.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from affordance.files.atomic import write_json, write_text
from affordance.files.model_folder import MODELS
from affordance.reporting.figures import save_figure
from affordance.runs.repeats import compute_key
from studies.study import Findings, format_table, read_kept, write_findings
from studies.trust import bad_input, calibration, cluster, fault_costs, kills, pictures, scaling, sensing, soak

_LOG = logging.getLogger(__name__)

FOLDER = Path("results/trust")
SECTION = Path(__file__).with_name("section.yaml")
# Keys of each fault that its claim uses; limits must be respected without a fault too.
_OF_FAULTS = ("torque_of_limit", "velocity_of_limit", "violation_rad", "beliefs_valid")
# Number of processes of the machine for which the targets are meant.
JOBS = 2
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


def study_calibration() -> dict[str, Any]:
    """Runs the calibration study, and draws the ranks."""
    found, numbers = calibration.measure(FOLDER, jobs=JOBS)
    names = [part.material.name for part in calibration.load_stick().components]
    save_figure(pictures.draw_ranks(found, names), FOLDER, "ranks")
    return numbers


def study_faults() -> dict[str, Any]:
    """Measures the cost of faults, writes their table and draws it."""
    rows, costs = fault_costs.measure(FOLDER, jobs=JOBS)
    save_figure(pictures.draw_faults(costs), FOLDER, "faults")
    return {"faults": costs, "faults_table": format_table(fault_costs.HEADER, rows)}


def study_sensing() -> dict[str, Any]:
    """Measures correct choices under other errors of measurement."""
    return {"p_correct_by_sensing": sensing.measure(FOLDER, jobs=JOBS)}


def study_soak() -> dict[str, Any]:
    """Runs the soak test, and draws memory and time."""
    found, numbers = soak.measure()
    save_figure(pictures.draw_soak(found, numbers["soak_trials"]), FOLDER, "soak")
    return numbers


def study_scaling() -> dict[str, Any]:
    """Measures times, and draws the growth of cost."""
    curves, numbers = scaling.measure()
    save_figure(pictures.draw_scaling(curves, numbers["parallel_efficiency_2"]), FOLDER, "scaling")
    return numbers


def _study_failures(measure: Callable[[], tuple[list[list[str]], dict[str, Any]]]) -> Callable[[], dict[str, Any]]:
    def study() -> dict[str, Any]:
        failures, numbers = measure()
        for row in failures:
            _LOG.warning("%s", ": ".join(row))
        return numbers

    return study


STUDIES: dict[str, Callable[[], dict[str, Any]]] = {
    "calibration": study_calibration,
    "faults": study_faults,
    "sensing": study_sensing,
    "bad_input": _study_failures(bad_input.measure),
    "kills": _study_failures(kills.measure),
    "cluster": _study_failures(cluster.measure),
    "soak": study_soak,
    "scaling": study_scaling,
}


# Keys that each study must provide, for the report and metrics.json.
KEYS: dict[str, tuple[str, ...]] = {
    "calibration": (
        "sbc_p_value",
        *(f"coverage{round(100 * coverage)}" for coverage in calibration.COVERAGES),
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


def read_numbers(folder: Path, study: str) -> dict[str, Any] | None:
    """Reads the results of a study; None if it was not run. A damaged file is quarantined."""
    return read_kept(folder / f"{study}.json", (*KEYS[study], "program"))


def list_facts(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Returns facts of the section file other than the numbers: lists over faults, and the number of programs."""
    of_faults = {f"faults_{key}": [cost[key] for cost in numbers["faults"].values()] for key in _OF_FAULTS}
    return {**of_faults, "num_programs": len(set(numbers["program"].values()))}


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs studies, and writes numbers and report once all of them are there."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("studies", nargs="*", metavar="STUDY", help=f"of {', '.join(STUDIES)}; all if none is named")
    names = parser.parse_args(arguments).studies or list(STUDIES)
    if unknown := [name for name in names if name not in STUDIES]:
        parser.error(f"{unknown[0]!r} is none of {', '.join(STUDIES)}")
    for name in names:
        print(f"{name} ...", flush=True)
        program = compute_key("", MODELS, Path(__file__).parent)
        write_json(FOLDER / f"{name}.json", {**STUDIES[name](), "program": program})
    found = {name: read_numbers(FOLDER, name) for name in STUDIES}
    missing = [name for name, numbers in found.items() if numbers is None]
    if missing:
        print(f"No numbers yet of: {', '.join(missing)}")
        return
    numbers = {key: value for study in found.values() if study is not None for key, value in study.items()}
    # Inputs on which studies that were run one at a time depend: sources, models and versions.
    programs = {name: study.pop("program") for name, study in found.items() if study is not None}
    numbers["program"] = programs
    table = numbers.pop("faults_table")
    numbers["how"] = HOW
    findings = Findings(
        numbers,
        list_facts(numbers),
        writers=(lambda folder: write_text(folder / "faults.md", f"{table}\n"),),
    )
    print(f"The report: {write_findings(findings, FOLDER, SECTION)}")


if __name__ == "__main__":
    main()
