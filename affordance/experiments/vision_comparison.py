"""Comparison of both sources of features: true features, and features from pictures.

Every run of an experiment saves its numbers by the source of features; where a folder holds both and they differ in
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
from affordance.reporting.camera_figures import draw_comparison
from affordance.reporting.figures import save_figure
from affordance.reporting.report import remove_section, write_section
from affordance.reporting.section import render_section
from affordance.runs.repeats import compute_key
from affordance.settings import Settings
from affordance.vision.features import FeatureSource

_LOG = logging.getLogger(__name__)

NAME = "vision_comparison"
_SECTION = Path(__file__).parent / "sections" / f"{NAME}.yaml"
# Key of the conditions that the numbers from both sources must share.
_SHARED = "shared"


class Curve(NamedTuple):
    """Number of an experiment that shows the speed of learning.

    Attributes:
        experiment: Name of the experiment.
        key: Key of metrics.json.
        label: Label of the number, with its unit.
        scale: Factor from SI to that unit.
    """

    experiment: str
    key: str
    label: str
    scale: float = 1.0

    @property
    def is_judged(self) -> bool:
        """True if the report compares the number with a bound."""
        return self.key in ("density_median", "p_correct")


CURVES = (
    Curve("weight", "density_median", "density believed, median (kg/m³)"),
    Curve("weight", "drop_m", "drop (cm)", 100.0),
    Curve("com", "deviation_m", "deviation of each object (cm)", 100.0),
    Curve("reach", "p_correct", "correct choices, reach"),
    Curve("hammer", "p_correct", "correct choices, hammer"),
)


class SavedRun(NamedTuple):
    """Numbers of an experiment with one source of features.

    Attributes:
        shared: Conditions that must agree between the sources: faults, seed, repeats; models and program by hash key.
        values: Curves of the experiment, (K,) each.
    """

    shared: dict[str, Any]
    values: dict[Curve, Array]


def save_vision_metrics(
    folder: Path, numbers: Mapping[str, Any], settings: Settings, *, seed: int, repeats: int
) -> None:
    """Saves the numbers of a compared experiment next to its metrics, by the source of features."""
    if folder.name not in {curve.experiment for curve in CURVES}:
        return
    models = compute_key("", settings.arm.parent)
    shared = {"faults": settings.faults, "seed": seed, "repeats": repeats, "models": models}
    write_json(folder / f"numbers_{settings.feature_source.value}.json", {**numbers, _SHARED: shared})


def compare_feature_sources(out: Path) -> None:
    """Writes the section that compares both sources, for the experiments that a folder holds with both."""
    found: dict[Curve, dict[str, Array]] = {}
    for name, curves in itertools.groupby(CURVES, lambda curve: curve.experiment):
        found.update(_read_both(out / name, list(curves)))
    if not found:
        remove_section(out / NAME)
        return
    panels = {
        curve.label: {way: curve.scale * values for way, values in both.items()} for curve, both in found.items()
    }
    save_figure(draw_comparison(panels), out / NAME, "comparison")
    differences = {curve.label: _find_difference(curve, both) for curve, both in found.items() if curve.is_judged}
    numbers = {"largest_difference": list(differences.values()), "panels": panels}
    write_section(out / NAME, render_section(_SECTION, numbers, {"labels": list(differences)}))


def _find_difference(curve: Curve, both: Mapping[str, Array]) -> float:
    """Computes the largest difference between both sources, relative to the last true value unless a proportion."""
    told, seen = both[FeatureSource.FEATURES.value], both[FeatureSource.PIXELS.value]
    unit = 1.0 if curve.key == "p_correct" else float(told[-1])
    return float(np.abs(seen - told).max() / unit)


def _read_both(folder: Path, curves: Sequence[Curve]) -> dict[Curve, dict[str, Array]]:
    """Reads the curves of an experiment from both sources; empty if one is missing or other conditions differ."""
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
    """Reads saved numbers; None if there are none. A damaged file is quarantined."""
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
