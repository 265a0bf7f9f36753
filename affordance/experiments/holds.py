"""Measurements in trials in which an observer holds objects, and the columns of lifts.csv."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from affordance.arrays import Array, about
from affordance.belief.material_memory import MaterialMemory
from affordance.experiments.trial_cells import OWN_VALUES
from affordance.objects.tool import Tool
from affordance.settings import Settings
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.eye import measure_features
from affordance.vision.features import FeatureSource, VisionError
from affordance.vision.systems import predict_object

# Smallest p-value; smaller ones are rounding errors.
_LEAST_P_VALUE = 1e-300
# Columns of lifts.csv.
COLUMNS = (
    *("observer", "learner", "block", "cycle", "lift", "object", "mass", "size", "force", "expected"),
    *("believed_density", "kind", "surprise", "felt", "expected_by_look", "heaviness"),
)


def expect(tool: Tool, before: MaterialMemory, after: MaterialMemory, settings: Settings) -> dict[str, float]:
    """Returns what an observer expects of an object by its look, before it is held, and of which kind it is after.

    Returns: ``expected``, the mass at the most probable densities, [kg], NaN where features are observed with errors;
        ``believed_density``, the most probable density of the colour of its first part, [kg/m^3]; and ``kind``, the
        number of the kind of that colour to which it is assigned, from 1, the oldest, or 0 for learners without
        kinds.
    """
    seen = measure_features(tool, VisionError(), np.random.default_rng(0))
    met, colour = before.recognise(seen[0].colour, 0.0, settings.prior)
    expected = math.nan
    if settings.feature_source is FeatureSource.FEATURES and settings.vision_error == VisionError():
        belief = predict_object(seen, before, settings.prior)
        expected = float(belief.compute_parameters(belief.densities.compute_mode())[0])
    return {
        "expected": expected,
        "believed_density": float(met.belief.compute_mode()[colour]),
        "kind": after.find_kind([part.appearance for part in seen]),
    }


def describe_holds(
    tools: Sequence[Tool], memories: Sequence[MaterialMemory], records: Sequence[TrialRecord], settings: Settings
) -> dict[str, Any]:
    """Returns variables along ``trial`` of an observer who holds objects.

    Memories are those before the first trial and after each.
    """
    pairs = zip(tools, memories[:-1], memories[1:], strict=True)
    found = pd.DataFrame([expect(tool, before, after, settings) for tool, before, after in pairs])
    variables = (
        ("expected", found.expected, "kg", "mass at the most probable densities, before the hold"),
        ("believed_density", found.believed_density, "kg/m^3", "most probable density of the first part's colour"),
        ("kind", found.kind, "1", "kind to which the object is assigned after the hold; 0 without kinds"),
        ("p_value", [each.p_value for each in records], "1", "p-value of the torques, by the belief before"),
        ("log_evidence", [each.log_evidence for each in records], "1", "log probability density of the torques"),
        ("periods_limited", [each.counts.limited for each in records], "1", "control periods with an active limit"),
        ("periods_failed", [each.counts.failed for each in records], "1", "control periods without a plan"),
        (
            "samples_rejected",
            [each.samples.rejected for each in records],
            "1",
            "samples of torque that were rejected",
        ),
    )
    return {name: ("trial", values, about(unit, meaning)) for name, values, unit, meaning in variables}


def tabulate_holds(
    data: xr.Dataset, tools: Sequence[Tool], *, learner: str, block: str, objects: Any = None
) -> pd.DataFrame:
    """Tabulates the holds of all observers along ``trial``, with the columns of lifts.csv.

    Objects, (observers, trials), are the indices of the tools that were held; None for each tool once, in order.
    """
    observers, trials = data.sizes["observer"], data.sizes["trial"]
    held = np.broadcast_to(np.arange(trials) if objects is None else objects, (observers, trials)).ravel()
    return pd.DataFrame(
        {
            "observer": np.repeat(np.arange(observers), trials),
            "learner": learner,
            "block": block,
            "cycle": np.tile(np.arange(trials) // len(tools) + 1, observers),
            "lift": np.tile(np.arange(trials) + 1, observers),
            "object": np.array([tool.name for tool in tools])[held],
            "mass": np.array([tool.mass for tool in tools])[held],
            "size": np.array([compute_volume(tool) for tool in tools])[held],
            "force": np.nan,
            "expected": data.expected.values.ravel(),
            "believed_density": data.believed_density.values.ravel(),
            "kind": show_kinds(data.kind.values.ravel()),
            "surprise": compute_surprise(data.p_value.values.ravel()),
            **dict.fromkeys(("felt", "expected_by_look", "heaviness"), np.nan),
        }
    )


def select_columns(lifts: pd.DataFrame) -> pd.DataFrame:
    """Returns the columns of lifts.csv, and those of parameters of observers, if these differ."""
    return lifts[[*COLUMNS, *(name for name in lifts if str(name).startswith(OWN_VALUES))]]


def show_kinds(kinds: NDArray[np.intp]) -> pd.Series:
    """Returns the numbers of kinds, empty where there are none."""
    return pd.Series(kinds, dtype="Int64").replace(0, pd.NA)


def compute_surprise(p_values: Array) -> Array:
    """Computes minus the decimal logarithm of p-values, at most 300; NaN for NaN."""
    return -np.log10(np.maximum(p_values, _LEAST_P_VALUE))


def compute_volume(tool: Tool) -> float:
    """Computes the volume of all parts, [m^3]."""
    return sum(part.shape.volume for part in tool.components)
