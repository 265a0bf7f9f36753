"""Report of the study of calibration."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binom

from affordance.reporting.claims import ClaimResult, Unit, check, claim
from affordance.reporting.figures import OBJECT_COLOURS, tidy
from affordance.reporting.formatting import format_number
from affordance.reporting.section import ReportFigure, Section, Table
from studies.calibration.calibration import COVERAGES, NUM_BINS, Calibration

# Probability that a bin of a uniform rank histogram is within the band.
_BAND = 0.99
_FONT_SIZE = 9


def describe(numbers: Mapping[str, Any]) -> Section:
    """Describes the results with a figure, claims and tables."""
    caption = (
        "Ranks of true densities in their posteriors; they are uniform if all is right. Above each histogram: the"
        " p-value of the test, and how often central intervals cover the true density."
    )
    return Section(
        order=9,
        title="Calibration",
        summary=(
            f"{numbers['sbc_draws']} pairs of densities are drawn from the prior, and each is held once with each of"
            f" two noise models; {numbers['sensing_observers']} observers choose the grip of Simulation III with"
            " other errors of measurement."
        ),
        figures=[ReportFigure(file="ranks.png", caption=caption)],
        claims=judge(numbers),
        tables=_list_tables(numbers),
        remarks=[],
    )


def judge(n: Mapping[str, Any]) -> list[ClaimResult]:
    """Tests the claims."""
    return [
        claim("calibrated", "ours",
              "Observers are as uncertain as they should be: ranks of true densities in posteriors are uniform.",
              check("p of the test of uniform ranks, Bonferroni-corrected for two noise models and two densities",
                    n["sbc_p_value"], above=0.01)),
        claim("efficient", "ours",
              "No measurement is wasted: the posterior is as narrow as the Cramér-Rao bound allows, within 5 %.",
              check("bound divided by variance, for the noise model that is further from 1",
                    n["efficiency_vs_cramer_rao"], Unit(digits=3), above=0.95, below=1.05)),
    ]  # fmt: skip


def _list_tables(n: Mapping[str, Any]) -> list[Table]:
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
            "Share of correct choices of a grip for reaching, with other errors of measurement.",
            ["errors", "after one trial", "after two"],
            [
                [name.replace("_", " "), *(f"{correct[moment]:.3f}" for moment in (1, 2))]
                for name, correct in n["p_correct_by_sensing"].items()
            ],
        ),
    ]


def draw_ranks(calibrations: Mapping[str, Calibration], names: Sequence[str]) -> Figure:
    """Plots rank histograms of true densities, with the band for uniform ranks."""
    figure = Figure(figsize=(12.0, 3.0 * ((len(calibrations) + 2) // 3)))
    all_axes = figure.subplots((len(calibrations) + 2) // 3, 3, sharex=True, sharey=True)
    for axes, (name, found) in zip(all_axes.flat, calibrations.items(), strict=False):
        count = len(found.positions)
        low, high = (binom.ppf(0.5 + side * 0.5 * _BAND, count, 1.0 / NUM_BINS) for side in (-1.0, 1.0))
        axes.axhspan(low, high, color="#dddddd", zorder=0)
        axes.axhline(count / NUM_BINS, color="#000000", linewidth=0.8, linestyle=":")
        for k, positions in enumerate(found.positions.T):
            heights, edges = np.histogram(positions, NUM_BINS, (0.0, 1.0))
            axes.stairs(heights, edges, color=OBJECT_COLOURS[k], linewidth=1.4, label=names[k])
        said, covered = (
            ", ".join(f"{100 * share:.{digits}f}" for share in shares)
            for shares, digits in ((COVERAGES, 0), (found.coverage, 1))
        )
        axes.set_title(f"{name}\ncorrected p = {found.p_value:.2g}; {said} % cover {covered}", fontsize=_FONT_SIZE)
        tidy(axes)
    for axes in all_axes[-1]:
        axes.set_xlabel("rank of the true density in the posterior")
    for row in all_axes:
        row[0].set_ylabel("draws")
    all_axes.flat[0].legend(frameon=False, fontsize=_FONT_SIZE, title=f"grey: {100 * _BAND:.0f} % of uniform ranks")
    return figure
