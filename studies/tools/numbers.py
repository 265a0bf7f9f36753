"""Numbers of the study: metrics.json, and details for each tool."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from studies.tools.study import Choices, ToolsResult
from studies.tools.which_end import TRUE

_MM = 1e3
# Names of the four measures of a score, which floors have, too.
_MEASURES = ("ade_g", "alde", "ape", "mnre")


def list_metrics(result: ToolsResult) -> dict[str, Any]:
    """Returns the content of metrics.json; keys that need the data set are empty without it."""
    return {
        "parity": {
            "mass": max((each.mass for each in result.parity.values()), default=None),
            "com_mm": max((_MM * each.com for each in result.parity.values()), default=None),
            "inertia": max((each.inertia for each in result.parity.values()), default=None),
        },
        "first_touch": [
            {"geometry": source.value, "holds": holds, "half": half.value, **score._asdict()}
            for (source, holds, half), score in result.scores.items()
        ],
        "floors": {
            name: {measure: getattr(score, measure) for measure in _MEASURES} for name, score in result.floors.items()
        },
        "records": {
            noise: {method: _drop_missing(errors) for method, errors in methods.items()}
            for noise, methods in result.records.items()
        },
        "segmented": sum(outcome.made_out for outcome in result.made_out.values()) if result.made_out else None,
        "grips": [entry for whose, choices in result.choices.items() for entry in _list_grips(whose, choices)],
    }


def list_details(result: ToolsResult) -> dict[str, Any]:
    """Returns the details behind the metrics, tool by tool."""
    return {
        "parity": {name: each._asdict() for name, each in result.parity.items()},
        "predicted_mass": [
            {
                "geometry": source.value,
                "holds": holds,
                "half": half.value,
                "tool": name,
                "true": result.truths[name].mass,
                "predicted": [float(value) for value in np.mean([each.mass for each in found], axis=0)],
            }
            for (source, holds, half), names in _collect_predictions(result).items()
            for name, found in names.items()
        ],
        "mass_error_of_sight": {
            source.value: {
                name: float(
                    np.mean([each.at_true_densities[source].get(name, np.nan) for each in result.predictions])
                )
                for name in found
            }
            for source, found in (result.predictions[0].at_true_densities.items() if result.predictions else ())
        },
        "not_seen": {name: why for each in result.predictions for name, why in each.not_seen.items()},
        **{
            key: {name: {**each._asdict(), "made_out": each.made_out} for name, each in outcomes.items()}
            for key, outcomes in (("made_out", result.made_out), ("made_out_as_painted", result.painted))
        },
        "blows": [
            {name: value for name, value in blow._asdict().items() if name not in ("held", "blow")}
            for choices in result.choices.values()
            for blow in choices.blows
        ],
        "uncommon": {
            "motions": [_drop_missing(motion._asdict()) for motion in result.uncommon.motions],
            "masses": [mass._asdict() for mass in result.uncommon.masses],
        },
    }


def _collect_predictions(result: ToolsResult) -> dict[Any, dict[str, list[Any]]]:
    found: dict[Any, dict[str, list[Any]]] = {}
    for observer in result.predictions:
        for key, names in observer.first_touch.items():
            for name, prediction in names.items():
                found.setdefault(key, {}).setdefault(name, []).append(prediction)
    return found


def _list_grips(whose: str, choices: Choices) -> list[dict[str, Any]]:
    """Lists the chosen grip of each tool for each task, geometry and belief, and whether it is correct."""
    entries = []
    for (task, geometry, belief), ranking in choices.rankings.items():
        if belief == TRUE:
            continue
        for tool in choices.tools:
            ranked = ranking.list_of(tool.name)
            entries.append(
                {
                    "tools": whose,
                    "task": task,
                    "geometry": geometry,
                    "belief": belief,
                    "tool": tool.name,
                    "chosen": ranked[0].option.grip,
                    "right": choices.find_right(task, tool.name),
                    "probabilities": {each.option.grip: each.p_best_of_tool for each in ranked},
                    "p_feasible": {each.option.grip: each.p_feasible for each in ranked},
                    "best_tool": ranking.ranked[0].option.object_name == tool.name,
                }
            )
    return entries


def _drop_missing(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Replaces numbers that are not finite by None, as JSON has no such numbers."""

    def replace(value: Any) -> Any:
        if isinstance(value, tuple):
            return [replace(each) for each in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return {name: replace(value) for name, value in entries.items()}
