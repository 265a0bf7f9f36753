"""Computes results of holds, and the trial table lifts.csv."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from affordance.arrays import Array, about
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.tool import Tool
from affordance.settings import Settings
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object

# Smallest p-value; smaller values are dominated by rounding errors.
_LEAST_P_VALUE = 1e-300
# Prefixes of columns with parameters that differ between observers; the columns have the names of the settings.
OWN_VALUES = ("participant.", "learner.")
# Columns of lifts.csv.
COLUMNS = (
    *("observer", "learner", "block", "cycle", "lift", "object", "mass", "size", "force", "expected"),
    *("believed_density", "kind", "surprise", "felt", "expected_by_look", "heaviness"),
)


def expect(tool: Tool, before: MaterialMemory, after: MaterialMemory, settings: Settings) -> dict[str, float]:
    """Computes the expected mass of an object before a hold, and its kind after the hold.

    Args:
        tool: Object.
        before: Memory before the hold.
        after: Memory after the hold.
        settings: Settings of the simulation.

    Returns:
        ``expected``: mass at the most probable densities before the hold, [kg]; NaN if features are observed with
        errors. ``believed_density``: most probable density of the first part's colour before the hold, [kg/m^3].
        ``kind``: number of the object's kind in this colour after the hold, from 1 for the oldest; 0 if the learner
        has no kinds.
    """
    seen = measure_features(tool, VisionError(), np.random.default_rng(0))
    met, colour = before.recognise(seen[0].colour, 0.0, settings.prior)
    expected = math.nan
    if settings.eye is None and settings.vision_error == VisionError():
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
    """Computes the results of one observer's holds as variables along ``trial``.

    Args:
        tools: Held objects, in order (K).
        memories: Memories before the first trial and after each trial (K + 1).
        records: Record of each trial (K).
        settings: Settings of the simulation.

    Returns:
        Dimension, values and attributes of each variable, by name.
    """
    pairs = zip(tools, memories[:-1], memories[1:], strict=True)
    found = pd.DataFrame([expect(tool, before, after, settings) for tool, before, after in pairs])
    variables = (
        ("expected", found.expected, "kg", "mass at the most probable densities, before the hold"),
        ("believed_density", found.believed_density, "kg/m^3", "most probable density of the first part's colour"),
        (
            "kind",
            found.kind,
            "1",
            "kind to which the object is assigned after the hold; 0 if the learner has no kinds",
        ),
        (
            "p_value",
            [each.p_value for each in records],
            "1",
            "p-value of the torques under the belief before the hold",
        ),
        ("log_evidence", [each.log_evidence for each in records], "1", "log probability density of the torques"),
        ("periods_limited", [each.counts.limited for each in records], "1", "control periods with an active limit"),
        ("periods_failed", [each.counts.failed for each in records], "1", "control periods without a plan"),
        (
            "samples_rejected",
            [each.samples.rejected for each in records],
            "1",
            "rejected torque samples",
        ),
    )
    return {name: ("trial", values, about(unit, meaning)) for name, values, unit, meaning in variables}


def tabulate_holds(
    data: xr.Dataset, tools: Sequence[Tool], *, learner: str, block: str, objects: Any = None
) -> pd.DataFrame:
    """Tabulates the holds of all observers, with the columns of lifts.csv.

    Args:
        data: Variables of ``describe_holds``, (observer, trial).
        tools: Objects.
        learner: Name of the learner.
        block: Name of the block of trials.
        objects: Indices of the held objects, (observers, trials) or (trials,). None if each object is held once, in
            order.
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
    """Selects the columns of lifts.csv and columns of parameters that differ between observers."""
    return lifts[[*COLUMNS, *(name for name in lifts if str(name).startswith(OWN_VALUES))]]


def show_kinds(kinds: NDArray[np.intp]) -> pd.Series:
    """Formats kind numbers, with empty cells if the learner has no kinds."""
    return pd.Series(kinds, dtype="Int64").replace(0, pd.NA)


def compute_surprise(p_values: Array) -> Array:
    """Computes the negative decimal logarithm of p-values, at most 300; NaN for NaN."""
    return -np.log10(np.maximum(p_values, _LEAST_P_VALUE))


def compute_volume(tool: Tool) -> float:
    """Computes the total volume of an object's parts, [m^3]."""
    return sum(part.shape.volume for part in tool.components)
