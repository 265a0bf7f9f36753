"""Report of the study of the loop: right choices, regret and coverage on each robot, and the memory."""

from collections.abc import Mapping
from typing import Any

from affordance.reporting.claims import ClaimResult, Unit, check, claim
from affordance.reporting.section import ReportFigure, Section, Table


def describe(numbers: Mapping[str, Any]) -> Section:
    """Describes the results of all robots."""
    header = ["robot", "compared by", "right before", "after 1", "after 2", "after 5"]
    header += ["regret before (%)", "after 1", "after 2", "after 5", "right if known", "recordings learned from"]
    header += ["own objects' masses within their 90 % intervals", "the five tools' masses"]
    rows = [
        [
            name.replace("_", " "),
            each["by"],
            *(f"{share:.2f}" for share in each["right"].values()),
            *(f"{100.0 * regret:.2f}" for regret in each["regret"].values()),
            *(f"{each[key]:.2f}" for key in ("right_if_known", "taught", "coverage_mass", "coverage_tools")),
        ]
        for name, each in numbers["robots"].items()
    ]
    caption = "Right choices and regret over both tasks, for the criterion in which options differ most."
    return Section(
        order=34,
        title="From recordings of stock to the choice of a tool",
        summary=(
            "Observers on imported robots record five pieces of stock, one after the other, with the errors of"
            " real signals. They identify each piece, and store the result in a lasting memory. Before the first"
            " piece and after one, two and five they choose among the grips of three hammers, and for reaching also"
            " among those of two kitchen tools; all tools are seen in pictures. A choice is right if no usable option"
            " costs less with the true inertias. Costs are those of the planned motions. All observers see the same"
            " pictures of the tools: repeated pictures differ by 2 % of a volume, and their common error is larger."
            " The column 'right if known' is for an observer that knows materials exactly, but neither how a tool"
            " deviates from them nor the error of its picture. The share of predicted masses within their intervals"
            " is counted over four objects of each observer's own: a hammer, a mallet, a pan, and a beaker, stamper"
            " or rolling pin of random sizes."
        ),
        figures=[
            ReportFigure(
                file="loop.png",
                caption=(
                    "Right choices, with 95 % intervals, and mean regret against the number of pieces held before,"
                    " for each task, by absolute work and by the wrench that the gripper must hold."
                ),
            )
        ],
        claims=judge(numbers),
        tables=[Table(caption, header, rows)],
        remarks=[],
    )


def judge(n: Mapping[str, Any]) -> list[ClaimResult]:
    """Judges the claims."""
    return [
        claim("right", "ours",
              "On every robot 95 % of choices are right after five pieces, or at most 1 % of the least cost is lost.",
              check("share of robots", n["settled"], at_least=1)),
        claim("regret", "ours", "Regret is never larger with experience than without.",
              check("largest difference of regret, with experience minus without", n["largest_rise"], at_most=0)),
        claim("coverage", "ours",
              "90 % intervals of the predicted masses of an observer's own objects have the stated coverage.",
              check("least coverage", n["least_coverage"], at_least=0.83),
              check("largest coverage", n["largest_coverage"], at_most=0.97)),
        claim("memory", "ours", "The memory answers within seconds, loses no trial and counts none twice.",
              check("recall from 100000 trials", n["recall_s_1e5"], Unit("s"), at_most=10),
              check("trials lost", n["lost"], at_most=0),
              check("trials counted twice", n["double"], at_most=0),
              check("relative error after forgetting", n["forget_error"], at_most=1e-9)),
    ]  # fmt: skip
