"""Memory of a learner with kinds, in numbers and as a figure: kinds, objects and probabilities."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from affordance.belief.kind_memory import KindMemory
from affordance.belief.kinds import KnownObject
from affordance.objects.appearance import Appearance
from affordance.objects.colour import Colour
from affordance.reporting.figures import FONT_SIZE, tidy

_BLACK = "#000000"


class ObjectSummary(NamedTuple):
    """Summary of an object in one of its colours."""

    appearance: Appearance  # appearance of the object
    probability: float  # probability of its kind after its last lift
    num_lifts: int  # number of consecutive last lifts in which it was of this kind
    density: float  # mean of the belief about its density, [kg/m^3]
    sd: float  # standard deviation of the belief about its density, [kg/m^3]
    has_own: bool  # true if it has a density of its own, false if it has that of its kind


class KindSummary(NamedTuple):
    """Summary of a kind."""

    colour: Colour  # red, green and blue in [0, 1]
    density: float  # mean of the belief about its mean density, [kg/m^3]
    sd: float  # standard deviation of the belief about its mean density, [kg/m^3]
    is_most_populous: bool  # true if new objects of this colour are believed to be of this kind
    objects: tuple[ObjectSummary, ...]  # objects of the kind


def summarise_kinds(memory: KindMemory) -> tuple[KindSummary, ...]:
    """Lists the kinds, colour by colour, each with its objects."""
    kinds, belief = memory.kinds, memory.kinds.belief
    summaries = []
    for index, colour in enumerate(memory.colours):
        for kind in kinds.list_of(index):
            density, sd = float(belief.untruncated_mean[kind]), float(np.sqrt(belief.covariance[kind, kind]))
            objects = [
                _summarise_object(known, column, density, sd)
                for known in kinds.objects
                for column, membership in enumerate(known.memberships)
                if membership.kind == kind
            ]
            is_most_populous = kind == kinds.find_most_populous(index)
            summaries.append(KindSummary(colour, density, sd, is_most_populous, tuple(objects)))
    return tuple(summaries)


def _summarise_object(known: KnownObject, column: int, density: float, sd: float) -> ObjectSummary:
    has_own = column in known.own.columns
    if has_own:
        place = known.own.columns.index(column)
        density = float(known.own.belief.untruncated_mean[place])
        sd = float(np.sqrt(known.own.belief.covariance[place, place]))
    membership = known.memberships[column]
    return ObjectSummary(known.appearance, membership.probability, membership.num_lifts, density, sd, has_own)


def draw_kinds(kinds: Sequence[KindSummary], *, title: str) -> Figure:
    """Draws each kind, of at least one, as a bar of mean ± 2 standard deviations, with its objects below.

    A filled marker is an object's own density, an open one that of its kind. The label gives the object's length, the
    number of times it was lifted as a member of the kind, and its probability of membership.
    """
    heights = [1 + len(kind.objects) for kind in kinds]
    figure = Figure(figsize=(8.0, 1.2 + 0.28 * (sum(heights) + len(kinds))))
    axes = figure.subplots()
    row, ticks, labels = 0.0, [], []
    for number, kind in enumerate(kinds, start=1):
        width = max(4.0 * kind.sd, 1.0)
        axes.barh(row, width, left=kind.density - 2.0 * kind.sd, color=kind.colour, edgecolor=_BLACK, height=0.7)
        axes.plot([kind.density, kind.density], [row - 0.35, row + 0.35], color=_BLACK, linewidth=1.4)
        ticks.append(row)
        most = ", most populous" if kind.is_most_populous else ""
        labels.append(f"kind {number}{most}\n{kind.density:.0f} ± {kind.sd:.0f} kg/m³")
        for known in kind.objects:
            row += 1.0
            face = kind.colour if known.has_own else "none"
            spread = 2.0 * known.sd if known.has_own else 0.0
            error = spread or None
            axes.errorbar(known.density, row, xerr=error, fmt="o", color=_BLACK, markerfacecolor=face, capsize=2.0)
            length = 200.0 * max(max(part.sizes) for part in known.appearance)
            lifts = f"{known.num_lifts} lift{'' if known.num_lifts == 1 else 's'}"
            axes.annotate(
                f"object {length:.0f} cm long, {lifts}, p = {known.probability:.3f}",
                (known.density + spread, row),
                xytext=(9, 0),
                textcoords="offset points",
                va="center",
                fontsize=FONT_SIZE - 2,
            )
        row += 1.6
    axes.set_yticks(ticks, labels)
    axes.invert_yaxis()
    axes.set(
        xlabel="density believed (kg/m³), with two standard deviations",
        xlim=(0.0, 1.45 * max(float(np.max([kind.density + 2.0 * kind.sd for kind in kinds])), 1.0)),
    )
    axes.set_title(title, fontsize=FONT_SIZE)
    tidy(axes)
    return figure
