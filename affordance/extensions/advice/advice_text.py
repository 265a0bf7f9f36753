"""Formats advice on tools from the same content that ``--json`` prints."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from affordance.choice.demand import Criterion
from affordance.choice.options import Option
from affordance.choice.picking import MIN_FEASIBILITY
from affordance.choice.pricing import Amount
from affordance.choice.ranking import SAME, Ranking
from affordance.choice.reasons import Reasons
from affordance.choice.weighed import Surprise
from affordance.exceptions import name_gripped, name_object
from affordance.extensions.memory.ledger import describe_past_arms
from affordance.files.atomic import to_plain
from affordance.objects.colour import Colour, find_nearest_colour
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.reporting.formatting import break_line, format_known, format_number, tabulate_within

# Advice, or a part of it, in the format of the JSON output.
type Content = Mapping[str, Any]


def name_materials(tools: Sequence[Tool], materials: Mapping[str, Material]) -> Callable[[Colour], str]:
    """Returns a function that names the material of a colour.

    If no part of the tools has this colour, the function names the material with the most similar colour.
    """
    shown: dict[Colour, str] = {
        part.looks_like.colour: part.looks_like.name for tool in tools for part in tool.components
    }
    colours = {name: material.colour for name, material in materials.items()}
    return lambda colour: shown.get(colour) or find_nearest_colour(colour, colours)


def build_content(ranking: Ranking, reasons: Reasons | None, names: Callable[[Colour], str]) -> dict[str, Any]:
    """Builds the JSON content of a ranking, with None for infinite numbers.

    Args:
        ranking: Ranking with at least one usable option.
        reasons: Reasons for the choice; None if no other option is usable.
        names: Function that names the material of a colour.
    """
    criterion = ranking.criterion
    options = [
        {
            **_identify(each.option),
            "alike": list(each.option.alike),
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
        for each in ranking.ranked
    ]
    content = {
        "by": criterion.value,
        "unit": criterion.unit,
        "statistic": "p95" if criterion.is_peak else "mean",
        "choice": _identify(ranking.best.option),
        "ties": [_identify(each.option) for each in ranking.ties],
        "options": options,
        "p_none": ranking.p_none,
        "why": None if reasons is None else _build_reasons(ranking, reasons, names),
    }
    plain: dict[str, Any] = to_plain(content)
    return {**plain, "sentence": describe_choice(plain)}


def _build_reasons(ranking: Ranking, reasons: Reasons, names: Callable[[Colour], str]) -> dict[str, Any]:
    # In pictures, one material can have several colours. Their shares are added, and only the most probable change in
    # each direction is kept.
    shares: dict[str, float] = {}
    for each in reasons.shares:
        shares[names(each.colour)] = shares.get(names(each.colour), 0.0) + each.share
    changes: dict[tuple[str, bool], dict[str, Any]] = {}
    for turn in reasons.turns:
        material = names(turn.colour)
        change = {
            "material": material,
            "above" if turn.above else "below": turn.density,
            "probability": turn.probability,
            **_identify(ranking.ranked[turn.option].option),
        }
        changes.setdefault((material, turn.above), change)
    largest_first = sorted(shares.items(), key=lambda each: -each[1])
    return {
        "rival": _identify(ranking.ranked[1].option),
        "materials": [{"material": name, "share": share} for name, share in largest_first],
        "rest": reasons.rest,
        "changes": list(changes.values()),
    }


def _identify(option: Option) -> dict[str, str]:
    return {"tool": option.object_name, "grip": option.grip}


def _show(amount: Amount) -> dict[str, float | None]:
    return {name: _finite(value) for name, value in amount._asdict().items()}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


# Thresholds for mentioning facts in the text: share of a material in the uncertainty, probability of a change of the
# choice, and probability of a change that is mentioned in the first sentence.
_LEAST_SHARE, _LEAST_PROBABILITY, _NOTABLE = 0.05, 1e-3, 0.05
_BY = {
    Criterion.WORK: "the joints' expected work",
    Criterion.EFFORT: "the joints' expected effort",
    Criterion.MARGIN: "the highest fraction of a joint's torque limit (95 % quantile)",
    Criterion.GRIP: "the wrench that the grip must hold (95 % quantile)",
}
_COST_TITLES = {Criterion.EFFORT: "effort (N²m²s)", Criterion.GRIP: "wrench as a force (N)"}
# Columns of the table, and the order in which columns are dropped if the table is too wide.
_WORK, _COST, _BEST, _FEASIBLE, _SHARE, _FORCE, _MOMENT = range(1, 8)
_LESS_IMPORTANT = (_MOMENT, _FORCE, _SHARE, _FEASIBLE, _WORK)


def describe_advice(content: Content, width: int = 0) -> list[str]:
    """Formats advice as a main sentence, a table, and reasons.

    Args:
        content: Content of the advice.
        width: Width of the terminal, which limits the table; 0 for no limit.
    """
    knowledge = describe_knowledge(content)
    title = f"{content['task']} with {content['robot']}, compared by {_BY[Criterion(content['by'])]}; {knowledge}"
    lines = [content["sentence"], title, *(describe_surprise(Surprise(**each)) for each in content["surprises"])]
    lines += [f"warning: {each}" for each in content["remarks"]]
    lines.append(describe_past_arms(content["robot"], content["trials_of_other_arms"]))
    lines += [f"  {line}" for line in _tabulate(content, width)]
    if content["p_none"] > 0.0:
        lines.append(f"  with probability {content['p_none']:.2f} no option is feasible")
    return lines + _describe_reasons(content)


def describe_choice(content: Content) -> str:
    """Describes the chosen option in one sentence, with its cost, certainty, and probable alternatives.

    A density that would change the choice is included if it is probable enough.
    """
    by, options = Criterion(content["by"]), content["options"]
    best, better = options[0], max(options, key=lambda each: each["p_best"])
    num_usable = sum(each["usable"] for each in options)
    needed = f"a probability of {100.0 * MIN_FEASIBILITY:g} %"
    parts = [f"Take {_name(best)}: {_describe_cost(best, by)}, best with probability {best['p_best']:.2f}"]
    if better["p_best"] > best["p_best"]:
        name, p = _name(better), f"{better['p_best']:.2f}"
        if better["usable"]:
            how = "demands more if it is heavy" if by.is_peak else "costs more on average"
            parts.append(f"{name} is best more often ({p}), but {how} ({_describe_cost(better, by)})")
        else:
            only = "the only one" if num_usable == 1 else "one"
            parts.append(f"it is {only} that is feasible with {needed}")
            only = f"feasible with probability {better['p_feasible']:.2f} only"
            parts.append(f"{name} is best with probability {p}, but {only}")
    elif num_usable == 1 and len(options) > 1:
        parts.append("no other option can be used")
    if content["ties"]:
        tied = [_name(_find(each, options)) for each in content["ties"]]
        parts.append(f"{' and '.join(tied)} cost{'s' if len(tied) == 1 else ''} the same to {100.0 * SAME:g} %")
    changes = content["why"]["changes"] if content["why"] else []
    parts += [_describe_change(each, options) for each in changes if each["probability"] >= _NOTABLE][:1]
    return f"{'; '.join(parts)}."


def describe_knowledge(content: Content) -> str:
    """Describes the sources of the belief about materials, and the variability of objects."""
    known, learned, unknown = (
        ", ".join(map(_name_material, content[key])) for key in ("known", "learned", "unknown")
    )
    parts, memory = [], content["memory"]
    if known:
        parts.append(f"handbook densities of {known} (--know nothing leaves them out)")
    if learned:
        parts.append(f"evidence about {learned} from the memory {memory}")
    elif memory:
        parts.append(f"no evidence from the memory {memory}")
    if unknown:
        parts.append(f"the prior of any material for {unknown}")
    if content["deviation"]:
        parts.append(f"{100.0 * content['deviation']:g} % from object to object are added to each spread")
    return "; ".join(parts)


def describe_surprise(surprise: Surprise) -> str:
    """Formats a warning about a weighing that contradicts the drawing and the materials."""
    return (
        f"warning: {surprise.name} weighs {format_number(surprise.mass)} kg, but its drawing and materials predict "
        f"{format_number(surprise.expected)} ± {format_number(surprise.expected_sd, 2)} kg; the weighing is used"
    )


def _name_material(name: str) -> str:
    return name.replace("_", " ")


def _tabulate(content: Content, width: int) -> list[str]:
    """Formats the options as a table of at most ``width`` characters.

    Intervals cover 90 %. Peak forces and moments are 95 % quantiles.
    """
    of_cost = _COST_TITLES.get(Criterion(content["by"]), "")
    rows = [["", "work (J)", of_cost, "P(best)", "P(feasible)", "torque share", "force (N)", "moment (N m)"]]
    inner, notes = max(width - 2, 1) if width else 0, []
    for each in content["options"]:
        name, share = f"{each['tool']}, {_list_ends(each)}", each["torque_share"]
        costs = [_range(each["work"]), _range(each["cost"]) if of_cost else ""]
        loads = [f"{_percent(share['p95'])} {share['joint']}" if share["p95"] is not None else ""]
        loads += [_number(each[key]["p95"]) for key in ("grip_force", "grip_moment")]
        rows.append([name, *costs, f"{each['p_best']:.2f}", f"{each['p_feasible']:.2f}", *loads])
        notes += break_line(f"{name}: {each['reason']}", inner) if each["reason"] else []
    return [*tabulate_within(rows, inner, _LESS_IMPORTANT, left_out=() if of_cost else (_COST,)), *notes]


def _describe_reasons(content: Content) -> list[str]:
    why, options = content["why"], content["options"]
    if why is None:
        return ["Why: no other option can be used."] if len(options) > 1 else []
    against = f"Why {_name(options[0])} rather than {_name(_find(why['rival'], options))}:"
    materials = [each for each in why["materials"] if each["share"] >= _LEAST_SHARE]
    parts = [f"{_name_material(each['material'])} ({_percent(each['share'])})" for each in materials]
    of_what = f"their difference in cost is uncertain because of the density of {' and '.join(parts)}."
    lines = [f"{against} {of_what if parts else "no material's density affects the difference in cost."}"]
    told = [_describe_change(each, options) for each in why["changes"] if each["probability"] >= _LEAST_PROBABILITY]
    return [
        *lines,
        *(f"  {each[:1].upper()}{each[1:]}." for each in told),
        *([] if told else ["  No plausible density of one material would change the choice by itself."]),
    ]


def _describe_change(change: Content, options: Sequence[Content]) -> str:
    side, density = ("denser", change["above"]) if "above" in change else ("less dense", change["below"])
    return (
        f"if {_name_material(change['material'])} were known to be {side} than {format_number(density)} kg/m³ "
        f"(probability {change['probability']:.2g}), {_name(_find(change, options))} would be better"
    )


def _describe_cost(option: Content, by: Criterion) -> str:
    cost = option["cost"]
    if by is Criterion.MARGIN:
        return f"at most {_percent(cost['p95'])} of the torque limit of {option['torque_share']['joint']}"
    if by is Criterion.GRIP:
        force, moment = (_number(option[key]["p95"]) for key in ("grip_force", "grip_moment"))
        return f"at most {force} N and {moment} N m at the grip"
    unit = "J" if by is Criterion.WORK else "N²m²s"
    half = 0.5 * (cost["p95"] - cost["p05"])
    return f"{format_known(cost['mean'], half)} ± {format_known(half, half)} {unit}"


def _find(named: Content, options: Sequence[Content]) -> Content:
    """Finds an option by tool and grip."""
    return next(each for each in options if (each["tool"], each["grip"]) == (named["tool"], named["grip"]))


def _name(option: Content) -> str:
    return name_option(option["tool"], option["grip"], option["alike"])


def name_option(tool: str, grip: str, alike: Sequence[str]) -> str:
    """Names a tool and its grip: "the mallet by its head", "the mallet choked", "the rod by either end"."""
    if alike:
        ends = [grip, *alike]
        how = "by either end" if len(alike) == 1 else f"by any of {', '.join(ends[:-1])} and {ends[-1]}"
        return f"{name_object(tool)} {how}"
    return name_gripped(f"{tool} by {grip}") if grip else name_object(tool)


def _list_ends(option: Content) -> str:
    """Lists the grip of an option and its equivalent grips."""
    return " or ".join([option["grip"], *option["alike"]])


def _range(amount: Content) -> str:
    if amount["mean"] is None:
        return ""
    half = 0.5 * (amount["p95"] - amount["p05"])
    mean, low, high = (format_known(amount[key], half) for key in ("mean", "p05", "p95"))
    return f"{mean} ({low} to {high})"


def _number(value: float | None) -> str:
    return "" if value is None else format_number(value)


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
