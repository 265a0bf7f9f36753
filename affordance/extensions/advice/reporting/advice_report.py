"""Advice on tools as JSON: the choice, the ranking with its reasons, and what would change it."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from affordance.choice.options import Option
from affordance.choice.pricing import Amount
from affordance.choice.ranking import Ranking
from affordance.choice.reasons import Reasons, Turn
from affordance.choice.weighed import Surprise
from affordance.extensions.advice.named_materials import NamedBelief
from affordance.files.atomic import to_plain
from affordance.objects.colour import Colour, find_nearest_colour
from affordance.objects.materials import Material
from affordance.objects.tool import Tool


class AdviceQuestion(NamedTuple):
    """Context of a ranking that its text needs: task, robot, sources of knowledge and names."""

    task: str
    robot: str
    see: str  # source of the tools' shapes: "drawing", "features" or "pictures"
    memory: str  # name of the memory; empty without one
    known: NamedBelief  # belief about the tools' materials, with its sources
    names: Callable[[Colour], str]
    num_other_arms: int = 0  # number of this robot's stored trials that were made with another version of the arm
    reasons: Reasons | None = None  # reasons for the choice; None if no other option is usable
    surprises: tuple[Surprise, ...] = ()  # weighings that contradict the belief
    remarks: tuple[str, ...] = ()  # warnings about the tools file
    # For the name of an option: grips that cost the same whatever the tool is made of, and are not ranked themselves.
    alike: Mapping[str, tuple[str, ...]] = MappingProxyType({})


def name_materials(tools: Sequence[Tool], materials: Mapping[str, Material]) -> Callable[[Colour], str]:
    """Returns a function that names the material of a colour: one that the tools show, or else the nearest."""
    shown: dict[Colour, str] = {
        part.looks_like.colour: part.looks_like.name for tool in tools for part in tool.components
    }
    colours = {name: material.colour for name, material in materials.items()}
    return lambda colour: shown.get(colour) or find_nearest_colour(colour, colours)


def build_content(advice: Ranking, question: AdviceQuestion, sentence: str) -> dict[str, Any]:
    """Builds the JSON content of a ranking; ``sentence`` is its summary, and infinite numbers become null."""
    criterion = advice.criterion
    options = [
        {
            **_identify(each.option),
            "alike": list(question.alike.get(each.option.name, ())),
            "usable": not each.infeasible_reason,
            "reason": each.infeasible_reason or None,
            "cost": {**_show(each.amounts.cost), "value": _finite(each.cost)},
            "work": _show(each.amounts.work),
            "effort": _show(each.amounts.effort),
            "torque_share": {**_show(each.amounts.margin), "joint": each.amounts.joint},
            "grip_force": _show(each.amounts.force),
            "grip_moment": _show(each.amounts.moment),
            "p_best": each.p_best,
            "p_feasible": each.p_feasible,
        }
        for each in advice.ranked
    ]
    content = {
        "task": question.task,
        "robot": question.robot,
        "see": question.see,
        "memory": question.memory or None,
        "trials_of_other_arms": question.num_other_arms,
        "known": list(question.known.by_name),
        "learned": list(question.known.learned),
        "unknown": list(question.known.unknown),
        "surprises": [each._asdict() for each in question.surprises],
        "by": criterion.value,
        "unit": criterion.unit,
        "statistic": "p95" if criterion.is_peak else "mean",
        "choice": _identify(advice.best.option),
        "options": options,
        "p_none": advice.p_none,
        "why": None if question.reasons is None else _show_reasons(advice, question.reasons, question),
        "remarks": list(question.remarks),
        "sentence": sentence,
    }
    plain: dict[str, Any] = to_plain(content)
    return plain


def _show_reasons(advice: Ranking, reasons: Reasons, question: AdviceQuestion) -> dict[str, Any]:
    return {
        "rival": _identify(advice.ranked[reasons.rival].option),
        "materials": [{"material": name, "share": share} for name, share in sum_shares(reasons, question).items()],
        "rest": reasons.rest,
        "changes": [
            {
                "material": question.names(turn.colour),
                "above" if turn.above else "below": turn.density,
                "probability": turn.probability,
                **_identify(advice.ranked[turn.option].option),
            }
            for turn in list_turns(reasons, question)
        ],
    }


def sum_shares(reasons: Reasons, question: AdviceQuestion) -> dict[str, float]:
    """Sums each material's share of the uncertainty, largest first.

    In pictures, parts of one material can have several colours; their shares are added.
    """
    sums: dict[str, float] = {}
    for each in reasons.shares:
        name = question.names(each.colour)
        sums[name] = sums.get(name, 0.0) + each.share
    return dict(sorted(sums.items(), key=lambda each: -each[1]))


def list_turns(reasons: Reasons, question: AdviceQuestion) -> list[Turn]:
    """Lists, for each material and direction, the most probable density change that would alter the choice."""
    first: dict[tuple[str, bool], Turn] = {}
    for turn in reasons.turns:
        first.setdefault((question.names(turn.colour), turn.above), turn)
    return list(first.values())


def _identify(option: Option) -> dict[str, str]:
    return {"tool": option.object_name, "grip": option.grip}


def _show(amount: Amount) -> dict[str, float | None]:
    return {name: _finite(value) for name, value in amount._asdict().items()}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
