"""Figure of a lasting memory's beliefs about materials and objects."""

from collections.abc import Mapping

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter

from affordance.extensions.memory.summary import ExperienceSummary, MemorySummary
from affordance.objects.colour import Colour
from affordance.reporting.figures import tidy

# Height of a row, and of everything else, [inch].
_ROW, _REST = 0.3, 1.2
# Largest number of materials and of objects drawn; those met first are drawn.
_MOST = 100
# Ticks of the density axis, and its lower limit, [kg/m^3].
_TICKS, _LIGHTEST = (20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000), 10.0
# Half of the standard normal's 90 % interval.
_HALF90 = 1.645


def draw_memory(summary: MemorySummary, names: Mapping[Colour, str]) -> Figure:
    """Draws densities of materials and masses of objects, with 90 % intervals and numbers of trials."""
    left_out = [max(len(each) - _MOST, 0) for each in summary]
    summary = MemorySummary(summary.materials[:_MOST], summary.things[:_MOST])
    rows = max(len(summary.materials), len(summary.things), 1)
    figure = Figure(figsize=(11.0, _REST + _ROW * rows), layout="constrained")
    of_materials, of_things = figure.subplots(1, 2)
    for place, each in enumerate(summary.materials):
        low, high = each.interval90
        of_materials.plot([low, high], [place, place], color=each.colour, linewidth=6.0, solid_capstyle="butt")
        of_materials.plot(each.median, place, "o", color="black", markersize=4.0)
    of_materials.set_xscale("log")
    ends = [end for each in summary.materials for end in each.interval90] or [100.0, 10_000.0]
    of_materials.set_xlim(max(min(ends) / 1.5, _LIGHTEST), max(ends) * 1.5)
    of_materials.set_xticks([tick for tick in _TICKS if min(ends) / 1.5 <= tick <= max(ends) * 1.5])
    of_materials.xaxis.set_major_formatter(ScalarFormatter())
    of_materials.xaxis.set_minor_formatter(NullFormatter())
    of_materials.set_xlabel("density: median and 90 % interval (kg/m³)")
    labels = [_label(names[each.colour], each.experience) for each in summary.materials]
    of_materials.set_yticks(range(len(labels)), labels)
    for place, thing in enumerate(summary.things):
        low, high = thing.mass - _HALF90 * thing.mass_sd, thing.mass + _HALF90 * thing.mass_sd
        of_things.plot([max(low, 0.0), high], [place, place], color="0.6", linewidth=6.0, solid_capstyle="butt")
        of_things.plot(thing.mass, place, "o", color="black", markersize=4.0)
    of_things.set_xlim(left=0.0)
    of_things.set_xlabel("mass: mean and 90 % interval (kg)")
    labels = [_label(each.name, each.experience) for each in summary.things]
    of_things.set_yticks(range(len(labels)), labels)
    for axes in (of_materials, of_things):
        axes.set_ylim(rows - 0.5, -0.5)
    for axes, number in zip((of_materials, of_things), left_out, strict=True):
        if number:
            axes.set_title(f"the first {_MOST}; {number} more are not drawn")
    tidy(of_materials, of_things)
    return figure


def _label(name: str, experience: ExperienceSummary) -> str:
    return f"{name} ({experience.trials})"
