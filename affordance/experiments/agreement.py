"""Comparison of the choices for both tasks, observer by observer.

An observer draws the same density before it chooses a grip for reaching and one for hammering. If a tool has equal
halves, and one task needs the heavy end in the hand and the other the light one, both choices are right or both are
wrong: two experiments then show a single result. Other tools need not show this.
"""

import json
import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.choice.inner_simulation import Choice
from affordance.choice.ranking import NO_OPTION
from affordance.files.atomic import quarantine, write_json
from affordance.objects.symmetry import is_symmetric
from affordance.objects.tool import Tool
from affordance.reporting.report import remove_section, write_section
from affordance.reporting.section import render_section
from affordance.reporting.statistics import estimate_proportion
from affordance.runs.repeats import compute_key
from affordance.settings import Settings

_LOG = logging.getLogger(__name__)

NAME = "agreement"
_SECTION = Path(__file__).parent / "sections" / f"{NAME}.yaml"
_TASKS = ("reach", "hammer")
_FILE = "choices.json"


class ToolChoices(NamedTuple):
    """Choices of a grip of one tool in one task.

    Attributes:
        symmetric: True if the two grips differ only in where the materials are.
        correct: Name of the correct grip.
        chosen: Names of the chosen grips, empty where no grip was usable, (observers, K + 1).
    """

    symmetric: bool
    correct: str
    chosen: NDArray[np.str_]


class SavedChoices(NamedTuple):
    """Choices of all observers in one task.

    Attributes:
        shared: Conditions that must agree between the tasks: faults, source of features, seed, repeats; models by
            hash key.
        tools: Choices, by name of the tool.
    """

    shared: dict[str, Any]
    tools: dict[str, ToolChoices]


def save_choices(
    folder: Path,
    *,
    novel: Sequence[Tool],
    choices: Mapping[str, Choice],
    chosen: NDArray[np.intp],
    numbers: Mapping[str, Any],
    settings: Settings,
    seed: int,
) -> None:
    """Saves the observers' choices to a file.

    Args:
        folder: Folder of the experiment.
        novel: Novel tools.
        choices: Choice of a grip, by tool.
        chosen: Indices of the grips chosen, with one density drawn per choice, (observers, tools, K + 1).
        numbers: Numbers of the experiment, with the correct grip of every tool.
        settings: Settings of the experiment.
        seed: Root of every random draw.
    """
    tools = {}
    for index, tool in enumerate(novel):
        grips = [option.grip for option in choices[tool.name].options]
        tools[tool.name] = {
            "symmetric": is_symmetric(tool),
            "correct": numbers["tools"][tool.name]["correct_grip"],
            "chosen": [
                ["" if grip == NO_OPTION else grips[grip] for grip in of_one] for of_one in chosen[:, index].tolist()
            ],
        }
    shared = {
        "faults": settings.faults,
        "feature_source": settings.feature_source.value,
        "seed": seed,
        "repeats": len(chosen),
        "models": compute_key("", settings.arm.parent),
    }
    write_json(folder / _FILE, {"shared": shared, "tools": tools})


def compare_tasks(out: Path) -> None:
    """Writes the section that compares the choices of both tasks, if the folder holds both."""
    found = [_read(out / name / _FILE) for name in _TASKS]
    one, other = found
    if one is None or other is None:
        remove_section(out / NAME)
        return
    apart = [name for name, value in one.shared.items() if other.shared[name] != value]
    if apart:
        _LOG.warning(
            "%s: choices of %s are not compared, as they differ in %s", out, " and ".join(_TASKS), ", ".join(apart)
        )
        remove_section(out / NAME)
        return
    tools = {name: compute_agreement(one.tools[name], other.tools[name]) for name in one.tools if name in other.tools}
    numbers = {"tools": tools, "repeats": one.shared["repeats"], "seed": one.shared["seed"]}
    write_section(out / NAME, render_section(_SECTION, numbers, {}))
    write_json(out / NAME / "metrics.json", numbers)


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


def _read(path: Path) -> SavedChoices | None:
    """Reads saved choices; None if there are none. A damaged file is moved aside."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        shared = {name: content["shared"][name] for name in ("faults", "feature_source", "seed", "repeats", "models")}
        tools = {}
        for name, tool in content["tools"].items():
            chosen = np.array(tool["chosen"], dtype=str)
            if chosen.ndim != 2 or not chosen.size:
                raise ValueError(f"choices about the {name} are no table")
            tools[name] = ToolChoices(bool(tool["symmetric"]), str(tool["correct"]), chosen)
    except FileNotFoundError:
        return None
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
        quarantine(path, f"is not what an experiment found ({error})")
        return None
    return SavedChoices(shared, tools)
