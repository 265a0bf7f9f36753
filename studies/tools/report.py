"""Report of the study of tools: claims about masses, intervals, grips and blows, and the results in words."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from affordance.exceptions import name_object
from affordance.reporting.claims import PERCENT, ClaimResult, Criterion, Unit, check, claim
from affordance.reporting.section import ReportFigure, Section
from studies.tools.data_set import LEARNING, Half
from studies.tools.numbers import list_metrics
from studies.tools.observer import HOLDS
from studies.tools.seen import Source
from studies.tools.study import Choices, ToolsResult
from studies.tools.uncommon import CheckedMass, CheckedMotion
from studies.tools.which_end import AFTER, ONE_DENSITY

THREE, FOUR = Unit(digits=3), Unit(digits=4)
PERCENT_2 = Unit("%", 100.0)
# Owners of hammers, by the key of the choices about them.
_WHOSE = {"own": "our own", "data set": "the data set's"}


def describe(result: ToolsResult) -> Section:
    """Describes the results; without the data set, only those of our own tools."""
    has_data, ends = bool(result.scores), _describe_ends(result)
    motions = _describe_mashing(result.uncommon.motions, result.uncommon.masses)
    return Section(
        order=32,
        title="Real tools",
        summary=_describe_data(result) if has_data else ends,
        finding=" ".join(_find_ends(whose, found) for whose, found in _list_choices(result).items()),
        figures=_list_figures(has_data=has_data),
        claims=judge(measure(result)),
        tables=[],
        remarks=[*([ends] if has_data else []), *([motions] if motions else [])],
    )


def measure(result: ToolsResult) -> dict[str, Any]:
    """Computes the numbers that claims are about, except those of parts that were not run.

    Returns:
        Numbers of metrics.json; ``blow_force_error`` and ``blow_work_error``, relative, for each blow; ``has_test``;
        and ``of_halves``, which has the errors and coverage of each half after each number of holds, by name of the
        half.
    """
    blows = [blow for choices in result.choices.values() for blow in choices.blows]
    halves = result.config.halves if result.scores else ()
    return {
        **list_metrics(result),
        "records": result.records,  # has NaN where metrics.json has None
        "blow_force_error": [abs(blow.force / blow.force_aimed - 1.0) for blow in blows],
        "blow_work_error": [abs(blow.work / blow.work_planned - 1.0) for blow in blows],
        "of_halves": {half.value: _measure_half(result, half) for half in halves},
    }


def _measure_half(result: ToolsResult, half: Half) -> dict[str, Any]:
    """Scores predictions for the tools of one half from drawings and two pictures, after each number of holds."""
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
            "sight_error": float(np.nanmedian(np.abs(np.expm1(errors)))),  # relative, at true densities
            "sight_alde": [found.alde for found in seen],
            "sight_coverage_mass": [found.coverage_mass for found in seen],
            "sight_coverage_com": [found.coverage_com for found in seen],
        }
    return numbers


def judge(n: Mapping[str, Any]) -> list[ClaimResult]:
    """Judges the claims from the numbers of ``measure``; omits those about halves or pictures that were not run."""
    halves = n["of_halves"]
    return [
        claim("blows_force", "ours", "Blows with real tools drive the nail as planned.",
              _check_largest("largest error of the peak force", n["blow_force_error"])),
        claim("blows_work", "ours", "The work of these blows is as planned.",
              _check_largest("largest error of the work", n["blow_work_error"])),
        *(_judge_meshes(n["parity"]) if halves else []),
        *(each for name, half in halves.items() for each in _judge_half(name, half)),
        *(_judge_records(n["records"]["high"]) if halves else []),
        *([claim("told_apart", "ours", "Materials are distinguished in pictures.",
                 check("number of tools, of 20", n["segmented"], Unit(digits=0), at_least=18))]
          if Half.TEST.value in halves else []),
    ]  # fmt: skip


def _check_largest(name: str, errors: Sequence[float]) -> Criterion:
    return check(name, max(errors, default=math.nan), PERCENT, at_most=0.05)


def _judge_meshes(parity: Mapping[str, Any]) -> list[ClaimResult]:
    return [
        claim("meshes", "ours",
              "Masses, centres of mass and rotational inertias from meshes agree with those in the data set.",
              check("largest error of the mass", parity["mass"], PERCENT_2, at_most=0.005),
              check("largest error of the centre of mass", parity["com_mm"], Unit("mm"), at_most=0.3),
              check("largest error of the rotational inertia", parity["inertia"], PERCENT_2, at_most=0.005)),
    ]  # fmt: skip


def _judge_half(name: str, half: Mapping[str, Any]) -> list[ClaimResult]:
    tools = "tools left out of the learning half" if name == Half.LEARNING.value else "tools of the test half"
    claims = [
        claim(f"{name}_masses", "ours",
              f"Masses of {tools} are predicted from drawings, after one hold of each learning tool and after five.",
              check("mean absolute error of their logarithm after one hold", half["alde"][0], THREE, at_most=0.14),
              check("after five holds", half["alde"][1], THREE, at_most=0.09)),
        claim(f"{name}_intervals", "ours", f"Intervals of the masses of {tools} have the stated coverage.",
              check("coverage of 90 % intervals after one hold and after five",
                    half["coverage_mass"], PERCENT, at_least=0.83, at_most=0.97)),
    ]  # fmt: skip
    if "sight_error" in half:
        claims += [
            claim(f"{name}_volumes", "ours", f"Two pictures show the volumes of {tools}.",
                  check("median error of the mass at true densities", half["sight_error"], PERCENT, at_most=0.05)),
            claim(f"{name}_sight", "ours", f"Masses of {tools} are predicted from pictures.",
                  check("mean absolute error of their logarithm after one hold and after five",
                        half["sight_alde"], THREE, at_most=0.18)),
            claim(f"{name}_sight_intervals", "ours",
                  f"Intervals from pictures contain masses and centres of mass of {tools}.",
                  check("coverage of 90 % intervals of the mass after one hold and after five",
                        half["sight_coverage_mass"], PERCENT, at_least=0.85),
                  check("coverage for the centre of mass", half["sight_coverage_com"], PERCENT, at_least=0.85)),
        ]  # fmt: skip
    return claims


def _judge_records(high: Mapping[str, Mapping[str, float]]) -> list[ClaimResult]:
    ours, theirs = high["ours"], high["hps_stored"]
    return [
        claim("records", "ours",
              "At the highest noise, mass, centre of mass and inertia are identified from the data set's records.",
              check("mean error of the mass", ours["mass"], FOUR, at_most=0.007),
              check("mean error of the centre of mass", ours["com"], FOUR, at_most=0.0015),
              check("mean error of the inertia", ours["inertia"], FOUR, at_most=0.01)),
        claim("records_peers", "ours",
              "Errors of the mass at the highest noise are no larger than those of the data set's authors.",
              check("mean error divided by theirs", ours["mass"] / theirs["mass"], at_most=1)),
    ]  # fmt: skip


def _list_figures(*, has_data: bool) -> list[ReportFigure]:
    captions = {
        "grips": (
            "Which end of which hammer: the chosen grip, which has the least expected work, by geometry and belief,"
            " with the probability that it is the best of its tool. A tick means that it is the best one at true"
            " densities."
        ),
        "uncommon": "The paper's figure 1 with two objects of ours: pictures, predictions, and simulated results.",
        "holding": "The arm with each hammer, in the correct grip for driving a nail.",
        "seen": "From pictures to solids: the object in one picture, the colours detected in it, and the columns.",
    }
    if has_data:
        captions |= {
            "first_touch": "Mass predicted before first touch against true mass, with 90 % intervals, one observer.",
            "measures": "Mean absolute error of the logarithm of mass, by geometry and number of holds.",
            "records": "Errors on the data set's own force-torque records, by noise and method.",
        }
    return [ReportFigure(file=f"{name}.png", caption=caption) for name, caption in captions.items()]


def _describe_data(result: ToolsResult) -> str:
    lost = [_name(name) for name, outcome in result.made_out.items() if not outcome.made_out]
    painted = [outcome.made_out for outcome in result.painted.values()]
    unsure = sum(len(outcome.unsure) for outcome in result.made_out.values())
    told_apart = f"Not distinguished: {', '.join(lost)}." if lost else "All were distinguished."
    return (
        "Ten workshop tools were held, and the masses of the others were predicted before they were touched, by"
        f" {result.config.observers} observers. Every choice was made on the learning half, in which only tools whose"
        f" materials recur in others are judged; the test half was run once. {told_apart} In the data set's own"
        f" paint, materials of {sum(painted)} of {len(painted)} tools were distinguished. {unsure} looks may be of"
        " more than one material; the belief about these is a mixture."
    )


def count_right(choices: Choices, belief: str, task: str, geometry: str) -> tuple[int, int]:
    """Counts the tools for which the correct grip is chosen; returns that count and the number of tools."""
    ranking, names = choices.rankings[task, geometry, belief], [tool.name for tool in choices.tools]
    return sum(ranking.find_best_grip(name) == choices.find_right(task, name) for name in names), len(names)


def _list_choices(result: ToolsResult) -> dict[str, Choices]:
    """Returns the choices by the owner of the hammers, in words."""
    return {_WHOSE[whose]: each for whose, each in result.choices.items() if each.tools}


def _list_cases() -> list[tuple[str, str, str]]:
    """Lists tasks and geometries: name of the task, its words, and name of the geometry."""
    tasks = {"hammer": "driving a nail", "reach": "reaching"}
    return [(task, words, geometry) for task, words in tasks.items() for geometry in ("drawing", "pictures")]


def _find_ends(whose: str, choices: Choices) -> str:
    cases = []
    for task, words, geometry in _list_cases():
        right, count = count_right(choices, AFTER, task, geometry)
        cases.append(f"for {words} in {right} of {count} cases by {geometry}")
    return f"After experience with other objects, the right end of {whose} hammers is chosen {', '.join(cases)}."


def _describe_ends(result: ToolsResult) -> str:
    """Describes which end of which hammer is chosen, with and without different densities."""
    sentences = []
    for whose, choices in _list_choices(result).items():
        cases = []
        for task, words, geometry in _list_cases():
            after, count = count_right(choices, AFTER, task, geometry)
            one, _ = count_right(choices, ONE_DENSITY, task, geometry)
            best = choices.rankings[task, geometry, AFTER].ranked[0]
            cases.append(
                f"for {words}, by {geometry}: right end of {after} of {count} tools after experience, of {one}"
                f" with one density for everything; first choice {name_object(_name(best.option.object_name))},"
                f" grip {_name(best.option.grip)} (p = {best.p_best:.2f})"
            )
        sentences.append(f"Which end of {whose} three hammers to hold: {'; '.join(cases)}.")
    return " ".join(sentences)


def _describe_mashing(motions: Sequence[CheckedMotion], masses: Sequence[CheckedMass]) -> str:
    """Describes the choice between two kitchen tools, and the results of holding them; empty without motions."""
    if not motions:
        return ""
    best, cheapest = motions[0], min(motions, key=lambda motion: motion.simulated)
    held = "; ".join(
        f"{name_object(_name(mass.object_name))} weighs {mass.mass:.2f} kg, looks like {mass.seen[1]:.2f}"
        f" ({mass.seen[0]:.2f} to {mass.seen[2]:.2f}), and once held is believed to weigh {mass.held[1]:.2f}; it"
        f" {'rises' if mass.rise > 0 else 'sinks'} by {abs(100.0 * mass.rise):.1f} cm"
        for mass in masses
    )
    return (
        "Two kitchen tools that nobody has seen are used for mashing: from two pictures and experience with other"
        f" objects, the {_name(best.object_name)} by its {_name(best.grip)} is chosen (p = {best.p_best:.2f};"
        f" {best.p_best_before:.2f} before experience), with {best.work[1]:.1f} J predicted and {best.simulated:.1f}"
        f" J simulated; the option cheapest in simulation is {name_object(_name(cheapest.object_name))} by its"
        f" {_name(cheapest.grip)} ({cheapest.simulated:.1f} J). In the hand: {held}. Hollow parts look solid from"
        " both sides, so only holding them reveals their mass."
    )


def _name(name: str) -> str:
    return name.replace("_", " ")
