"""Parts of the study of trust; each one measures, writes and draws in the study's folder."""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

from affordance.reporting.figures import save_figure
from studies.study import format_table
from studies.trust import bad_input, calibration, cluster, fault_costs, kills, pictures, scaling, sensing, soak

_LOG = logging.getLogger(__name__)

# Function that runs a part in the study's folder with a number of processes, and returns the part's numbers.
type Part = Callable[[Path, int], dict[str, Any]]


def study_calibration(folder: Path, jobs: int) -> dict[str, Any]:
    """Runs the calibration study, and plots the ranks."""
    found, numbers = calibration.measure(folder, jobs=jobs)
    names = [part.material.name for part in calibration.load_stick().components]
    save_figure(pictures.draw_ranks(found, names), folder, "ranks")
    return numbers


def study_faults(folder: Path, jobs: int) -> dict[str, Any]:
    """Measures the cost of faults, writes their table and plots it."""
    rows, costs = fault_costs.measure(folder, jobs=jobs)
    save_figure(pictures.draw_faults(costs), folder, "faults")
    return {"faults": costs, "faults_table": format_table(fault_costs.HEADER, rows)}


def study_sensing(folder: Path, jobs: int) -> dict[str, Any]:
    """Measures how often choices are correct with other errors of measurement."""
    return {"p_correct_by_sensing": sensing.measure(folder, jobs=jobs)}


def study_soak(folder: Path, jobs: int) -> dict[str, Any]:
    """Runs the soak test, and plots memory and time."""
    found, numbers = soak.measure()
    save_figure(pictures.draw_soak(found, numbers["soak_trials"]), folder, "soak")
    return numbers


def study_scaling(folder: Path, jobs: int) -> dict[str, Any]:
    """Measures times, and plots how the cost grows."""
    curves, numbers = scaling.measure()
    save_figure(pictures.draw_scaling(curves, numbers["parallel_efficiency_2"]), folder, "scaling")
    return numbers


def _study_failures(measure: Callable[[], tuple[list[list[str]], dict[str, Any]]]) -> Part:
    def study(folder: Path, jobs: int) -> dict[str, Any]:
        failures, numbers = measure()
        for row in failures:
            _LOG.warning("%s", ": ".join(row))
        return numbers

    return study


PARTS: dict[str, Part] = {
    "calibration": study_calibration,
    "faults": study_faults,
    "sensing": study_sensing,
    "bad_input": _study_failures(bad_input.measure),
    "kills": _study_failures(kills.measure),
    "cluster": _study_failures(cluster.measure),
    "soak": study_soak,
    "scaling": study_scaling,
}
