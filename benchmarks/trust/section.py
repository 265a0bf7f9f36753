"""What the studies of trust and scale found, as a section of the report."""

from collections.abc import Mapping
from typing import Any

from affordance.reporting.report import Claim, Picture, Section
from benchmarks.trust import calibration


def describe(numbers: Mapping[str, Any]) -> Section:
    """Puts the numbers of all studies into a section of the report."""
    draws = numbers["sbc_draws"]
    exact, ignored = (numbers["calibration"][name] for name in (calibration.EXACT, calibration.IGNORING))
    coverage = [numbers[f"coverage{round(100 * said)}"] for said in calibration.COVERAGES]
    none, programs = numbers["faults"]["none"], numbers["program"]
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
            "bound over variance "
            + ", ".join(f"{numbers['efficiency'][name]:.3f} ({name})" for name in calibration.LOOPS),
        ),
        *(
            Claim(
                "ours",
                f"Fault '{name}': the arm keeps its limits of torque, rate and angle, and beliefs stay valid.",
                bool(
                    cost["beliefs_valid"]
                    and cost["torque_of_limit"] <= 1.0
                    and cost["rate_of_limit"] <= 1.0
                    and cost["overstep_rad"] == 0.0
                ),
                f"density error {100 * cost['density_error']:.0f} % (without {100 * none['density_error']:.0f}), "
                f"right choices after one trial {cost['p_correct'][1]:.2f} ({none['p_correct'][1]:.2f}), after six "
                f"{cost['p_correct'][-1]:.2f} ({none['p_correct'][-1]:.2f}); {100 * cost['samples_rejected']:.0f} % "
                f"of samples refused, {100 * cost['trials_surprising']:.0f} % of trials flagged; at most "
                f"{100 * cost['torque_of_limit']:.0f} % of a torque limit, {100 * cost['rate_of_limit']:.0f} % of "
                f"one of rate, {1e3 * cost['overstep_rad']:.2f} mrad beyond one of angle",
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
            f"{numbers['kills_identical']} of {numbers['kills']} kills at random moments, of runs in one process "
            "and in two",
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
        Claim(
            "ours",
            "Two processes are nearly twice as fast as one (by nine tenths of that).",
            bool(numbers["parallel_efficiency_2"] > 0.9),
            f"{2.0 * numbers['parallel_efficiency_2']:.2f} times as fast, on a machine with two cores",
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
            Picture("faults.png", "What each fault costs; the densities' error is the median after six trials."),
            Picture("soak.png", "Memory, and processor time of a trial, over the trials of one process."),
            Picture("scaling.png", "How the cost grows, from one run."),
        ],
        claims=claims,
        differences=[]
        if len(set(programs.values())) == 1
        else [
            "These studies are not of one state of the program: "
            + ", ".join(f"{study} of {program}" for study, program in programs.items())
            + "."
        ],
    )
