"""What the experiments write alike: heights, motions, faults and provenance."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.files.netcdf import Labelled
from affordance.proprioception.faults import Faults
from affordance.reporting.report import Section
from affordance.runs.repeats import list_versions
from affordance.simulation.trial import TrialRecord

_LOG = logging.getLogger(__name__)

# Heights that a trial logs, and of which point of the tool they are.
HEIGHTS = {
    "height_centre": "tool's geometric centre",
    "height_grip": "grip To",
    "height_com": "tool's true centre of mass",
}
# The observer of which figures, trajectories and replay show every detail.
RUN_SHOWN = 0


def stack_heights(records: Sequence[TrialRecord]) -> dict[str, Array]:
    """Stacks ``times`` (N,) and the heights of K trials, (K, N), [m]."""
    heights = {name: np.stack([getattr(record, name) for record in records]) for name in HEIGHTS}
    return {"times": records[0].times, **heights}


def label_heights(arrays: Mapping[str, NDArray[Any]]) -> dict[str, Labelled]:
    """Labels the heights of all repeats, (repeats, K, N)."""
    return {
        name: Labelled(("repeat", "trial", "time"), arrays[name], "m", f"height of the {point} above its start")
        for name, point in HEIGHTS.items()
    }


def label_motions(records: Sequence[TrialRecord], shown: str) -> dict[str, Labelled]:
    """Labels times and motions of K trials.

    Args:
        records: The trials, logged at the same times.
        shown: Whose they are.
    """
    motions = {
        name: Labelled(
            ("trial", "time", "joint"),
            np.stack([getattr(record, name) for record in records]),
            unit,
            f"{meaning}, {shown}",
        )
        for name, unit, meaning in (
            ("q", "rad", "joint angles"),
            ("v", "rad/s", "joint rates"),
            ("tau", "N m", "joint torques over the tick that ends at each time"),
        )
    }
    return {"time": Labelled(("time",), records[0].times, "s", "time since the trial began"), **motions}


def name_faults(section: Section, faults: Faults, remark: str = "") -> Section:
    """Says in title and summary of a section which faults were switched on, if any were.

    Args:
        section: What the experiment reports.
        faults: Those of its settings.
        remark: What they do not concern, a sentence.
    """
    active = [
        f"{field.name} {getattr(faults, field.name)}"
        for field in fields(Faults)
        if getattr(faults, field.name) != field.default
    ]
    if not active:
        return section
    named = ", ".join(active)
    summary = " ".join(filter(None, (section.summary, f"Run with faults: {named}.", remark)))
    return section._replace(title=f"{section.title} (with faults: {named})", summary=summary)


def warn_of_faults(name: str, rejected: NDArray[np.int_], surprising: NDArray[np.int_], repeats: int) -> None:
    """Says that samples were refused, or that trials with honest objects were grossly surprising.

    Args:
        name: The experiment.
        rejected: Refused samples by object, the decoy last.
        surprising: Grossly surprising trials by object; those with the decoy are meant to be.
        repeats: How many trials there were with each.
    """
    honest = int(surprising[:-1].sum())
    if honest or rejected.any():
        _LOG.warning(
            "%s: %d samples were refused, and %d of %d trials with honest objects are grossly surprising",
            name,
            rejected.sum(),
            honest,
            repeats * (len(surprising) - 1),
        )


def describe_run(config: Any, *, seed: int, repeats: int, wall_s: float) -> dict[str, Any]:
    """What stands in metrics.json beside the numbers."""
    return {
        "seed": seed,
        "repeats": repeats,
        "run_shown": RUN_SHOWN,
        "config": config,
        "versions": list_versions(),
        "wall_s": wall_s,
    }
