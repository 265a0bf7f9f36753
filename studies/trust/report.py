"""Report of the study of trust: calibration, faults, bad input, kills, cluster, soak and scaling."""

from collections.abc import Mapping
from typing import Any

from affordance.reporting.claims import ClaimResult, Unit, check, claim, confirm
from affordance.reporting.formatting import format_number
from affordance.reporting.section import ReportFigure, Section, Table

COUNT, OF_LIMIT = Unit(digits=0), Unit("% of its limit", 100.0, 0)


def describe(numbers: Mapping[str, Any]) -> Section:
    """Describes what was measured."""
    captions = {
        "ranks": (
            "Ranks of true densities in their posteriors; uniform if all is right. Above each: the test, and how"
            " often central intervals cover."
        ),
        "faults": "What each fault costs; the error of the densities is the median after six trials.",
        "soak": "Memory, and processor time of a trial, over the trials of one process.",
        "scaling": "How the cost grows, from one run.",
    }
    program = numbers["program"]
    states = ", ".join(f"{study.replace('_', ' ')} of {key}" for study, key in program.items())
    differ = len(set(program.values())) > 1
    return Section(
        order=9,
        title="Trust and scale",
        summary=(
            f"{numbers['sbc_draws']} pairs of densities drawn from the prior, each held once with either noise"
            " model; every fault of models/faults.yaml switched on; files malformed in every way we could think"
            f" of; runs killed, and sent to a cluster; {numbers['soak_trials']} trials in one process. make trust"
            " repeats all of it."
        ),
        figures=[ReportFigure(file=f"{name}.png", caption=caption) for name, caption in captions.items()],
        claims=judge(numbers),
        tables=_list_tables(numbers),
        remarks=[f"These studies are not of one state of the program: {states}."] if differ else [],
    )


def judge(n: Mapping[str, Any]) -> list[ClaimResult]:
    """Judges the claims."""
    costs = list(n["faults"].values())
    return [
        claim("calibrated", "ours",
              "Observers are as unsure as they should be: true densities lie uniformly in their posteriors.",
              check("p of the test of uniform ranks, Bonferroni-corrected for two noise models and two densities",
                    n["sbc_p_value"], above=0.01)),
        claim("efficient", "ours",
              "No measurement is wasted: the posterior is as narrow as the Cramér-Rao bound allows, within 5 %.",
              check("bound over variance, of the noise model that is further from 1",
                    n["efficiency_vs_cramer_rao"], Unit(digits=3), above=0.95, below=1.05)),
        claim("faults", "ours",
              "Whatever is wrong with sensors or arm, the arm keeps its limits of torque, velocity and position, and"
              " beliefs stay valid.",
              check("largest torque, by fault in the order of the table",
                    [cost["torque_of_limit"] for cost in costs], OF_LIMIT, at_most=1),
              check("largest velocity", [cost["velocity_of_limit"] for cost in costs], OF_LIMIT, at_most=1),
              check("beyond a limit of position",
                    [cost["violation_rad"] for cost in costs], Unit("mrad", 1000.0), at_most=0),
              confirm("beliefs are valid, under all faults", all(cost["beliefs_valid"] for cost in costs))),
        claim("bad_input", "ours", "Bad input is rejected in one line, with status 2 and nothing written.",
              check("malformed files that are not rejected so",
                    n["bad_inputs_tried"] - n["bad_inputs_refused"], COUNT, at_most=0),
              check("malformed files", n["bad_inputs_tried"], COUNT, at_least=500)),
        claim("kills", "ours", "A killed run, resumed, writes the same files as one that was not killed.",
              check("kills at random moments, of runs in one process and in two, after which files differ",
                    n["kills"] - n["kills_identical"], COUNT, at_most=0),
              check("kills", n["kills"], COUNT, at_least=20)),
        claim("cluster", "ours", "A cluster gives the same files, though one of its two workers is killed at work.",
              confirm("files are the same byte for byte; scheduler and workers on one machine",
                      n["cluster_identical"])),
        claim("soak", "ours", "Neither memory nor the time of a trial grows, by 10 MB or a tenth.",
              check("memory of the process, over all trials",
                    n["soak_memory_growth_MB"], Unit("MB", digits=1), below=10),
              check("time of a trial at the end over that at the beginning", n["soak_time_drift"], below=1.1),
              check("trials", n["soak_trials"], COUNT, at_least=10000)),
        claim("scaling", "ours", "Two processes are nearly twice as fast as one, by nine tenths of that.",
              check("time in one process over twice that in two, on a machine with two cores",
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
            "How often central intervals of 50, 80 and 90 % cover the truth, and what approximations cost.",
            ["observers", "50 %", "80 %", "90 %", "p of uniform ranks"],
            [
                [name, *(f"{100.0 * share:.1f} %" for share in found["coverage"]), format_number(found["p_value"], 2)]
                for name, found in n["calibration"].items()
            ],
        ),
        Table(
            "Cramér-Rao bound over the variance of the posterior.",
            ["observers", "bound over variance"],
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
