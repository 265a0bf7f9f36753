"""Section of the study of real tools: the numbers of its claims, and its prose."""

from pathlib import Path
from typing import Any

from affordance.choice.which_end import AFTER, ONE_DENSITY
from affordance.exceptions import name_object
from affordance.reporting.section import Section, render_section
from studies.tools.data_set import LEARNING, Half
from studies.tools.geometry import Source
from studies.tools.numbers import count_right, find_median_error_of_sight, list_metrics
from studies.tools.observer import HOLDS
from studies.tools.study import Choices, ToolsResult

SECTION = Path(__file__).with_name("section.yaml")


def describe(result: ToolsResult) -> Section:
    """Describes what was found."""
    return render_section(SECTION, list_numbers(result), _list_facts(result))


def list_numbers(result: ToolsResult) -> dict[str, Any]:
    """The numbers that claims are about: those of metrics.json, of blows, and of each half of the tools."""
    blows = [blow for each in (result.own, result.hammers) if each is not None for blow in each.blows]
    return {
        **list_metrics(result),
        "records": result.records,  # with NaN where metrics.json has nothing
        "blow_force_error": [abs(blow.force / blow.force_aimed - 1.0) for blow in blows],
        "blow_work_error": [abs(blow.work / blow.work_planned - 1.0) for blow in blows],
        "of_halves": {half.value: _list_numbers_of_half(result, half) for half in result.config.halves}
        if result.scores
        else {},
    }


def _list_numbers_of_half(result: ToolsResult, half: Half) -> dict[str, Any]:
    """Scores by drawings and by two pictures, after each number of holds, of the tools of one half."""
    drawings = [result.scores[Source.CAD, holds, half] for holds in HOLDS]
    numbers: dict[str, Any] = {
        "alde": [found.alde for found in drawings],
        "coverage_mass": [found.coverage_mass for found in drawings],
    }
    if Source.TWO_VIEWS in result.config.sources:
        names = [name for name in result.truths if (name in LEARNING) == (half is Half.LEARNING)]
        seen = [result.scores[Source.TWO_VIEWS, holds, half] for holds in HOLDS]
        numbers |= {
            "sight_error": find_median_error_of_sight(result, Source.TWO_VIEWS, names),
            "sight_alde": [found.alde for found in seen],
            "sight_coverage_mass": [found.coverage_mass for found in seen],
            "sight_coverage_com": [found.coverage_com for found in seen],
        }
    return numbers


def _list_facts(result: ToolsResult) -> dict[str, Any]:
    """Prose, and what was run, which decides what claims are made."""
    has_data = bool(result.scores)
    return {
        "has_data": has_data,
        "has_learning": Half.LEARNING in result.config.halves,
        "has_test": Half.TEST in result.config.halves,
        "has_two_views": Source.TWO_VIEWS in result.config.sources,
        "first_touch": _describe_first_touch(result) if has_data else "",
        "own_choices": _describe_choices(result.own, "our own three"),
        "uncommon": _describe_uncommon(result),
        "other_choices": ""
        if result.hammers is None or not has_data
        else _describe_choices(result.hammers, "the data set's three"),
    }


def _describe_first_touch(result: ToolsResult) -> str:
    lost = [name for name, outcome in result.made_out.items() if not outcome.made_out]
    unsure = sum(len(outcome.unsure) for outcome in result.made_out.values())
    named = f"Not told apart: {', '.join(lost)}." if lost else "All were told apart."
    painted = sum(outcome.made_out for outcome in result.painted.values())
    return (
        f"Ten workshop tools were held, the others predicted before they were touched; {result.config.observers} "
        "observers. Everything was chosen on the learning half, where tools are judged that others can teach about; "
        f"the test half was run once. {named} In the data set's own paint it is {painted} of {len(result.painted)}. "
        f"{unsure} looks may be of more than one material, and are believed to be a mixture of them."
    )


def _describe_choices(choices: Choices, whose: str) -> str:
    found = []
    for task, words in (("hammer", "driving a nail"), ("reach", "reaching")):
        for geometry in ("drawing", "pictures"):
            after, count = count_right(choices, AFTER, task, geometry)
            one, _ = count_right(choices, ONE_DENSITY, task, geometry)
            best = choices.rankings[task, geometry, AFTER].ranked[0]
            tool = name_object(best.option.object_name)
            found.append(
                f"for {words}, by {geometry}: right end of {after} of {count} tools after experience, of {one} with "
                f"one density for everything; first choice {tool} by its {best.option.grip} "
                f"(p = {best.p_best:.2f})"
            )
    return f"Which end of {whose} hammers to hold: {'; '.join(found)}."


def _describe_uncommon(result: ToolsResult) -> str:
    motions, masses = result.uncommon.motions, result.uncommon.masses
    best = motions[0]
    weighed = "; ".join(
        f"{name_object(mass.object_name)} weighs {mass.mass:.2f} kg, looks like {mass.seen[1]:.2f} "
        f"({mass.seen[0]:.2f} to {mass.seen[2]:.2f}), and once held is believed to weigh {mass.held[1]:.2f}; "
        f"it {_say_rise(mass.rise)}"
        for mass in masses
    )
    cheapest = min(motions, key=lambda motion: motion.simulated)
    return (
        f"Two kitchen tools nobody has seen, for mashing: by two pictures and what other things weighed, the "
        f"{best.object_name} by its {best.grip} is taken (p = {best.p_best:.2f}; {best.p_best_before:.2f} before "
        f"experience), at {best.work[1]:.1f} J predicted and {best.simulated:.1f} J simulated; cheapest when "
        f"simulated is {name_object(cheapest.object_name)} by its {cheapest.grip} ({cheapest.simulated:.1f} J). In "
        f"the hand: {weighed}. What is hollow looks solid from both sides; only holding it tells."
    )


def _say_rise(rise: float) -> str:
    return f"{'rises' if rise > 0.0 else 'sinks'} by {100.0 * abs(rise):.1f} cm"
