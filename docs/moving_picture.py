"""Draws the moving picture of README: ``make picture``.

One observer of Simulation I holds four brass rods and a decoy, one after the other. The picture shows the arm, two
and a half times slower, and what the observer believes about the density of brass.
"""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from scipy.stats import norm

from affordance import MODELS, TrialRunner, load_tools
from affordance.arrays import Array
from affordance.objects.tool import Tool
from affordance.reporting.renderings import Image, Pose, render_poses

PICTURE = Path(__file__).parent / "images" / "weight.gif"
# The observer of the example in README.
SEED = 2
_DURATION, _SHOWN = 3.0, 1.0  # of a hold, and what is shown of it, [s]
_SLOWER, _RATE, _PAUSE = 2.5, 8, 0.8  # slow motion, frames per second, pause after each object, [s]
_BATCH = 6  # poses that a process renders
_WIDTH, _HEIGHT = 430, 260  # of the arm, [pixels]


class Hold(NamedTuple):
    """An object that is held: heights of its centre and joint angles over time, and quartiles of brass afterwards."""

    tool: Tool
    times: Array
    heights: Array
    q: Array
    brass: tuple[float, float]


def hold_objects() -> list[Hold]:
    """Holds the objects of Simulation I in turn."""
    runner = TrialRunner()
    memory, held = runner.start_memory(), []
    for trial, tool in enumerate(load_tools(MODELS / "tools" / "weight.yaml")):
        record = runner.run_hold(tool, memory, duration=_DURATION, seed=(SEED, trial))
        memory = record.memory
        brass = memory.density("brass")
        held.append(Hold(tool, record.times, record.height_centre, record.q, (brass.mean, brass.sd)))
    return held


def render_batch(poses: list[Pose]) -> list[Image]:
    """Renders the arm in some poses."""
    return render_poses(MODELS / "arm.dmd.yaml", poses, width=_WIDTH, height=_HEIGHT)


def render(held: list[Hold], times: Array) -> list[list[Image]]:
    """Renders the arm with each object at the times.

    The lowest and the highest pose are in every batch, so that the camera stays the same. Each batch has a process
    of its own, because renderers are never freed and too many of them end the process.
    """
    poses = [
        Pose(each.tool, None, np.array([np.interp(time, each.times, q) for q in each.q.T]))
        for each in held
        for time in times
    ]
    highest = int(np.argmax(np.interp(times, held[-1].times, held[-1].heights)))
    count = len(times)
    extremes = [poses[count - 1], poses[-count], poses[highest - count]]
    batches = [extremes + poses[k : k + _BATCH] for k in range(0, len(poses), _BATCH)]
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context, max_tasks_per_child=1) as pool:
        pictures = [picture for batch in pool.map(render_batch, batches) for picture in batch[len(extremes) :]]
    return [pictures[k : k + count] for k in range(0, len(pictures), count)]


def draw(path: Path) -> None:
    """Draws the picture."""
    held = hold_objects()
    times = np.linspace(0.0, _SHOWN, round(_SHOWN * _SLOWER * _RATE) + 1)
    pictures = render(held, times)
    figure = Figure(figsize=(7.2, 3.1), dpi=100)
    arm, belief = figure.add_axes((0.0, 0.0, 0.6, 0.86)), figure.add_axes((0.65, 0.17, 0.33, 0.62))
    arm.set_axis_off()
    image = arm.imshow(pictures[0][0])
    title = figure.text(0.02, 0.92, "", fontsize=11)
    moved = arm.text(0.03, 0.06, "", transform=arm.transAxes, fontsize=11)
    density = np.linspace(0.0, 12.0, 241)
    belief.set(xlim=(0, 12), ylim=(0, 1.5), yticks=[], xlabel="density of brass (g/cm³)")
    belief.set_title("what it believes", fontsize=10)
    belief.spines[["top", "right", "left"]].set_visible(False)
    belief.axvline(8.5, color="0.5", linestyle="--", linewidth=1.0)
    (curve,) = belief.plot([], [], color="#a07010", linewidth=2.0)
    still = round(_PAUSE * _RATE)
    prior = (1.0, 4.0)

    def show(frame: int) -> list[Artist]:
        index, step = divmod(frame, len(times) + still)
        each, k = held[index], min(step, len(times) - 1)
        image.set_data(pictures[index][k])
        (part,) = each.tool.components
        what = "looks like brass, is made of wood" if part.material != part.looks_like else f"brass rod {index + 1}"
        title.set_text(f"{what}, {each.tool.mass:.2f} kg")
        height = 100.0 * float(np.interp(times[k], each.times, each.heights))
        moved.set_text(f"{height:+.0f} cm" if abs(height) > 0.5 else "")
        # The belief before the hold while it lasts, and after it what was learned.
        before = tuple(value / 1000.0 for value in held[index - 1].brass) if index else prior
        mean, sd = before if step < len(times) else tuple(value / 1000.0 for value in each.brass)
        curve.set_data(density, norm.pdf(density, mean, sd))
        return [image, title, moved, curve]

    path.parent.mkdir(parents=True, exist_ok=True)
    frames = len(held) * (len(times) + still)
    FuncAnimation(figure, show, frames=frames, blit=False).save(path, writer=PillowWriter(fps=_RATE))


if __name__ == "__main__":
    draw(PICTURE)
    print(f"{PICTURE}: {PICTURE.stat().st_size / 1000:.0f} kB")
