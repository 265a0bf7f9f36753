"""Advice on tools in words and as JSON: the ranking with its reasons, what would change it, and the choice."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from affordance.belief.named_materials import NamedBelief
from affordance.choice.demand import Criterion
from affordance.choice.options import Option
from affordance.choice.pricing import Amount
from affordance.choice.ranking import RankedOption, Ranking
from affordance.choice.reasons import Reasons, Turn
from affordance.choice.weighed import Surprise
from affordance.files.atomic import to_plain
from affordance.memory.past_arms import describe_past_arms
from affordance.objects.colour import Colour, find_nearest_colour
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.reporting.formatting import format_number, tabulate

# Least share of a material in the uncertainty, and least probability of a change, that the text mentions.
_LEAST_SHARE, _LEAST_PROBABILITY = 0.05, 1e-3
_COST_TITLES = {Criterion.EFFORT: "effort (N²m²s)", Criterion.GRIP: "wrench as a force (N)"}


class AdviceQuestion(NamedTuple):
    """Question that an advice answers, with the names that its text uses."""

    task: str
    robot: str
    see: str  # source of the tools' form, "drawing", "features" or "pictures"
    memory: str  # name of the memory; empty without one
    known: NamedBelief  # where the belief about the tools' materials comes from
    names: Callable[[Colour], str]
    num_other_arms: int = 0  # number of the memory's trials of this robot that were made with another arm
    tilt: str = ""  # how the hand is turned from upright at home; empty if it is not
    reasons: Reasons | None = None  # reasons of the choice; None if no other option is usable
    surprises: tuple[Surprise, ...] = ()  # weighings that contradict the belief
    remarks: tuple[str, ...] = ()  # what is to be said of the tools' file


def name_materials(tools: Sequence[Tool], materials: Mapping[str, Material]) -> Callable[[Colour], str]:
    """Returns a function that names materials by colour: those the tools show, else the nearest."""
    shown: dict[Colour, str] = {
        part.looks_like.colour: part.looks_like.name for tool in tools for part in tool.components
    }
    colours = {name: material.colour for name, material in materials.items()}
    return lambda colour: shown.get(colour) or find_nearest_colour(colour, colours)


def describe_advice(advice: Ranking, question: AdviceQuestion) -> str:
    """Writes an advice for a terminal; the last line, and the error, are those of ``describe_choice_of``."""
    by = f"compared by {_say_criterion(advice.criterion)}"
    title = f"{question.task} with {question.robot}, {by}; {describe_knowledge(question.known, question.memory)}"
    lines = [title, *map(_say_surprise, question.surprises), *(f"warning: {each}" for each in question.remarks)]
    if question.num_other_arms:
        lines.append(describe_past_arms(question.robot, question.num_other_arms))
    if question.tilt:
        lines.append(f"warning: {question.tilt}")
    lines += _tabulate(advice)
    if advice.p_none > 0.0:
        lines.append(f"  with probability {advice.p_none:.2f} no option is feasible")
    lines += _say_why(advice, question)
    return "\n".join([*lines, describe_choice_of(advice)])


def describe_choice_of(advice: Ranking) -> str:
    """Describes the option to take, its cost and its certainty; if none can be used, an AffordanceError is raised."""
    best = advice.best
    return f"Take {_name(best.option)}: {_say_cost(best, advice.criterion)}, best with probability {best.p_best:.2f}."


def build_content(advice: Ranking, question: AdviceQuestion) -> dict[str, Any]:
    """Builds the JSON content of an advice; infinite numbers are null, errors those of ``describe_choice_of``."""
    criterion = advice.criterion
    options = [
        {
            **_identify(each.option),
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
        "hand": question.tilt or None,
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
        "sentence": describe_choice_of(advice),
    }
    plain: dict[str, Any] = to_plain(content)
    return plain


def _show_reasons(advice: Ranking, reasons: Reasons, question: AdviceQuestion) -> dict[str, Any]:
    return {
        "rival": _identify(advice.ranked[reasons.rival].option),
        "materials": [{"material": name, "share": share} for name, share in _sum_shares(reasons, question).items()],
        "rest": reasons.rest,
        "changes": [
            {
                "material": question.names(turn.colour),
                "above" if turn.above else "below": turn.density,
                "probability": turn.probability,
                **_identify(advice.ranked[turn.option].option),
            }
            for turn in _list_turns(reasons, question)
        ],
    }


def _sum_shares(reasons: Reasons, question: AdviceQuestion) -> dict[str, float]:
    """Sums the shares of colours that look like one material, as parts in pictures may; the largest first."""
    sums: dict[str, float] = {}
    for each in reasons.shares:
        name = question.names(each.colour)
        sums[name] = sums.get(name, 0.0) + each.share
    return dict(sorted(sums.items(), key=lambda each: -each[1]))


def _list_turns(reasons: Reasons, question: AdviceQuestion) -> list[Turn]:
    """Lists the most probable turn of each material in each direction."""
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


def _say_criterion(criterion: Criterion) -> str:
    return {
        Criterion.WORK: "the joints' expected work",
        Criterion.EFFORT: "the joints' expected effort",
        Criterion.MARGIN: "the highest share of a joint's torque limit (95 % quantile)",
        Criterion.GRIP: "the wrench that the grip must hold (95 % quantile)",
    }[criterion]


def describe_knowledge(known: NamedBelief, memory: str) -> str:
    """Describes where the belief about materials comes from: their names, the memory of a name, or neither."""

    def list_names(names: Sequence[str]) -> str:
        return ", ".join(map(_say_material, names))

    parts = []
    if known.by_name:
        parts.append(f"handbook densities of {list_names(known.by_name)} (--know nothing leaves them out)")
    if known.learned:
        parts.append(f"evidence about {list_names(known.learned)} from the memory {memory}")
    elif memory:
        parts.append(f"no evidence from the memory {memory}")
    if known.unknown:
        all_or_some = list_names(known.unknown) if parts else "all materials"
        parts.append(f"the prior of any material for {all_or_some}")
    return "; ".join(parts)


def _say_surprise(surprise: Surprise) -> str:
    return (
        f"warning: {surprise.name} weighs {format_number(surprise.mass)} kg, and its drawing and materials say "
        f"{format_number(surprise.expected)} ± {format_number(surprise.expected_sd, 2)} kg; the weighing counts"
    )


def _say_material(name: str) -> str:
    return name.replace("_", " ")


def _tabulate(advice: Ranking) -> list[str]:
    """Formats the options as a table: intervals of 90 %, peaks by their 95 % quantile."""
    of_cost = _COST_TITLES.get(advice.criterion)
    header = ["", "work (J)", *([of_cost] if of_cost else []), "P(best)", "P(feasible)"]
    header += ["torque share", "force (N)", "moment (N m)", ""]
    rows = [header]
    for each in advice.ranked:
        amounts = each.amounts
        costs = [_range(amounts.work), *([_range(amounts.cost)] if of_cost else [])]
        forces = _number(amounts.force.p95), _number(amounts.moment.p95)
        peaks = [f"{_percent(amounts.margin.p95)} {amounts.joint}", *forces] if each.q_start.size else ["", "", ""]
        probabilities = [f"{each.p_best:.2f}", f"{each.p_feasible:.2f}"]
        name = f"{each.option.object_name}, {each.option.grip}"
        rows.append([name, *costs, *probabilities, *peaks, each.infeasible_reason])
    return [f"  {line}" for line in tabulate(rows)]


def _say_why(advice: Ranking, question: AdviceQuestion) -> list[str]:
    reasons = question.reasons
    if reasons is None:
        return ["Why: no other option can do the task with the required probability."]
    best, rival = advice.ranked[0], advice.ranked[reasons.rival]
    against = f"Why {_name(best.option)} rather than {_name(rival.option)}:"
    shares = {name: share for name, share in _sum_shares(reasons, question).items() if share >= _LEAST_SHARE}
    if not shares:
        lines = [f"{against} no material's density affects the difference."]
    else:
        parts = [f"{_say_material(name)} ({_percent(share)})" for name, share in shares.items()]
        lines = [f"{against} the uncertainty of their difference is due to the density of {' and '.join(parts)}."]
    told = [turn for turn in _list_turns(reasons, question) if turn.probability >= _LEAST_PROBABILITY]
    lines += [f"  {_say_turn(turn, advice, question)}" for turn in told]
    return lines if told else [*lines, "  No plausible density would change the choice by itself."]


def _say_turn(turn: Turn, advice: Ranking, question: AdviceQuestion) -> str:
    side = "heavier" if turn.above else "lighter"
    other = _name(advice.ranked[turn.option].option)
    material = _say_material(question.names(turn.colour))
    return (
        f"If {material} were known to be {side} than {format_number(turn.density)} kg/m³ "
        f"(probability {turn.probability:.2g}), {other} would be better."
    )


def _say_cost(best: RankedOption, criterion: Criterion) -> str:
    amounts, cost = best.amounts, best.amounts.cost
    if criterion is Criterion.MARGIN:
        return f"{_percent(cost.p95)} of the torque limit of {amounts.joint} at most"
    if criterion is Criterion.GRIP:
        return f"{_number(amounts.force.p95)} N and {_number(amounts.moment.p95)} N m at most to be held by the grip"
    unit = "J" if criterion is Criterion.WORK else "N²m²s"
    return f"{_number(cost.mean)} ± {format_number(0.5 * (cost.p95 - cost.p05), 2)} {unit}"


def _name(option: Option) -> str:
    """Names an option: "the mallet by its head", "the mallet choked"."""
    if not option.grip:
        return f"the {option.object_name}"
    how = option.grip if option.grip.endswith("ed") else f"by its {option.grip}"
    return f"the {option.object_name} {how}"


def _range(amount: Amount) -> str:
    if not np.isfinite(amount.mean):
        return ""
    return f"{_number(amount.mean)} ({_number(amount.p05)} to {_number(amount.p95)})"


def _number(value: float) -> str:
    return format_number(value) if np.isfinite(value) else ""


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
