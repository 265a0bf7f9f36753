"""Report of the study of trust: calibration, faults, bad input, kills, cluster, soak test and scaling."""

from collections.abc import Mapping
from typing import Any

from affordance.reporting.claims import ClaimResult, Unit, check, claim, confirm
from affordance.reporting.formatting import format_number
from affordance.reporting.section import ReportFigure, Section, Table

COUNT, OF_LIMIT = Unit(digits=0), Unit("% of its limit", 100.0, 0)


def describe(numbers: Mapping[str, Any]) -> Section:
    """Describes what was measured, with figures, claims and tables."""
    captions = {
        "ranks": (
            "Ranks of true densities in their posteriors; they are uniform if all is right. Above each histogram: the"
            " p-value of the test, and how often central intervals cover the true density."
        ),
        "faults": "What each fault costs; the error of densities is the median after six trials.",
        "soak": "Memory, and processor time per trial, over the trials of one process.",
        "scaling": "How the cost grows, measured in one run.",
    }
    program = numbers["program"]
    states = ", ".join(f"{study.replace('_', ' ')} of {key}" for study, key in program.items())
    differ = len(set(program.values())) > 1
    return Section(
        order=9,
        title="Trust and scale",
        summary=(
            f"{numbers['sbc_draws']} pairs of densities are drawn from the prior, and each is held once with each of"
            " two noise models; every fault of models/faults.yaml is switched on; files are malformed in every way"
            " that we could think of; runs are killed, and sent to a cluster;"
            f" {numbers['soak_trials']} trials run in one process. make trust repeats all of it."
        ),
        figures=[ReportFigure(file=f"{name}.png", caption=caption) for name, caption in captions.items()],
        claims=judge(numbers),
        tables=_list_tables(numbers),
        remarks=[f"The parts come from different states of the program: {states}."] if differ else [],
    )


def judge(n: Mapping[str, Any]) -> list[ClaimResult]:
    """Judges the claims."""
    costs = list(n["faults"].values())
    return [
        claim("calibrated", "ours",
              "Observers are as uncertain as they should be: ranks of true densities in posteriors are uniform.",
              check("p of the test of uniform ranks, Bonferroni-corrected for two noise models and two densities",
                    n["sbc_p_value"], above=0.01)),
        claim("efficient", "ours",
              "No measurement is wasted: the posterior is as narrow as the Cramér-Rao bound allows, within 5 %.",
              check("bound divided by variance, for the noise model that is further from 1",
                    n["efficiency_vs_cramer_rao"], Unit(digits=3), above=0.95, below=1.05)),
        claim("faults", "ours",
              "Whatever is wrong with sensors or arm, the arm keeps its limits of torque, velocity and position, and"
              " beliefs stay valid.",
              check("largest torque for each fault, in the order of the table",
                    [cost["torque_of_limit"] for cost in costs], OF_LIMIT, at_most=1),
              check("largest velocity", [cost["velocity_of_limit"] for cost in costs], OF_LIMIT, at_most=1),
              check("largest violation of a position limit",
                    [cost["violation_rad"] for cost in costs], Unit("mrad", 1000.0), at_most=0),
              confirm("beliefs are valid under all faults", all(cost["beliefs_valid"] for cost in costs))),
        claim("bad_input", "ours", "Bad input is rejected in one line, with status 2 and nothing written.",
              check("malformed files that are not rejected in this way",
                    n["bad_inputs_tried"] - n["bad_inputs_refused"], COUNT, at_most=0),
              check("malformed files", n["bad_inputs_tried"], COUNT, at_least=500)),
        claim("kills", "ours", "A run that was killed and resumed writes the same files as one that was not killed.",
              check("kills at random moments, of runs in one process and in two, after which files differ",
                    n["kills"] - n["kills_identical"], COUNT, at_most=0),
              check("kills", n["kills"], COUNT, at_least=20)),
        claim("cluster", "ours", "A cluster writes the same files, even if one of its two workers is killed at work.",
              confirm("files are the same byte for byte, with scheduler and workers on one machine",
                      n["cluster_identical"])),
        claim("soak", "ours", "Memory grows by less than 10 MB, and the time of a trial by less than a tenth.",
              check("growth of the process's memory over all trials",
                    n["soak_memory_growth_MB"], Unit("MB", digits=1), below=10),
              check("time of a trial at the end divided by that at the beginning", n["soak_time_drift"], below=1.1),
              check("trials", n["soak_trials"], COUNT, at_least=10000)),
        claim("scaling", "ours", "Two processes are more than 1.8 times as fast as one.",
              check("time in one process divided by twice that in two, on a machine with two cores",
                    n["parallel_efficiency_2"], above=0.9)),
    ]  # fmt: skip


def _list_tables(n: Mapping[str, Any]) -> list[Table]:
    percents = ("density_error", "samples_rejected", "trials_outlier", "torque_of_limit", "velocity_of_limit")
    faults = []
    for name, cost in n["faults"].items():
        error, rejected, outliers, torque, velocity = (f"{100.0 * cost[key]:.0f} %" for key in percents)
        right = [f"{cost['p_correct'][moment]:.2f}" for moment in (1, -1)]
        valid = "yes" if cost["beliefs_valid"] else "no"
        beyond = f"{1000.0 * cost['violation_rad']:.2f}"
        faults.append([name.replace("_", " "), error, *right, rejected, outliers, torque, velocity, beyond, valid])
    return [
        Table(
            "How often central intervals of 50, 80 and 90 % cover the true density, and what approximations cost.",
            ["observers", "50 %", "80 %", "90 %", "p of uniform ranks"],
            [
                [name, *(f"{100.0 * share:.1f} %" for share in found["coverage"]), format_number(found["p_value"], 2)]
                for name, found in n["calibration"].items()
            ],
        ),
        Table(
            "Cramér-Rao bound divided by the variance of the posterior.",
            ["observers", "bound divided by variance"],
            [[name, f"{ratio:.3f}"] for name, ratio in n["efficiency"].items()],
        ),
        Table(
            "What each fault costs; choices are of a grip for reaching, as in Simulation III.",
            [
                *("fault", "error of the densities", "correct after one trial", "after six", "samples rejected"),
                *("5-sigma outliers", "largest torque", "largest velocity", "beyond a position limit (mrad)"),
                "beliefs valid",
            ],
            faults,
        ),
    ]
