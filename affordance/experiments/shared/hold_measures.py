"""Measures of simulated presentations, computed from the cached arrays of observers."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from affordance.arrays import Array, Arrays
from affordance.proprioception.outlier_check import OUTLIER_P_VALUE
from affordance.protocols.number_entries import Measure
from affordance.reporting import statistics

# Prefix of the names of arrays that hold rows.
ROW = "row "
# Measures of what an observer predicts for an object that it only sees.
EXPECTED = (Measure.EXPECTED_MASS, Measure.MASS_ERROR, Measure.COM_ERROR, Measure.INERTIA_ERROR)
# Measures of a height over time: array of the height, and function of it.
_OF_HEIGHTS: Mapping[Measure, tuple[str, Any]] = {
    Measure.DROP: ("height_centre", statistics.compute_drop),
    Measure.LIFT: ("height_centre", statistics.compute_lift),
    Measure.EXCURSION: ("height_centre", statistics.compute_excursion),
    Measure.EXCURSION_GRIP: ("height_grip", statistics.compute_excursion),
    Measure.EXCURSION_CENTRE_OF_MASS: ("height_com", statistics.compute_excursion),
    Measure.DEVIATION: ("height_centre", lambda heights: np.abs(statistics.compute_excursion(heights))),
    Measure.RISES: ("height_centre", lambda heights: statistics.compute_excursion(heights) > 0.0),
}
# Arrays whose name differs from that of their measure.
_ARRAYS = {Measure.SAMPLES_REJECTED: "rejected", Measure.DENSITY_MODE: "density_mode"}


def compare_parameters(predicted: Array, true: Array, measure: Measure) -> Array:
    """Computes predicted mass, or an error of mass, centre of mass or moments, (R, K), of parameters (R, K, 10)."""
    if measure is Measure.EXPECTED_MASS:
        return predicted[..., 0]
    if measure is Measure.MASS_ERROR:
        relative: Array = np.abs(predicted[..., 0] / true[..., 0] - 1.0)
        return relative
    if measure is Measure.COM_ERROR:
        centres = (parameters[..., 1:4] / parameters[..., :1] for parameters in (predicted, true))
        return np.linalg.norm(next(centres) - next(centres), axis=-1)
    moments = np.linalg.norm(predicted[..., 4:7] - true[..., 4:7], axis=-1)
    of_moments: Array = moments / np.linalg.norm(true[..., 4:7], axis=-1)
    return of_moments


def get_measure(arrays: Arrays, quantiles: Sequence[float], measure: Measure, quantile: float) -> Any:
    """Returns a measure of all observers, of a quantile of the belief that is stored; see ``MeasuredObservers``."""
    if measure is Measure.DENSITY:
        return arrays["density_quantiles"][..., list(quantiles).index(quantile)]
    if measure is Measure.DENSITIES:
        return arrays["densities"][:, list(quantiles).index(quantile)]
    if measure in EXPECTED and "parameters_predicted" in arrays:
        return compare_parameters(arrays["parameters_predicted"], arrays["parameters_true"], measure)
    if measure is Measure.PLACE:
        return np.broadcast_to(np.arange(1.0, arrays["presented"].shape[1] + 1.0), arrays["presented"].shape)
    if measure is Measure.EXPECTED_MASS:
        return arrays[f"{ROW}expected"]
    if measure is Measure.MASS_ERROR:
        return np.abs(arrays[f"{ROW}expected"] / arrays[f"{ROW}mass"] - 1.0)
    if measure in _OF_HEIGHTS:
        point, compute = _OF_HEIGHTS[measure]
        return compute(arrays[point])
    if measure in (Measure.OUTLIER, Measure.P_VALUE):
        return arrays["p_value"] < OUTLIER_P_VALUE if measure is Measure.OUTLIER else arrays["p_value"]
    return arrays[_ARRAYS.get(measure, measure.value.replace(" ", "_"))]
