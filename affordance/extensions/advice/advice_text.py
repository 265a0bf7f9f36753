"""Advice on tools as JSON and for a terminal: the choice, the ranking with its reasons, and what would change it."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from affordance.choice.demand import Criterion
from affordance.choice.options import Option
from affordance.choice.picking import MIN_FEASIBILITY
from affordance.choice.pricing import Amount
from affordance.choice.ranking import RankedOption, Ranking
from affordance.choice.reasons import Reasons, Turn
from affordance.choice.weighed import Surprise
from affordance.exceptions import name_gripped, name_object
from affordance.extensions.advice.known_materials import NamedBelief
from affordance.extensions.memory.ledger import describe_past_arms
from affordance.files.atomic import to_plain
from affordance.objects.colour import Colour, find_nearest_colour
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.reporting.formatting import format_known, format_number, tabulate_within


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


# What the text mentions: a material with at least this share of the uncertainty, and a change of the choice with at
# least this probability; in the first sentence, a change with at least the last of the three.
_LEAST_SHARE, _LEAST_PROBABILITY, _NOTABLE = 0.05, 1e-3, 0.05
_COST_TITLES = {Criterion.EFFORT: "effort (N²m²s)", Criterion.GRIP: "wrench as a force (N)"}
# Columns of the table, and those to drop if it is too wide, in this order.
_WORK, _COST, _BEST, _FEASIBLE, _SHARE, _FORCE, _MOMENT = range(1, 8)
_LESS_IMPORTANT = (_MOMENT, _FORCE, _SHARE, _FEASIBLE, _WORK)


def describe_advice(advice: Ranking, question: AdviceQuestion, width: int = 0) -> str:
    """Formats a ranking for a terminal; the first line is that of ``describe_choice_of``.

    Lines are wrapped at ``width`` characters unless it is 0.
    """
    by = f"compared by {_describe_criterion(advice.criterion)}"
    title = f"{question.task} with {question.robot}, {by}; {describe_knowledge(question.known, question.memory)}"
    lines = [describe_choice_of(advice, question), title, *map(describe_surprise, question.surprises)]
    lines += [f"warning: {each}" for each in question.remarks]
    if question.num_other_arms:
        lines.append(describe_past_arms(question.robot, question.num_other_arms))
    lines = [part for line in lines for part in (textwrap.wrap(line, width) if width else [line])]
    lines += _tabulate(advice, question, width)
    if advice.p_none > 0.0:
        lines.append(f"  with probability {advice.p_none:.2f} no option is feasible")
    for line in _describe_reasons(advice, question):
        lines += textwrap.wrap(line, width, subsequent_indent="  ") if width else [line]
    return "\n".join(lines)


def describe_choice_of(advice: Ranking, question: AdviceQuestion) -> str:
    """Describes the choice in one sentence: the option, its cost, how certain it is, and what would change it.

    Raises:
        AffordanceError: If no option is usable.
    """
    best = advice.best
    parts = [
        f"Take {_name(best.option, question)}: {_describe_cost(best, advice.criterion)}, best with probability "
        f"{best.p_best:.2f}"
    ]
    better = max(advice.ranked, key=lambda each: each.p_best)
    if better.p_best > best.p_best:
        parts.append(_describe_better(better, advice, question))
    elif advice.num_usable == 1 and len(advice.ranked) > 1:
        parts.append(f"no other option is feasible with a probability of {100.0 * MIN_FEASIBILITY:g} %")
    if question.reasons is not None:
        turns = [turn for turn in list_turns(question.reasons, question) if turn.probability >= _NOTABLE]
        parts += [_describe_turn(turn, advice, question) for turn in turns[:1]]
    return f"{'; '.join(parts)}."


def _describe_better(better: RankedOption, advice: Ranking, question: AdviceQuestion) -> str:
    """Explains why an option that is best more often than the chosen one is not chosen."""
    name, p = _name(better.option, question), f"{better.p_best:.2f}"
    if better.infeasible_reason:
        only = "the only one" if advice.num_usable == 1 else "one"
        feasible = f"a probability of {100.0 * MIN_FEASIBILITY:g} %"
        return f"it is {only} that is feasible with {feasible}; {name} is best with probability {p}, but " + (
            f"feasible with probability {better.p_feasible:.2f} only"
        )
    how = "demands more if it is heavy" if advice.criterion.is_peak else "costs more on average"
    return f"{name} is best more often ({p}), but {how} ({_describe_cost(better, advice.criterion)})"


def _describe_criterion(criterion: Criterion) -> str:
    return {
        Criterion.WORK: "the joints' expected work",
        Criterion.EFFORT: "the joints' expected effort",
        Criterion.MARGIN: "the highest fraction of a joint's torque limit (95 % quantile)",
        Criterion.GRIP: "the wrench that the grip must hold (95 % quantile)",
    }[criterion]


def describe_knowledge(known: NamedBelief, memory: str) -> str:
    """Describes the sources of the belief about materials: handbook densities, the named memory, or the prior."""

    def list_names(names: Sequence[str]) -> str:
        return ", ".join(map(_name_material, names))

    parts = []
    if known.by_name:
        parts.append(f"handbook densities of {list_names(known.by_name)} (--know nothing leaves them out)")
    if known.learned:
        parts.append(f"evidence about {list_names(known.learned)} from the memory {memory}")
    elif memory:
        parts.append(f"no evidence from the memory {memory}")
    if known.unknown:
        parts.append(f"the prior of any material for {list_names(known.unknown)}")
    return "; ".join(parts)


def describe_surprise(surprise: Surprise) -> str:
    """Formats a warning about a weighing that contradicts the drawing and the materials."""
    return (
        f"warning: {surprise.name} weighs {format_number(surprise.mass)} kg, but its drawing and materials predict "
        f"{format_number(surprise.expected)} ± {format_number(surprise.expected_sd, 2)} kg; the weighing is used"
    )


def _name_material(name: str) -> str:
    return name.replace("_", " ")


def _tabulate(advice: Ranking, question: AdviceQuestion, width: int) -> list[str]:
    """Formats the options as a table within a width; intervals are 90 %, peaks are 95 % quantiles."""
    of_cost = _COST_TITLES.get(advice.criterion)
    header = ["", "work (J)", of_cost or "", "P(best)", "P(feasible)", "torque share", "force (N)", "moment (N m)"]
    rows, notes = [header], []
    for each in advice.ranked:
        amounts = each.amounts
        name = f"{each.option.object_name}, {_list_ends(each.option, question)}"
        costs = [_range(amounts.work), _range(amounts.cost) if of_cost else ""]
        forces = _number(amounts.force.p95), _number(amounts.moment.p95)
        peaks = [f"{_percent(amounts.margin.p95)} {amounts.joint}", *forces] if each.q_start.size else ["", "", ""]
        rows.append([name, *costs, f"{each.p_best:.2f}", f"{each.p_feasible:.2f}", *peaks])
        if each.infeasible_reason:
            notes.append(f"{name}: {each.infeasible_reason}")
    empty = {_COST} if not of_cost else set()
    inner = max(width - 2, 1) if width else 0
    lines = tabulate_within(rows, inner, _LESS_IMPORTANT, left_out=empty)
    wrapped = [
        part for note in notes for part in (textwrap.wrap(note, inner, subsequent_indent="  ") if width else [note])
    ]
    return [f"  {line}" for line in (*lines, *wrapped)]


def _describe_reasons(advice: Ranking, question: AdviceQuestion) -> list[str]:
    reasons = question.reasons
    if reasons is None:
        return ["Why: no other option can do the task with the required probability."]
    best, rival = advice.ranked[0], advice.ranked[reasons.rival]
    against = f"Why {_name(best.option, question)} rather than {_name(rival.option, question)}:"
    shares = {name: share for name, share in sum_shares(reasons, question).items() if share >= _LEAST_SHARE}
    if not shares:
        lines = [f"{against} no material's density affects the difference in cost."]
    else:
        parts = [f"{_name_material(name)} ({_percent(share)})" for name, share in shares.items()]
        lines = [f"{against} their difference in cost is uncertain because of the density of {' and '.join(parts)}."]
    told = [turn for turn in list_turns(reasons, question) if turn.probability >= _LEAST_PROBABILITY]
    lines += [f"  {_capitalise(_describe_turn(turn, advice, question))}." for turn in told]
    return lines if told else [*lines, "  No plausible density of one material would change the choice by itself."]


def _describe_turn(turn: Turn, advice: Ranking, question: AdviceQuestion) -> str:
    side = "denser" if turn.above else "less dense"
    other = _name(advice.ranked[turn.option].option, question)
    material = _name_material(question.names(turn.colour))
    return (
        f"if {material} were known to be {side} than {format_number(turn.density)} kg/m³ "
        f"(probability {turn.probability:.2g}), {other} would be better"
    )


def _capitalise(sentence: str) -> str:
    return f"{sentence[:1].upper()}{sentence[1:]}"


def _describe_cost(best: RankedOption, criterion: Criterion) -> str:
    amounts, cost = best.amounts, best.amounts.cost
    if criterion is Criterion.MARGIN:
        return f"at most {_percent(cost.p95)} of the torque limit of {amounts.joint}"
    if criterion is Criterion.GRIP:
        return f"at most {_number(amounts.force.p95)} N and {_number(amounts.moment.p95)} N m at the grip"
    unit = "J" if criterion is Criterion.WORK else "N²m²s"
    half = 0.5 * (cost.p95 - cost.p05)
    return f"{format_known(cost.mean, half)} ± {format_known(half, half)} {unit}"


def _name(option: Option, question: AdviceQuestion) -> str:
    """Names an option: "the mallet by its head", "the mallet choked", "the rod by either end"."""
    if not option.grip:
        return name_object(option.object_name)
    alike = question.alike.get(option.name, ())
    if alike:
        how = "by either end" if len(alike) == 1 else f"by any of {_list_ends(option, question)}"
        return f"{name_object(option.object_name)} {how}"
    return name_gripped(option.name)


def _list_ends(option: Option, question: AdviceQuestion) -> str:
    """Lists the grip of an option and its equivalent grips."""
    return " or ".join([option.grip, *question.alike.get(option.name, ())])


def _range(amount: Amount) -> str:
    if not np.isfinite(amount.mean):
        return ""
    half = 0.5 * (amount.p95 - amount.p05)
    mean, low, high = (format_known(value, half) for value in (amount.mean, amount.p05, amount.p95))
    return f"{mean} ({low} to {high})"


def _number(value: float) -> str:
    return format_number(value) if np.isfinite(value) else ""


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
