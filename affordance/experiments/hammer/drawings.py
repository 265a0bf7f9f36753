"""Figures, trajectories and replay of the blows of Simulation IV."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from affordance.files.netcdf import LabelledArray
from affordance.objects.tool import Tool
from affordance.reporting.blow_figures import draw_renderings
from affordance.reporting.renderings import Pose, render_close_ups, render_poses
from affordance.reporting.replay import Scene, write_replay
from affordance.simulation.blow import Blow

# Time span saved around the first touch, and its step: driving takes 5 ms, or longer with a heavier arm, [s].
_KEPT_FROM, _KEPT_TO, _KEPT_STEP = -0.002, 0.012, 2e-5
# Factor of slow motion, and its span before and after the strike: driving takes 5 ms, [s].
_SLOWER, _SLOW_BEFORE, _SLOW_AFTER = 80.0, 0.01, 0.03


def draw_start_and_strike(arm: Path, tool: Tool, blows: Mapping[str, Blow]) -> Figure:
    """Draws figure 9, rendered: the start and the strike with each grip of a tool, and the nail."""
    held = tool.list_gripped()
    poses, close = [], []
    for grip, blow in blows.items():
        row = int(np.argmin(np.abs(blow.record.times - blow.nail.time_of_touch)))
        start = Pose(held[grip], blow.strike.placement, blow.record.q[0])
        strike = start._replace(
            q=blow.record.q[row], travel=float(np.interp(blow.record.times[row], blow.nail.times, blow.nail.travel))
        )
        poses += [start, strike]
        close.append(strike)
    images = render_poses(arm, poses, width=1000, height=380)
    close_ups = render_close_ups(arm, close, width=400, height=380)
    rows = {f"held by {grip}": [*images[2 * i : 2 * i + 2], close_ups[i]] for i, grip in enumerate(blows)}
    return draw_renderings(rows, titles=["start", "strike", "the nail at the strike"])


def label_blows(blows: Sequence[Blow]) -> dict[str, LabelledArray]:
    """Labels the motion of the nail."""
    longest = max(blow.nail.time_of_rest - blow.nail.time_of_touch for blow in blows)
    times = np.arange(_KEPT_FROM, max(_KEPT_TO, longest - _KEPT_FROM), _KEPT_STEP)
    nails = {
        name: LabelledArray(
            ("trial", "time_since_touch"),
            np.stack([np.interp(times, b.nail.times - b.nail.time_of_touch, getattr(b.nail, name)) for b in blows]),
            unit,
            meaning,
        )
        for name, unit, meaning in (
            ("resistance", "N", "resistance of the nail"),
            ("contact", "N", "force of the tool on the nail"),
            ("travel", "m", "how far the nail was driven"),
        )
    }
    return {
        **nails,
        "time_since_touch": LabelledArray(("time_since_touch",), times, "s", "time since the tool touched the nail"),
    }


def write_slow_replay(path: Path, arm: Path, tool: Tool, blows: Mapping[str, Blow]) -> None:
    """Writes the blow with each grip of a tool, in slow motion around the strike."""
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
                slow=(strike - _SLOW_BEFORE, strike + _SLOW_AFTER, _SLOWER),
            )
        )
    write_replay(path, arm, scenes, title=f"Simulation IV: {tool.name}")
