"""Comparison of both sources of features: true features, and features from pictures."""

import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.reporting.figures import LINE_STYLES, MARKERS, OBJECT_COLOURS, tidy
from affordance.vision.features import FeatureSource
from studies.side_by_side.finished import blame_file, check_same_conditions, read_numbers
from studies.study import Findings

NAME = "vision_comparison"
SECTION = Path(__file__).parent / "sections" / f"{NAME}.yaml"


class Curve(NamedTuple):
    """Number of an experiment that shows the speed of learning."""

    experiment: str  # name of the experiment
    key: str  # key of metrics.json
    label: str  # label of the number, with its unit
    scale: float = 1.0  # factor from SI to that unit

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


def compare_sources(features: Path, pixels: Path) -> Findings | None:
    """Compares runs with true features and with pictures, in two folders of results; None if they share none.

    Files that are not those of finished runs, or runs that differ in more than the source, raise a BadValueError.
    """
    found: dict[Curve, dict[str, Array]] = {}
    for name, curves in itertools.groupby(CURVES, lambda curve: curve.experiment):
        paths = [folder / name / "metrics.json" for folder in (features, pixels)]
        if not all(path.exists() for path in paths):
            continue
        runs = [read_numbers(path) for path in paths]
        one, other = (
            _list_conditions(path, run, source) for path, run, source in zip(paths, runs, FeatureSource, strict=True)
        )
        check_same_conditions(paths[0], one, paths[1], other)
        for curve in curves:
            values = [_read_curve(path, run, curve) for path, run in zip(paths, runs, strict=True)]
            if len(values[0]) != len(values[1]):
                problem = f"has {len(values[1])} entries of {curve.key}, must have {len(values[0])} as {paths[0]}"
                raise BadValueError(paths[1], "", problem)
            found[curve] = {source.value: array for source, array in zip(FeatureSource, values, strict=True)}
    return describe_sources(found) if found else None


def describe_sources(found: Mapping[Curve, Mapping[str, Array]]) -> Findings:
    """Describes curves with each source of features, by the name of the source."""
    panels = {
        curve.label: {way: curve.scale * values for way, values in both.items()} for curve, both in found.items()
    }
    differences = {curve.label: _find_difference(curve, both) for curve, both in found.items() if curve.is_judged}
    numbers = {"largest_difference": list(differences.values()), "panels": panels}
    figures = {"comparison": lambda: draw_comparison(panels)}
    return Findings(numbers, {"labels": list(differences)}, figures, folder=NAME, section=SECTION)


def draw_comparison(panels: dict[str, dict[str, Array]]) -> Figure:
    """Draws quantities trial by trial, one panel per quantity with its unit, by method, (K,) each."""
    figure = Figure(figsize=(3.3 * len(panels), 3.4))
    all_axes = figure.subplots(1, len(panels), squeeze=False)[0]
    for axes, (label, ways) in zip(all_axes, panels.items(), strict=True):
        for k, (way, values) in enumerate(ways.items()):
            colour = OBJECT_COLOURS[k % len(OBJECT_COLOURS)]
            style = f"{MARKERS[k % len(MARKERS)]}{LINE_STYLES[k % len(LINE_STYLES)]}"
            axes.plot(range(len(values)), values, style, color=colour, label=way)
        axes.set_ylim(0.0, None)
        axes.set_xticks(range(len(values)))
        axes.set(xlabel="trial", ylabel=label)
        axes.legend(frameon=False)
    tidy(*all_axes)
    return figure


def _find_difference(curve: Curve, both: Mapping[str, Array]) -> float:
    """Computes the largest difference between both sources, relative to the last true value unless a proportion."""
    told, seen = both[FeatureSource.FEATURES.value], both[FeatureSource.PIXELS.value]
    unit = 1.0 if curve.key == "p_correct" else float(told[-1])
    return float(np.abs(seen - told).max() / unit)


def _list_conditions(path: Path, numbers: Mapping[str, Any], source: FeatureSource) -> dict[str, Any]:
    """Lists what both runs must share; refuses a run with another source of features."""
    with blame_file(path):
        config = dict(numbers["config"])
        holder = config.pop("experience", config)
        settings = dict(holder["settings"])
        if (given := settings.pop("feature_source")) != source.value:
            raise ValueError(f"its features are {given}, not {source.value}")
        shared = {name: numbers[name] for name in ("repeats", "inputs")}
        return {**shared, **config, **holder, "settings": settings}


def _read_curve(path: Path, numbers: Mapping[str, Any], curve: Curve) -> Array:
    with blame_file(path):
        values = np.array(numbers[curve.key], dtype=float)
        if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
            raise ValueError(f"{curve.key} is no list of numbers")
        return values
