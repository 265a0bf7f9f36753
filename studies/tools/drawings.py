"""Figures of the study of real tools."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.reporting.figures import OBJECT_COLOURS, save_figure, tidy
from affordance.reporting.formatting import fold
from affordance.reporting.renderings import Pose, render_poses
from affordance.reporting.replay import Scene, write_replay
from studies.tools.data_set import Half
from studies.tools.pictures import draw_intervals
from studies.tools.seen import Source
from studies.tools.study import Choices, ToolsResult
from studies.tools.which_end import AFTER, BEFORE, ONE_DENSITY

_SOURCE_NAMES = {
    Source.CAD: "drawing",
    Source.TWO_VIEWS: "two views",
    Source.ONE_VIEW: "one view",
    Source.ELLIPSOID: "ellipsoids",
}
_METHOD_NAMES = {
    "ours": "part densities, drawing",
    "ours_hps_parts": "part densities, the authors' parts",
    "hps": "HPS redone",
    "hps_stored": "HPS as stored",
    "geo_stored": "GEO as stored (given the true mass)",
    "ols": "least squares",
}
# Duration of slow motion before and after the strike, [s], and the factor by which time is slowed down.
_SLOW_BEFORE, _SLOW_AFTER, _SLOWER = 0.02, 0.04, 30.0
# Colours of right and wrong choices.
_RIGHT, _WRONG = "#D5EBDD", "#F6D9CC"
_BELIEF_NAMES = {BEFORE: "before", AFTER: "after", ONE_DENSITY: "one density"}
_TASK_NAMES = {"hammer": "driving a nail", "reach": "reaching"}


def save_figures(result: ToolsResult, folder: Path) -> None:
    """Draws all figures for which there are results into a folder."""
    save_figure(draw_grips(result.choices["own"]), folder, "grips")
    save_figure(draw_holding(result.choices["own"], result.config.models / ARM.name), folder, "holding")
    write_blows(result, folder / "blows.html")
    if "data set" in result.choices:
        save_figure(draw_grips(result.choices["data set"]), folder, "grips_data_set")
    if result.scores:
        save_figure(draw_first_touch(result), folder, "first_touch")
        save_figure(draw_measures(result), folder, "measures")
        save_figure(draw_records(result), folder, "records")


def write_blows(result: ToolsResult, path: Path) -> None:
    """Writes an animated page of the simulated blows, in slow motion and enlarged around the strike."""
    scenes = []
    for choices in result.choices.values():
        for checked in choices.blows:
            blow, times = checked.blow, checked.blow.record.times
            strike = blow.strike.time_of_strike
            scenes.append(
                Scene(
                    checked.held,
                    times,
                    blow.record.q,
                    f"{checked.tool}, grip {checked.grip}: {checked.work:.1f} J, {checked.force:.0f} N",
                    placement=blow.strike.placement,
                    travel=np.interp(times, blow.nail.times, blow.nail.travel),
                    slow=(strike - _SLOW_BEFORE, strike + _SLOW_AFTER, _SLOWER),
                )
            )
    write_replay(path, result.config.models / ARM.name, scenes, title="Blows with real tools")


def draw_first_touch(result: ToolsResult) -> Figure:
    """Plots masses predicted by one observer against true masses, with geometry from drawings and from two views."""
    sources = [source for source in (Source.CAD, Source.TWO_VIEWS) if source in result.config.sources]
    figure = Figure(figsize=(5.2 * len(sources), 4.8))
    all_axes = figure.subplots(1, len(sources), squeeze=False, sharex=True, sharey=True)[0]
    shown = result.predictions[0].first_touch
    for axes, source in zip(all_axes, sources, strict=True):
        for half, colour in ((Half.LEARNING, OBJECT_COLOURS[3]), (Half.TEST, OBJECT_COLOURS[0])):
            if (source, 1, half) in shown:
                predictions = shown[source, 1, half]
                true = [result.truths[name].mass for name in predictions]
                masses = np.array([each.mass for each in predictions.values()])
                label = "left out of the learning half" if half is Half.LEARNING else "test half"
                draw_intervals(axes, true, masses, colour, label, markersize=4.0, linewidth=1.0, capsize=2.0)
        low, high = 0.005, 1.5
        axes.plot([low, high], [low, high], color="#888888", linewidth=1.0, zorder=0)
        axes.set(xscale="log", yscale="log", xlim=(low, high), ylim=(low, 2.0 * high))
        axes.set_xlabel("true mass (kg)")
        axes.set_title(f"by {_SOURCE_NAMES[source]}, one hold of each learning tool", fontsize=10)
        axes.legend(frameon=False, loc="upper left", fontsize=8)
    all_axes[0].set_ylabel("mass predicted before first touch (kg)")
    tidy(*all_axes)
    return figure


def draw_measures(result: ToolsResult) -> Figure:
    """Plots the mean absolute log error of the mass for each geometry and number of holds, next to the floors."""
    halves = result.config.halves
    figure = Figure(figsize=(4.6 * len(halves) + 1.4, 3.6))
    all_axes = figure.subplots(1, len(halves), squeeze=False, sharey=True)[0]
    for axes, half in zip(all_axes, halves, strict=True):
        sources = list(dict.fromkeys(source for source, _, own in result.scores if own is half))
        holds = list(dict.fromkeys(count for _, count, own in result.scores if own is half))
        for index, count in enumerate(holds):
            values = [result.scores[source, count, half].alde for source in sources]
            places = np.arange(len(sources)) + 0.38 * (index - 0.5)
            label = f"{count} hold{'s' if count > 1 else ''} of each learning tool"
            bars = axes.bar(places, values, width=0.36, color=OBJECT_COLOURS[(3, 0)[index]], label=label)
            axes.bar_label(bars, fmt="%.2f", fontsize=8)
        ticks, names = list(range(len(sources))), [_SOURCE_NAMES[source] for source in sources]
        if half is halves[-1]:
            for name, floor in result.floors.items():
                bars = axes.bar([len(ticks)], [floor.alde], width=0.6, color="#999999")
                axes.bar_label(bars, fmt="%.2f", fontsize=8)
                ticks.append(len(ticks))
                names.append(name.replace(" ", "\n", 1))
        axes.set_xticks(ticks, names, fontsize=8)
        which = "left out of the learning half" if half is Half.LEARNING else "of the test half"
        axes.set_title(f"tools {which}", fontsize=10)
    all_axes[0].set_ylabel("mean |ln predicted / true mass|")
    all_axes[0].legend(frameon=False, fontsize=8)
    tidy(*all_axes)
    return figure


def draw_records(result: ToolsResult) -> Figure:
    """Plots errors of mass, centre of mass and inertia on the records, for each noise level and method."""
    figure = Figure(figsize=(11.0, 3.8))
    all_axes = figure.subplots(1, 3)
    noises = list(result.records)
    titles = (("mass", "mass"), ("com", "centre of mass"), ("inertia", "rotational inertia"))
    for axes, (quantity, title) in zip(all_axes, titles, strict=True):
        for index, (method, name) in enumerate(_METHOD_NAMES.items()):
            values = [100.0 * result.records[noise][method][quantity] for noise in noises]
            style = "--" if "stored" in method else "-"
            axes.plot(noises, np.maximum(values, 1e-3), f"o{style}", color=OBJECT_COLOURS[index], label=name)
        axes.set_yscale("log")
        axes.set_ylim(bottom=7e-4)
        axes.set_title(f"error of {title} (%)", fontsize=10)
        axes.set_xlabel("noise")
    handles, labels = all_axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, loc="outside lower center", ncols=3, fontsize=8)
    tidy(*all_axes)
    return figure


def draw_grips(choices: Choices) -> Figure:
    """Draws a table of the chosen grips, with whether they are right, by task, tool, geometry and belief."""
    tasks = list(dict.fromkeys(task for task, _, _ in choices.rankings))
    rows = [(task, tool.name) for task in tasks for tool in choices.tools]
    columns = [(geometry, belief) for geometry in ("drawing", "pictures") for belief in _BELIEF_NAMES]
    figure = Figure(figsize=(11.0, 0.6 + 0.5 * (len(rows) + 1)))
    axes = figure.subplots()
    axes.axis("off")
    texts, colours = [], []
    for task, tool in rows:
        right = choices.find_right(task, tool)
        chosen = [choices.rankings[task, geometry, belief].list_of(tool)[0] for geometry, belief in columns]
        hits = [each.option.grip == right for each in chosen]
        texts.append(
            [
                fold(f"{'✓' if hit else '✗'} {each.option.grip}, {each.p_best_of_tool:.2f}", 20)
                for hit, each in zip(hits, chosen, strict=True)
            ]
        )
        colours.append([_RIGHT if hit else _WRONG for hit in hits])
    table = axes.table(
        cellText=texts,
        cellColours=colours,
        cellLoc="center",
        rowLabels=[f"{tool.replace('_', ' ')}, {_TASK_NAMES[task]}" for task, tool in rows],
        colLabels=[f"by {geometry}:\n{_BELIEF_NAMES[belief]}" for geometry, belief in columns],
        bbox=Bbox.unit(),
    )
    table.auto_set_font_size(False)
    table.set_fontsize(9)
    return figure


def draw_holding(choices: Choices, directives: Path) -> Figure:
    """Renders the arm in its home posture with each tool in the correct grip for driving a nail."""
    home = load_arm(directives).home
    held = [tool.list_gripped()[choices.find_right("hammer", tool.name)] for tool in choices.tools]
    pictures = render_poses(directives, [Pose(tool, None, home) for tool in held], width=900, height=420)
    figure = Figure(figsize=(4.6 * len(held), 2.6))
    for axes, tool, picture in zip(figure.subplots(1, len(held), squeeze=False)[0], held, pictures, strict=True):
        axes.imshow(picture)
        axes.set_title(f"{tool.name}, grip {tool.grip} ({tool.mass:.2f} kg)", fontsize=10)
        axes.axis("off")
    return figure
