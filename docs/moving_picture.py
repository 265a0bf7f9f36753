"""Draws the moving picture of README: ``make picture``.

One observer of Simulation I holds five objects, one after the other; the picture shows their heights side by side,
without the arm, as simulated, to scale and three times slower.
"""

from pathlib import Path

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from matplotlib.text import Text

from affordance import MODELS, TrialRunner, load_tools
from affordance.arrays import Array
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Tool

PICTURE = Path(__file__).parent / "images" / "weight.gif"
_DURATION, _SHOWN = 3.0, 1.0  # of a hold, and what is shown of it, [s]
_SLOWER, _RATE, _PAUSE = 3, 15, 2.0  # slow motion, frames a second, still at the end, [s]
_STEP = 0.30  # between objects, [m]
_LOW, _HIGH = -0.28, 0.29  # of what is shown, [m]


def hold_objects() -> list[tuple[Tool, Array, Array]]:
    """Holds the objects of Simulation I in turn; each with times and heights of its centre."""
    runner = TrialRunner()
    memory, held = runner.start_memory(), []
    for trial, tool in enumerate(load_tools(MODELS / "tools" / "weight.yaml")):
        record = runner.run_hold(tool, memory, duration=_DURATION, seed=(0, trial))
        memory = record.memory
        held.append((tool, record.times, record.height_centre))
    return held


def draw(path: Path) -> None:
    """Draws the picture."""
    held = hold_objects()
    times = np.linspace(0.0, _SHOWN, round(_SHOWN * _SLOWER * _RATE) + 1)
    heights = np.array([np.interp(times, own_times, height) for _, own_times, height in held])
    figure = Figure(figsize=(8.4, 3.0), dpi=90, layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(-0.5 * _STEP, (len(held) - 0.44) * _STEP), ylim=(_LOW, _HIGH), aspect="equal", xticks=[])
    axes.set_yticks([-0.2, -0.1, 0.0, 0.1], ["-20 cm", "-10 cm", "0", "+10 cm"])
    axes.spines[["top", "right", "bottom"]].set_visible(False)
    axes.axhline(0.0, color="0.75", linewidth=0.8, zorder=0)
    rods, texts = [], []
    for i, (tool, _, _) in enumerate(held):
        (part,) = tool.components
        is_decoy = part.material != part.looks_like
        assert isinstance(part.shape, Ellipsoid)
        length, _, thickness = 2.0 * np.asarray(part.shape.semi_axes)
        rod = Ellipse((i * _STEP, 0.0), length, thickness, facecolor=part.looks_like.colour, edgecolor="0.2")
        axes.add_patch(rod)
        rods.append(rod)
        texts.append(axes.text(i * _STEP, 0.0, "", ha="center", fontsize=10))
        what = "looks the same, is wood" if is_decoy else f"brass, object {i + 1}"
        axes.text(i * _STEP, _HIGH - 0.08, what, ha="center", va="top", fontsize=9)
        axes.text(i * _STEP, _HIGH - 0.12, f"{tool.mass:.2f} kg", ha="center", va="top", fontsize=9, color="0.4")
    clock = axes.text(-0.48 * _STEP, _HIGH - 0.01, "", va="top", fontsize=9, color="0.4")

    def show(frame: int) -> list[Ellipse | Text]:
        k = min(frame, len(times) - 1)
        for rod, text, height in zip(rods, texts, heights[:, k], strict=True):
            rod.center = (rod.center[0], height)
            text.set_text(f"{100.0 * height:+.0f} cm" if abs(height) > 0.005 else "")
            text.set_y(height - 0.045)
        clock.set_text(
            f"Heights of five objects, side by side, three times slower; {times[k]:.1f} s after the hold begins"
        )
        return [*rods, *texts, clock]

    figure.draw_without_rendering()  # the layout of the first frame, as of all others
    frames = len(times) + round(_PAUSE * _RATE)
    path.parent.mkdir(parents=True, exist_ok=True)
    FuncAnimation(figure, show, frames=frames, blit=False).save(path, writer=PillowWriter(fps=_RATE))


if __name__ == "__main__":
    draw(PICTURE)
    print(f"{PICTURE}: {PICTURE.stat().st_size / 1000:.0f} kB")
