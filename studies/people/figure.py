"""Figure of the fit of kappa to human data."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from affordance.extensions.people.experiments.linear import GROUPS
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from studies.people.fit import THRESHOLD, Fraction, KappaFit


def draw_kappa_fit(fit: KappaFit, people: Sequence[Fraction], title: str) -> Figure:
    """Plots simulated and human learned fractions against kappa for each group, and the likelihood of kappa."""
    figure = Figure(figsize=(9.0, 3.9))
    left, right = figure.subplots(1, 2)
    for column, (group, found, colour) in enumerate(zip(GROUPS.values(), people, OBJECT_COLOURS, strict=False)):
        mean, error = fit.fractions[:, column], 1.96 * fit.fraction_ses[:, column]
        left.errorbar(fit.kappas, mean, error, fmt="o-", color=colour, markersize=4.0, capsize=2.0, label=group.name)
        left.axhline(found.mean, color=colour, linewidth=1.0, linestyle="--")
        left.axhspan(found.low, found.high, color=colour, alpha=0.12, linewidth=0.0)
    left.set(xlabel="kappa, breadth of a category over its mean", ylabel="learned fraction f")
    left.set_title("Simulated; people dashed, with 95 % interval", fontsize=FONT_SIZE)
    left.legend(frameon=False)
    right.plot(fit.grid, fit.log_likelihood, color="#000000", linewidth=1.6)
    right.axhline(THRESHOLD, color="#000000", linewidth=0.8, linestyle=":")
    right.axvline(fit.kappa, color="#000000", linewidth=0.8, linestyle="--")
    for axes in (left, right):
        axes.axvspan(fit.low, fit.high, color="#888888", alpha=0.15, linewidth=0.0)
    right.set(
        ylim=(max(-8.0, float(fit.log_likelihood.min()) - 0.5), 0.5),
        xlabel="kappa",
        ylabel="log likelihood minus its maximum",
    )
    right.set_title(f"kappa = {fit.kappa:.3f}, 95 % interval {fit.low:.3f} to {fit.high:.3f}", fontsize=FONT_SIZE)
    figure.suptitle(title, fontsize=FONT_SIZE + 1)
    tidy(left, right)
    return figure
