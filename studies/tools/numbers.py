"""Numbers of the study: metrics.json, details for each tool, and further facts that the section names."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from studies.tools.data_set import LEARNING, Half
from studies.tools.observer import HOLDS
from studies.tools.seen import Source
from studies.tools.study import Choices, ToolsResult
from studies.tools.which_end import AFTER, ONE_DENSITY, TRUE

_MM = 1e3
# Names of the four measures of a score that a floor has too.
_MEASURES = ("ade_g", "alde", "ape", "mnre")
# Owners of hammers, by the key of the choices about them, as the section names them.
_WHOSE = {"own": "our own", "data set": "the data set's"}


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


def list_facts(result: ToolsResult) -> dict[str, Any]:
    """Returns what the section names in addition to metrics.json; what was run decides which claims are made."""
    config, has_data = result.config, bool(result.scores)
    blows = [blow for choices in result.choices.values() for blow in choices.blows]
    return {
        "records": result.records,  # with NaN where metrics.json has nothing
        "blow_force_error": [abs(blow.force / blow.force_aimed - 1.0) for blow in blows],
        "blow_work_error": [abs(blow.work / blow.work_planned - 1.0) for blow in blows],
        "of_halves": {half.value: _list_numbers_of_half(result, half) for half in config.halves} if has_data else {},
        "has_data": has_data,
        "has_learning": Half.LEARNING in config.halves,
        "has_test": Half.TEST in config.halves,
        "has_two_views": Source.TWO_VIEWS in config.sources,
        "observers": config.observers,
        "lost": [name for name, outcome in result.made_out.items() if not outcome.made_out],
        "num_unsure": sum(len(outcome.unsure) for outcome in result.made_out.values()),
        "made_out_as_painted": [outcome.made_out for outcome in result.painted.values()],
        "choices": {_WHOSE[whose]: _count_choices(each) for whose, each in result.choices.items() if each.tools},
        "motions": [motion._asdict() for motion in result.uncommon.motions],
        "masses": [mass._asdict() for mass in result.uncommon.masses],
    }


def _list_numbers_of_half(result: ToolsResult, half: Half) -> dict[str, Any]:
    """Scores by drawings and by two pictures, after each number of holds, of the tools of one half."""
    drawings = [result.scores[Source.CAD, holds, half] for holds in HOLDS]
    numbers: dict[str, Any] = {
        "alde": [found.alde for found in drawings],
        "coverage_mass": [found.coverage_mass for found in drawings],
    }
    if Source.TWO_VIEWS in result.config.sources:
        of_sight = [each.at_true_densities[Source.TWO_VIEWS] for each in result.predictions]
        names = [name for name in result.truths if (name in LEARNING) == (half is Half.LEARNING)]
        errors = [each.get(name, np.nan) for each in of_sight for name in names if name in of_sight[0]]
        seen = [result.scores[Source.TWO_VIEWS, holds, half] for holds in HOLDS]
        numbers |= {
            "sight_error": float(np.nanmedian(np.abs(np.expm1(errors)))),  # at true densities, relative
            "sight_alde": [found.alde for found in seen],
            "sight_coverage_mass": [found.coverage_mass for found in seen],
            "sight_coverage_com": [found.coverage_com for found in seen],
        }
    return numbers


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


def count_right(choices: Choices, belief: str, task: str, geometry: str) -> tuple[int, int]:
    """Counts the tools for which the correct grip is chosen; returns that count and the number of tools."""
    ranking, names = choices.rankings[task, geometry, belief], [tool.name for tool in choices.tools]
    return sum(ranking.find_best_grip(name) == choices.find_right(task, name) for name in names), len(names)


def _count_choices(choices: Choices) -> list[dict[str, Any]]:
    """Counts correct ends with and without different densities, by task and geometry, and names the first choice."""
    entries = []
    for task, words in (("hammer", "driving a nail"), ("reach", "reaching")):
        for geometry in ("drawing", "pictures"):
            after, count = count_right(choices, AFTER, task, geometry)
            one, _ = count_right(choices, ONE_DENSITY, task, geometry)
            best = choices.rankings[task, geometry, AFTER].ranked[0]
            known = {"after": after, "count": count, "one": one}
            best_of = {"tool": best.option.object_name, "grip": best.option.grip, "p_best": best.p_best}
            entries.append({"words": words, "geometry": geometry, **known, **best_of})
    return entries


def _drop_missing(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Replaces numbers that are not finite by None, as JSON has no such numbers."""

    def replace(value: Any) -> Any:
        if isinstance(value, tuple):
            return [replace(each) for each in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return {name: replace(value) for name, value in entries.items()}
