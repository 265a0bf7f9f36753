"""Runs the studies of trust and scale and writes results/trust/ and its section of the report: ``make trust``.

python -m benchmarks.trust.run [STUDY ...] runs some of them; those already there are kept.
"""

import argparse
import os

# One thread each, as in the experiments' processes; it must be said before NumPy is loaded.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from affordance.figures import save_figure
from affordance.report import Claim, Picture, Section, write_report, write_section
from affordance.results import list_versions, set_aside, write_json, write_text
from benchmarks.tables import format_table
from benchmarks.trust import bad_input, calibration, cluster, fault_costs, kills, pictures, scaling, soak

_LOG = logging.getLogger(__name__)

FOLDER = Path("results/trust")
# Of the machine the targets are meant for.
JOBS = 2
HOW = {
    "sbc_p_value": "chi-squared test that ranks of true densities are uniform: smallest over two noise models and "
    "two densities, times four (Bonferroni), at most 1",
    "coverage50": "of true densities by central 50 % intervals, mean over both noise models; likewise 80 and 90",
    "efficiency_vs_cramer_rao": "Cramer-Rao bound over the unrestricted posterior's variance, Weber noise, means",
    "faults": "by name; density_error is the median of |believed/true - 1| after six trials, p_correct as in reach",
    "bad_inputs_refused": "of bad_inputs_tried: exit status 2, one line that names file and key, nothing written",
    "kills_identical": "of kills with SIGKILL: files after resuming equal those of a run left alone, byte for byte",
    "cluster_identical": "files of a run on two Dask workers of one machine, one killed while it had a task, equal "
    "those of a local run",
    "soak_memory_growth_MB": "of a process, from the first twentieth of soak_trials to the last",
    "parallel_efficiency_2": "wall time in one process over twice that in two",
}


def study_calibration() -> dict[str, Any]:
    """Calibrates, and draws the ranks."""
    found, numbers = calibration.measure(FOLDER, jobs=JOBS)
    names = [part.material.name for part in calibration.load_stick().components]
    save_figure(pictures.draw_ranks(found, names), FOLDER, "ranks")
    return numbers


def study_faults() -> dict[str, Any]:
    """Costs faults, and writes their table."""
    rows, costs = fault_costs.measure(FOLDER, jobs=JOBS)
    return {"faults": costs, "faults_table": format_table(fault_costs.HEADER, rows)}


def study_soak() -> dict[str, Any]:
    """Soaks, and draws memory and time."""
    found, numbers = soak.measure()
    save_figure(pictures.draw_soak(found, numbers["soak_trials"]), FOLDER, "soak")
    return numbers


def study_scaling() -> dict[str, Any]:
    """Times, and draws how cost grows."""
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
    "bad_input": _study_failures(bad_input.measure),
    "kills": _study_failures(kills.measure),
    "cluster": _study_failures(cluster.measure),
    "soak": study_soak,
    "scaling": study_scaling,
}


# What each study must have found, for the report and metrics.json.
KEYS: dict[str, tuple[str, ...]] = {
    "calibration": (
        "sbc_p_value",
        *(f"coverage{round(100 * coverage)}" for coverage in calibration.COVERAGES),
        "efficiency_vs_cramer_rao",
        "calibration",
        "sbc_draws",
    ),
    "faults": ("faults", "faults_table"),
    "bad_input": ("bad_inputs_tried", "bad_inputs_refused"),
    "kills": ("kills", "kills_identical"),
    "cluster": ("cluster_identical",),
    "soak": ("soak_trials", "soak_memory_growth_MB", "soak_time_drift"),
    "scaling": ("parallel_efficiency_2", "scaling"),
}


def read_numbers(folder: Path, study: str) -> dict[str, Any] | None:
    """Reads what a study found; None if it was not run. A file that is no such thing is set aside."""
    path = folder / f"{study}.json"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(content, dict):
            raise ValueError("it is no mapping")
        if missing := [key for key in KEYS[study] if key not in content]:
            raise ValueError(f"it has no {missing[0]}")
    except FileNotFoundError:
        return None
    except (ValueError, RecursionError) as error:
        set_aside(path, f"is not what a study found ({error})")
        return None
    return content


def describe(numbers: Mapping[str, Any]) -> Section:
    """Puts the numbers of all studies into a section of the report."""
    draws = numbers["sbc_draws"]
    exact, ignored = (numbers["calibration"][name] for name in (calibration.EXACT, calibration.IGNORING))
    coverage = [numbers[f"coverage{round(100 * said)}"] for said in calibration.COVERAGES]
    none = numbers["faults"]["none"]
    claims = [
        Claim(
            "ours",
            "Observers are as unsure as they should be: true densities lie uniformly in their posteriors.",
            bool(numbers["sbc_p_value"] > 0.01),
            f"p = {numbers['sbc_p_value']:.2f} (Bonferroni-corrected for two noise models and two densities) over "
            f"{draws} draws from the prior, the same with each noise model; intervals of "
            "50, 80 and 90 % cover " + ", ".join(f"{100 * share:.1f} %" for share in coverage) + ". Exact Bayes on a "
            "grid, without the plug-in for errors that grow with torque, covers "
            + ", ".join(f"{100 * share:.1f} %" for share in exact["coverage"])
            + "; were positivity ignored, it would be "
            + ", ".join(f"{100 * share:.1f} %" for share in ignored["coverage"])
            + f" and p = {ignored['p_value']:.0e} (corrected for two densities).",
        ),
        Claim(
            "ours",
            "Nothing felt is wasted: the posterior is as narrow as the Cramer-Rao bound allows (within 5 %).",
            bool(abs(numbers["efficiency_vs_cramer_rao"] - 1.0) < 0.05),
            f"bound over variance {numbers['efficiency_vs_cramer_rao']:.3f}",
        ),
        *(
            Claim(
                "ours",
                f"With the fault {name} the arm keeps its torque limits, and joints their range as well as without, "
                "to a tenth of a degree; beliefs stay valid.",
                bool(
                    cost["beliefs_valid"]
                    and cost["torque_of_limit"] <= 1.0
                    and cost["overstep_rad"] <= none["overstep_rad"] + 1.75e-3
                ),
                f"density error {100 * cost['density_error']:.0f} % (without {100 * none['density_error']:.0f}), "
                f"right choices after one trial {cost['p_correct'][1]:.2f} ({none['p_correct'][1]:.2f}), after six "
                f"{cost['p_correct'][-1]:.2f} ({none['p_correct'][-1]:.2f}); {100 * cost['samples_rejected']:.0f} % "
                f"of samples refused, {100 * cost['trials_surprising']:.0f} % of trials flagged; at most "
                f"{1e3 * cost['overstep_rad']:.2f} mrad beyond a joint's range ({1e3 * none['overstep_rad']:.2f})",
            )
            for name, cost in numbers["faults"].items()
            if name != "none"
        ),
        Claim(
            "ours",
            "Bad input is refused in one line, with status 2 and nothing written.",
            numbers["bad_inputs_refused"] == numbers["bad_inputs_tried"],
            f"{numbers['bad_inputs_refused']} of {numbers['bad_inputs_tried']} spoilt files",
        ),
        Claim(
            "ours",
            "A run that was killed goes on to the very files of one that was not.",
            numbers["kills_identical"] == numbers["kills"],
            f"{numbers['kills_identical']} of {numbers['kills']} kills",
        ),
        Claim(
            "ours",
            "A cluster gives the same files, though one of its two workers is killed at work.",
            bool(numbers["cluster_identical"]),
            "compared byte for byte; scheduler and workers on one machine",
        ),
        Claim(
            "ours",
            "Neither memory nor the time of a trial grows (by 10 MB, or a tenth).",
            bool(numbers["soak_memory_growth_MB"] < 10.0 and numbers["soak_time_drift"] < 1.1),
            f"{numbers['soak_memory_growth_MB']:.1f} MB more after {numbers['soak_trials']} trials in one process; a "
            f"trial took {numbers['soak_time_drift']:.2f} times as long",
        ),
    ]
    return Section(
        order=9,
        title="Trust and scale",
        summary=(
            f"{draws} pairs of densities drawn from the prior, each held once with either noise model; every fault "
            "of models/faults.yaml switched on; files spoilt in every way we could think of; runs killed, and sent "
            "to a cluster; ten thousand trials in one process. make trust repeats all of it."
        ),
        pictures=[
            Picture(
                "ranks.png",
                "Where true densities lie in their posteriors; uniform if all is right. Above each: the test, and "
                "how often central intervals cover.",
            ),
            Picture("soak.png", "Memory, and processor time of a trial, over the trials of one process."),
            Picture("scaling.png", "How the cost grows, from one run."),
        ],
        claims=claims,
        differences=[],
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs studies, and writes numbers and report once all of them are there."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("studies", nargs="*", metavar="STUDY", help=f"of {', '.join(STUDIES)}; all if none is named")
    names = parser.parse_args(arguments).studies or list(STUDIES)
    if unknown := [name for name in names if name not in STUDIES]:
        parser.error(f"{unknown[0]!r} is none of {', '.join(STUDIES)}")
    for name in names:
        print(f"{name} ...", flush=True)
        write_json(FOLDER / f"{name}.json", STUDIES[name]())
    found = {name: read_numbers(FOLDER, name) for name in STUDIES}
    missing = [name for name, numbers in found.items() if numbers is None]
    if missing:
        print(f"No numbers yet of: {', '.join(missing)}")
        return
    numbers = {key: value for study in found.values() if study is not None for key, value in study.items()}
    write_section(FOLDER, describe(numbers))
    write_text(FOLDER / "faults.md", numbers.pop("faults_table") + "\n")
    write_json(FOLDER / "metrics.json", {**numbers, "how": HOW, "versions": list_versions()})
    print(f"The report: {write_report(FOLDER.parent)}")


if __name__ == "__main__":
    main()
