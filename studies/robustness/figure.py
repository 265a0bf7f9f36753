"""Figure of the multiverse: fraction of settings in which each claim holds, and important assumptions."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.reporting.figures import OBJECT_COLOURS, tidy
from affordance.reporting.statistics import Estimate

_ROW_HEIGHT, _HEAD = 0.28, 3.0  # [inch]
_WIDTH = 11.0


def draw_multiverse(
    claims: Sequence[str], assumptions: Sequence[str], *, shares: Estimate, indices: Array, null_levels: Array
) -> Figure:
    """Plots the fraction of settings in which C claims hold, and first-order indices of D assumptions, (C, D).

    Indices up to the null level of a claim, (C,), are white. Assumptions with only such indices are left out, unless
    none would remain.
    """
    above = indices > null_levels[:, None]
    drawn = above.any(axis=0) | ~above.any()
    assumptions = [name for name, is_drawn in zip(assumptions, drawn, strict=True) if is_drawn]
    shown = np.where(above, indices, np.nan)[:, drawn]
    rows = np.arange(len(claims))
    figure = Figure(figsize=(_WIDTH, _HEAD + _ROW_HEIGHT * len(claims)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=[1.0, 2.0])
    errors = np.abs(np.array([shares.low, shares.high]) - shares.mean)
    left.barh(rows, shares.mean, xerr=errors, color=OBJECT_COLOURS[3], ecolor="0.3", capsize=2.0)
    left.set_yticks(rows, claims)
    left.set(xlim=(0.0, 1.0), xlabel="share of settings in which it holds")
    left.invert_yaxis()
    tidy(left)
    largest = float(np.nanmax(shown)) if above.any() else 1.0
    image = right.imshow(shown, aspect="auto", cmap="viridis_r", vmin=0.0, vmax=largest)
    right.set_xticks(np.arange(len(assumptions)), assumptions, rotation=90)
    right.tick_params(axis="y", labelleft=False)
    right.set_xticks(np.arange(len(assumptions)) - 0.5, minor=True)
    right.set_yticks(rows - 0.5, minor=True)
    right.grid(which="minor", color="0.9", linewidth=0.5)
    right.tick_params(which="minor", length=0)
    bar = figure.colorbar(image, ax=right, shrink=0.6)
    bar.set_label("share of the variance that the assumption alone explains\n(white: no more than chance)")
    return figure
