"""Both ways of seeing side by side: features as they are, and features from pictures.

Every run of an experiment keeps its numbers by the way of seeing; where a folder holds both, and they differ in
nothing else, the report compares them.
"""

import itertools
import json
import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.files.atomic import quarantine, write_json
from affordance.reporting import figures
from affordance.reporting.camera_figures import draw_comparison
from affordance.reporting.report import Claim, Picture, Section, remove_section, write_section
from affordance.reporting.wording import show_beside
from affordance.runs.repeats import compute_key
from affordance.settings import Settings
from affordance.vision.features import FeatureSource

_LOG = logging.getLogger(__name__)

NAME = "modes"
# Where the numbers of a mode say what they share with those of the other.
_SHARED = "shared"


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


class SavedRun(NamedTuple):
    """What an experiment found with one way of seeing.

    Attributes:
        shared: What must be the same in both ways of seeing: faults, seed, repeats; models and program by their key.
        values: Its curves, (K,) each.
    """

    shared: dict[str, Any]
    values: dict[Curve, Array]


def save_vision_metrics(
    folder: Path, numbers: Mapping[str, Any], settings: Settings, *, seed: int, repeats: int
) -> None:
    """Keeps the numbers of an experiment beside its metrics, by the way of seeing."""
    models = compute_key("", settings.arm.parent)
    shared = {"faults": settings.faults, "seed": seed, "repeats": repeats, "models": models}
    write_json(folder / f"numbers_{settings.feature_source.value}.json", {**numbers, _SHARED: shared})


def compare_feature_sources(out: Path) -> None:
    """Writes the section that compares both ways of seeing, of those experiments that a folder holds in both."""
    found: dict[Curve, dict[str, Array]] = {}
    for name, curves in itertools.groupby(CURVES, lambda curve: curve.experiment):
        found.update(_read_both(out / name, list(curves)))
    if not found:
        remove_section(out / NAME)
        return
    folder = out / NAME
    panels = {
        curve.label: {mode: curve.scale * values for mode, values in both.items()} for curve, both in found.items()
    }
    figures.save_figure(draw_comparison(panels), folder, "modes")
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


def _judge(curve: Curve, both: Mapping[str, Array]) -> Claim:
    told, seen = both[FeatureSource.FEATURES.value], both[FeatureSource.PIXELS.value]
    unit = 1.0 if curve.key == "p_correct" else float(told[-1])
    apart = np.abs(seen - told) / unit
    return Claim(
        "ours",
        f"{curve.experiment}: what is learned from pictures is within a tenth of what is learned from true features.",
        bool(apart.max() <= 0.1),
        f"{curve.label}: largest difference {show_beside(100 * float(apart.max()), 10.0)} %, "
        f"at the end {100 * apart[-1]:.1f} %",
    )


def _read_both(folder: Path, curves: Sequence[Curve]) -> dict[Curve, dict[str, Array]]:
    """Curves of an experiment in both ways of seeing; none if one is missing, or if they differ in more than that."""
    kept = {
        feature_source.value: _read_mode(folder / f"numbers_{feature_source.value}.json", curves)
        for feature_source in FeatureSource
    }
    both = {mode: found for mode, found in kept.items() if found is not None}
    if len(both) < len(FeatureSource):
        return {}
    one, other = both.values()
    apart = [name for name, value in one.shared.items() if other.shared[name] != value]
    apart += [curve.key for curve in curves if one.values[curve].shape != other.values[curve].shape]
    if apart:
        _LOG.warning("%s: %s are not compared, as they differ in %s", folder, " and ".join(both), ", ".join(apart))
        return {}
    return {curve: {mode: found.values[curve] for mode, found in both.items()} for curve in curves}


def _read_mode(path: Path, curves: Sequence[Curve]) -> SavedRun | None:
    """Reads what was kept; None if nothing was. A file that is no such thing is set aside."""
    try:
        numbers = json.loads(path.read_text(encoding="utf-8"))
        shared = {name: numbers[_SHARED][name] for name in ("faults", "seed", "repeats", "models")}
        values = {curve: np.array(numbers[curve.key], dtype=float) for curve in curves}
        for curve, value in values.items():
            if value.ndim != 1 or not len(value) or not np.isfinite(value).all():
                raise ValueError(f"{curve.key} is no list of numbers")
    except FileNotFoundError:
        return None
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
        quarantine(path, f"is not what an experiment found ({error})")
        return None
    return SavedRun(shared, values)
