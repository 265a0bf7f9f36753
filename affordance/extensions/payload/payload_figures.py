"""Plots the fit and the posterior of an identified payload."""

import numpy as np
from matplotlib.figure import Figure

from affordance.extensions.payload.evidence.joint_statistics import SIGNAL
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief, describe_bodies
from affordance.extensions.payload.posterior.payload_fit import PayloadFit
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.formatting import label

_MODEL, _MEASURED, _RESIDUAL = OBJECT_COLOURS[2], "#999999", OBJECT_COLOURS[0]
_LABELS = (
    "mass (kg)",
    "centre of mass x (cm)",
    "y (cm)",
    "z (cm)",
    "I xx (kg cm²)",
    "I yy (kg cm²)",
    "I zz (kg cm²)",
    "I xy (kg cm²)",
    "I xz (kg cm²)",
    "I yz (kg cm²)",
)
_SCALES = np.array([1.0, 1e2, 1e2, 1e2, *[1e4] * 6])


def draw_fit(fit: PayloadFit) -> Figure:
    """Plots the load's contribution to each channel, the fit, and the residual, over time or postures."""
    evidence = fit.evidence
    z = evidence.samples.build_columns()  # (C, N, 27)
    residual = np.einsum("cni,ci->nc", z, fit.weights)
    measured = z[:, :, SIGNAL].T
    num = len(evidence.channel_names)
    figure = Figure(figsize=(12.0, 1.5 + 1.25 * num))
    axes = figure.subplots(num, 2, sharex=True, squeeze=False, width_ratios=(2, 1))
    times, along = evidence.prepared.times - evidence.prepared.times[0], "time (s)"
    line, mark = "-", ""
    if evidence.is_at_rest:  # each posture is one sample, so there is no time axis
        times, along, line, mark = np.arange(1.0, len(times) + 1.0), "posture", "", "o"
    for j, name in enumerate(evidence.channel_names):
        used = evidence.samples.used[:, j]
        gaps = np.where(used, 1.0, np.nan)
        left, right = axes[j]
        left.plot(
            times,
            gaps * measured[:, j],
            color=_MEASURED,
            linestyle=line,
            marker=mark,
            linewidth=2.2,
            label="measured",
        )
        left.plot(
            times,
            gaps * (measured - residual)[:, j],
            color=_MODEL,
            linestyle=line,
            marker=mark and "x",
            linewidth=1.0,
            label="fitted payload",
        )
        right.plot(times, gaps * residual[:, j], color=_RESIDUAL, linestyle=line, marker=mark, linewidth=0.8)
        right.axhline(0.0, color="#000000", linewidth=0.6, linestyle=":")
        left.set_ylabel(f"{label(name)}\n({evidence.kind.unit})", fontsize=8)
        right.set_ylim(*(np.array([-1.1, 1.1]) * max(np.abs(residual[used, j]).max(initial=0.0), 1e-9)))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=2)
    axes[0, 0].set_title("Contribution of the load to the signal, and the fit", fontsize=FONT_SIZE)
    axes[0, 1].set_title("Residual", fontsize=FONT_SIZE)
    for column in axes[-1]:
        column.set_xlabel(along)
    tidy(*axes.ravel())
    return figure


def draw_posteriors(belief: PayloadBelief) -> Figure:
    """Plots posterior and prior marginals of mass, centre of mass and moments.

    The reference mass is marked if there is one.
    """
    figure = Figure(figsize=(12.0, 5.2))
    axes = figure.subplots(2, 5).ravel()
    after = describe_bodies(belief.bodies.pi) * _SCALES
    before = describe_bodies(belief.prior_bodies) * _SCALES
    for i, (axis, quantity) in enumerate(zip(axes, _LABELS, strict=True)):
        interval = np.array([belief.marginals.low90[i], belief.marginals.high90[i]]) * _SCALES[i]
        margin = np.ptp(interval) + 1e-12
        edges = np.linspace(interval[0] - margin, interval[1] + margin, 41)
        # The prior is normalised over its whole range, so that the height shows how much of it is in the plotted
        # range.
        share = np.full(len(before), 1.0 / (len(before) * (edges[1] - edges[0])))
        axis.hist(before[:, i], edges, weights=share, color="#cccccc", label="before the run")
        axis.hist(
            after[:, i],
            edges,
            weights=belief.bodies.weights,
            density=True,
            histtype="step",
            color=OBJECT_COLOURS[0],
            linewidth=1.4,
            label="after",
        )
        axis.axvspan(*interval, color=OBJECT_COLOURS[0], alpha=0.12, label="90 % interval")
        if i == 0 and belief.reference_mass is not None:
            axis.axvline(belief.reference_mass, color=OBJECT_COLOURS[2], label="weighed")
        axis.set_xlabel(quantity, fontsize=9)
        axis.tick_params(labelsize=7)
        axis.set_yticks([])
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, loc="outside lower center", ncols=4)
    tidy(*axes)
    return figure
