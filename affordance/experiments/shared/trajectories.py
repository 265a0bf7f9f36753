"""Heights, motions and times as labelled arrays, for files of trajectories."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Arrays
from affordance.files.netcdf import LabelledArray
from affordance.simulation.trial_record import TrialRecord

# Heights that a trial logs, and the point of the tool that each refers to.
HEIGHTS = {
    "height_centre": "tool's geometric centre",
    "height_grip": "grip To",
    "height_com": "tool's true centre of mass",
}


def stack_presentations(
    records: Sequence[TrialRecord | None], numbers: Sequence[Mapping[str, Any]]
) -> dict[str, NDArray[Any]]:
    """Stacks motions, logged at the same times, and further measures of K presentations; NaN where one has no motion.

    Arrays are ``times`` (N,) and heights (K, N), [m]; the counts ``periods_limited``, ``periods_failed`` and
    ``rejected``, (K,); ``p_value`` and ``log_evidence``, (K,); and the further measures, (K, ...).
    """
    rows: list[dict[str, Any]] = [
        dict(more) if record is None else {**_describe(record), **more}
        for record, more in zip(records, numbers, strict=True)
    ]
    shapes = {name: np.shape(value) for row in rows for name, value in row.items()}
    arrays = {
        name: np.stack([np.asarray(row.get(name, np.full(shape, np.nan))) for row in rows])
        for name, shape in shapes.items()
    }
    held = next((record for record in records if record is not None), None)
    return arrays if held is None else {"times": held.times, **arrays}


def _describe(record: TrialRecord) -> dict[str, Any]:
    return {
        **{name: getattr(record, name) for name in HEIGHTS},
        "periods_limited": record.counts.limited,
        "periods_failed": record.counts.failed,
        "rejected": record.samples.rejected,
        "p_value": record.p_value,
        "log_evidence": record.log_evidence,
    }


def label_motions(records: Sequence[TrialRecord | None], whose: str) -> dict[str, LabelledArray]:
    """Labels times and motions of K trials, at least one, ``whose`` in words; NaN where there was no motion."""
    held = next(record for record in records if record is not None)
    still = np.full_like(held.q, np.nan)
    motions = {
        name: LabelledArray(
            ("trial", "time", "joint"),
            np.stack([still if record is None else getattr(record, name) for record in records]),
            unit,
            f"{meaning}, {whose}",
        )
        for name, unit, meaning in (
            ("q", "rad", "joint angles"),
            ("v", "rad/s", "joint velocities"),
            ("tau", "N m", "joint torques over the control period that ends at each time"),
        )
    }
    return {"time": LabelledArray(("time",), held.times, "s", "time since the trial began"), **motions}


def label_results(
    arrays: Arrays, quantiles: Sequence[float], records: Sequence[TrialRecord | None], whose: str
) -> dict[str, LabelledArray]:
    """Labels the arrays of all observers, and the motions of the one that is shown, ``whose`` in words."""
    moments = "percentile of the believed density of the first material, before the first and after each presentation"
    axes = ("repeat", "trial", "time")
    labelled = {
        **{
            name: LabelledArray(axes, arrays[name], "m", f"height of the {point} above its start")
            for name, point in HEIGHTS.items()
        },
        "density": LabelledArray(("repeat", "moment", "percentile"), arrays["density_quantiles"], "kg/m^3", moments),
        "percentile": LabelledArray(("percentile",), 100.0 * np.array(quantiles), "%", "percentile"),
        **label_motions(records, whose),
    }
    for name, unit, meaning in (("force", "N", "upward force before release"), ("work", "J", "mechanical work")):
        if name in arrays:
            labelled[name] = LabelledArray(("repeat", "trial"), arrays[name], unit, meaning)
    if "parameters_predicted" in arrays:
        masses = arrays["parameters_predicted"][..., 0]
        labelled["mass_predicted"] = LabelledArray(("repeat", "trial"), masses, "kg", "mass predicted before each")
    return labelled
