"""Blows on a nail as labelled curves, rendered pictures and a page in slow motion."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from affordance.arrays import about
from affordance.objects.tool import Tool
from affordance.reporting.blow_figures import draw_renderings
from affordance.reporting.renderings import Pose, render_close_ups, render_poses
from affordance.reporting.replay import Replay, Scene
from affordance.simulation.blow import Blow

TOUCH = np.arange(-0.002, 0.012, 2e-5)  # times kept around the first touch, [s]; longer if the nail still moves
SLOWER, SLOW_BEFORE, SLOW_AFTER = 80.0, 0.01, 0.03  # slow-motion factor; its span before and after the strike, [s]


def label_nails(blows: Sequence[Blow]) -> xr.Dataset:
    """Returns force on the nail and its travel around the strike as a labelled dataset.

    Args:
        blows: Simulated blows, one for each grip.

    Returns: ``resistance`` and ``contact``, [N], and ``travel``, [m], over grip and time since the touch, [s].
    """
    longest = max(blow.nail.time_of_rest - blow.nail.time_of_touch for blow in blows)
    times = np.arange(TOUCH[0], max(TOUCH[-1], longest - TOUCH[0]), TOUCH[1] - TOUCH[0])

    def interpolate(name: str) -> list[Any]:
        return [np.interp(times, b.nail.times - b.nail.time_of_touch, getattr(b.nail, name)) for b in blows]

    axes = ("grip", "time_since_touch")
    return xr.Dataset(
        {
            "resistance": (axes, interpolate("resistance"), about("N", "resistance of the nail")),
            "contact": (axes, interpolate("contact"), about("N", "force of the tool on the nail")),
            "travel": (axes, interpolate("travel"), about("m", "distance by which the nail was driven")),
        },
        {"time_since_touch": (axes[1:], times, about("s", "time since the tool touched the nail"))},
    )


def draw_start_and_strike(arm: Path, tool: Tool, blows: Mapping[str, Blow]) -> Figure:
    """Draws figure 9: rendered images of the start, the strike and the nail, a row for each grip."""
    held = tool.list_gripped()
    poses, close = [], []
    for grip, blow in blows.items():
        times, nail = blow.record.times, blow.nail
        row = int(np.argmin(np.abs(times - nail.time_of_touch)))
        start = Pose(held[grip], blow.strike.placement, blow.record.q[0])
        travel = float(np.interp(times[row], nail.times, nail.travel))
        strike = start._replace(q=blow.record.q[row], travel=travel)
        poses += [start, strike]
        close.append(strike)
    images = render_poses(arm, poses, width=1000, height=380)
    close_ups = render_close_ups(arm, close, width=400, height=380)
    rows = {f"held by {grip}": [*images[2 * i : 2 * i + 2], close_ups[i]] for i, grip in enumerate(blows)}
    return draw_renderings(rows, titles=["start", "strike", "the nail at the strike"])


def replay(arm: Path, tool: Tool, blows: Mapping[str, Blow]) -> Replay:
    """Builds the replay of the blows, in slow motion around the strike; one scene for each grip."""
    held = tool.list_gripped()
    scenes = []
    for grip, blow in blows.items():
        strike, times = blow.strike.time_of_strike, blow.record.times
        scenes.append(
            Scene(
                held[grip],
                times,
                blow.record.q,
                f"held by {grip}: absolute work {blow.work:.1f} J, {blow.force:.0f} N",
                placement=blow.strike.placement,
                travel=np.interp(times, blow.nail.times, blow.nail.travel),
                slow=(strike - SLOW_BEFORE, strike + SLOW_AFTER, SLOWER),
            )
        )
    return Replay(arm, f"Simulation IV: {tool.name}", scenes)
