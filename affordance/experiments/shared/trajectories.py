"""Heights, motions and times as labelled arrays, for files of trajectories."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.files.netcdf import LabelledArray
from affordance.simulation.trial import TrialRecord

# Heights that a trial logs, and of which point of the tool they are.
HEIGHTS = {
    "height_centre": "tool's geometric centre",
    "height_grip": "grip To",
    "height_com": "tool's true centre of mass",
}


def stack_heights(records: Sequence[TrialRecord]) -> dict[str, Array]:
    """Stacks ``times`` (N,) and the heights of K trials, (K, N), [m]."""
    heights = {name: np.stack([getattr(record, name) for record in records]) for name in HEIGHTS}
    return {"times": records[0].times, **heights}


def count_events(records: Sequence[TrialRecord]) -> dict[str, NDArray[Any]]:
    """What went wrong in K trials, or almost: ``periods_limited``, ``periods_failed``, ``rejected``, ``p_value``."""
    return {
        "periods_limited": np.array([record.counts.limited for record in records]),
        "periods_failed": np.array([record.counts.failed for record in records]),
        "rejected": np.array([record.samples.rejected for record in records]),
        "p_value": np.array([record.p_value for record in records]),
    }


def label_heights(arrays: Mapping[str, NDArray[Any]]) -> dict[str, LabelledArray]:
    """Labels the heights of all repeats, (repeats, K, N)."""
    return {
        name: LabelledArray(("repeat", "trial", "time"), arrays[name], "m", f"height of the {point} above its start")
        for name, point in HEIGHTS.items()
    }


def label_motions(records: Sequence[TrialRecord], whose: str) -> dict[str, LabelledArray]:
    """Labels times and motions of K trials that were logged at the same times.

    Args:
        records: The trials.
        whose: Whose they are, in words.
    """
    motions = {
        name: LabelledArray(
            ("trial", "time", "joint"),
            np.stack([getattr(record, name) for record in records]),
            unit,
            f"{meaning}, {whose}",
        )
        for name, unit, meaning in (
            ("q", "rad", "joint angles"),
            ("v", "rad/s", "joint velocities"),
            ("tau", "N m", "joint torques over the control period that ends at each time"),
        )
    }
    return {"time": LabelledArray(("time",), records[0].times, "s", "time since the trial began"), **motions}
