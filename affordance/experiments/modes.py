"""Both ways of seeing side by side: features as they are, and features from pictures.

Every run of an experiment keeps its numbers by the way of seeing; where a folder holds both, the report compares
them.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance import figures
from affordance.report import Claim, Picture, Section, write_section
from affordance.results import write_json
from affordance.settings import Settings, Sight
from affordance.sight_drawings import draw_modes

NAME = "modes"


class Curve(NamedTuple):
    """A number of an experiment that shows how fast is learned.

    Attributes:
        experiment: Its name.
        key: Of metrics.json.
        label: What it is, with its unit.
        scale: From SI to that unit.
    """

    experiment: str
    key: str
    label: str
    scale: float = 1.0


CURVES = (
    Curve("weight", "density_median", "density believed, median (kg/m³)"),
    Curve("weight", "drop_m", "drop (cm)", 100.0),
    Curve("com", "deviation_m", "deviation of each object (cm)", 100.0),
    Curve("reach", "p_correct", "correct choices, reach"),
    Curve("hammer", "p_correct", "correct choices, hammer"),
)


def keep_mode(folder: Path, numbers: Mapping[str, Any], settings: Settings) -> None:
    """Keeps the numbers of an experiment beside its metrics, by the way of seeing."""
    write_json(folder / f"numbers_{settings.sight.value}.json", numbers)


def compare_modes(out: Path) -> None:
    """Writes the section that compares both ways of seeing, of those experiments that a folder holds in both."""
    found = {curve: both for curve in CURVES if (both := _read_both(out / curve.experiment, curve.key)) is not None}
    if not found:
        return
    folder = out / NAME
    panels = {
        curve.label: {mode: curve.scale * values for mode, values in both.items()} for curve, both in found.items()
    }
    figures.save_figure(draw_modes(panels), folder, "modes")
    words = "; ".join(
        f"{label}: "
        + ", ".join(f"{mode} " + " ".join(f"{value:.4g}" for value in values) for mode, values in both.items())
        for label, both in panels.items()
    )
    section = Section(
        order=7,
        title="What really seeing costs",
        summary=(
            "The same experiments twice: with the features of the objects as they are, and with features from a "
            "noisy colour and depth picture of each object, taken anew before every trial, and from nothing else. "
            f"Trial by trial: {words}."
        ),
        pictures=[Picture("modes.png", "Learning with features as they are, and with features from pictures.")],
        claims=[_judge(curve, both) for curve, both in found.items() if curve.key in ("density_median", "p_correct")],
        differences=[],
    )
    write_section(folder, section)


def _judge(curve: Curve, both: Mapping[str, NDArray[np.float64]]) -> Claim:
    told, seen = both[Sight.FEATURES.value], both[Sight.PIXELS.value]
    unit = 1.0 if curve.key == "p_correct" else float(told[-1])
    apart = np.abs(seen - told) / unit
    return Claim(
        "ours",
        f"{curve.experiment}: what is learned from pictures is within a tenth of what is learned from true features.",
        bool(apart.max() <= 0.1),
        f"{curve.label}: largest difference {100 * apart.max():.1f} %, at the end {100 * apart[-1]:.1f} %",
    )


def _read_both(folder: Path, key: str) -> dict[str, NDArray[np.float64]] | None:
    """A number in both ways of seeing; None if one is missing."""
    both = {}
    for sight in Sight:
        try:
            numbers = json.loads((folder / f"numbers_{sight.value}.json").read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        both[sight.value] = np.array(numbers[key], dtype=float)
    return both
