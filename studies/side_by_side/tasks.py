"""Comparison of the choices for both tasks, observer by observer.

An observer draws the same density before it chooses a grip for reaching and one for hammering. If a tool has equal
halves, and one task needs the heavy end in the hand and the other the light one, both choices are right or both are
wrong: two experiments then show a single result. Other tools need not show this.
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from affordance.exceptions import BadValueError
from affordance.reporting.statistics import estimate_proportion
from studies.side_by_side.finished import blame_file, check_same_conditions, read_numbers
from studies.study import Findings

NAME = "agreement"
SECTION = Path(__file__).parent / "sections" / f"{NAME}.yaml"
TASKS = ("reach", "hammer")


class ToolChoices(NamedTuple):
    """Choices of a grip of one tool in one task."""

    symmetric: bool  # true if the two grips differ only in where the materials are
    correct: int  # index of the correct grip
    chosen: NDArray[np.intp]  # indices of the chosen grips, negative where no grip was usable, (observers, K + 1)


def compare_tasks(out: Path) -> Findings | None:
    """Compares the choices of both tasks; None if a folder of results does not hold both.

    Files that are not those of finished runs, or runs that differ in more than the task, raise a BadValueError.
    """
    one, other = (out / name / "metrics.json" for name in TASKS)
    if not (one.exists() and other.exists()):
        return None
    numbers, others = read_numbers(one), read_numbers(other)
    check_same_conditions(one, _list_conditions(one, numbers), other, _list_conditions(other, others))
    chosen, compared = _read_choices(one, numbers), _read_choices(other, others)
    tools = {name: compute_agreement(choices, compared[name]) for name, choices in chosen.items()}
    shown = {"tools": tools, "repeats": numbers["repeats"], "seed": numbers["seed"]}
    return Findings(shown, folder=NAME, section=SECTION)


def compute_agreement(one: ToolChoices, other: ToolChoices) -> dict[str, Any]:
    """Computes proportions of observers at every moment, (K + 1,) each, with Wilson intervals, [low, high].

    Returns: ``same_grip``, both choose the same grip; ``both_right_or_wrong``, both choices are correct or neither
        is; ``both_correct``, ``only_reach`` and ``only_hammer``, the choices that are correct; ``agreement``, the
        mean of ``both_right_or_wrong`` over all moments; ``symmetric``.
    """
    right, other_right = one.chosen == one.correct, other.chosen == other.correct
    counted = {
        "same_grip": one.chosen == other.chosen,
        "both_right_or_wrong": right == other_right,
        "both_correct": right & other_right,
        "only_reach": right & ~other_right,
        "only_hammer": ~right & other_right,
    }
    numbers: dict[str, Any] = {"symmetric": one.symmetric, "agreement": float((right == other_right).mean())}
    for name, holds in counted.items():
        estimate = estimate_proportion(holds.sum(axis=0), len(holds))
        numbers[name], numbers[f"{name}_ci95"] = estimate.mean, estimate.ci95
    return numbers


def _list_conditions(path: Path, numbers: dict[str, Any]) -> dict[str, Any]:
    with blame_file(path):
        config = numbers["config"]
        return {
            "repeats": numbers["repeats"],
            "inputs": numbers["inputs"],
            "experience": config["experience"],
            "novel": config["novel"],
        }


def _read_choices(metrics: Path, numbers: dict[str, Any]) -> dict[str, ToolChoices]:
    """Reads the choices by tool: the correct grips from metrics.json, the chosen ones from trajectories.nc."""
    path = metrics.with_name("trajectories.nc")
    with blame_file(path), xarray.open_dataset(path, engine="scipy") as dataset:
        chosen = dict(zip(dataset["tool"].values.tolist(), dataset["chosen"].values.swapaxes(0, 1), strict=True))
    with blame_file(metrics):
        if chosen.keys() != numbers["tools"].keys():
            raise BadValueError(path, "tool", f"is {', '.join(chosen)}, must be {', '.join(numbers['tools'])}")
        return {
            name: ToolChoices(
                bool(tool["chance_by_symmetry"]),
                list(tool["energy_true"]).index(tool["correct_grip"]),
                chosen[name].astype(np.intp),
            )
            for name, tool in numbers["tools"].items()
        }
