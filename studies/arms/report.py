"""Report of the study of arms: which claims hold on each robot, and what decides how far its arm sags."""

import math
from collections.abc import Mapping
from typing import Any

from scipy.stats import spearmanr

from affordance.reporting.claims import ClaimResult, Unit, check, claim
from affordance.reporting.section import ReportFigure, Section, Table
from studies.arms.robot_study import EXPERIMENTS, OK

type Found = Mapping[str, Mapping[str, Any]]

_TASKS = {"reach": "reaching", "hammer": "hammering"}
# Largest fraction of control periods with an active limit for which an arm counts as free of limits.
FREE = 0.05


def select_loaded(found: Found) -> dict[str, Mapping[str, Any]]:
    """Selects the robots that were imported."""
    return {name: one for name, one in found.items() if one["metrics"]["loads"]}


def describe(found: Found, ours: Mapping[str, Any]) -> Section:
    """Describes the results of all robots, and of the arm that comes with the program."""
    header = ["robot", "joints, frozen", "parity", "payload (kg)", "torque at home", *EXPERIMENTS]
    header += ["x real time", "first drop (cm)", "extra cost of the costlier grip (%)", "claims met"]
    caption = (
        "All robots. Torque at home is the largest fraction of a torque limit with an empty hand; the last column but"
        " one shows by how much the costlier grip exceeds the other one in reaching and in hammering."
    )
    figure = ReportFigure(
        file="arms.png",
        caption=(
            "Left: simulated fall of the first object of Simulation I in the hand of each arm, against the fall"
            " predicted by the formula, which has no constant to fit. Middle: the same fall against how heavy the"
            " arm is at the hand; for the green lines every joint of an arm has rotors of 0.03, 0.1 and 0.3 kg m²."
            " Right: by how much the costlier grip of the stick exceeds the other one."
        ),
    )
    return Section(
        order=30,
        title="The same claims on other arms",
        summary=_summarise(select_loaded(found), ours),
        figures=[figure],
        claims=judge(count(found)),
        tables=[
            Table(caption, header, [_list_cells(name, one) for name, one in found.items()]),
            *list_verdicts(found),
        ],
        remarks=[],
    )


def count(found: Found) -> dict[str, Any]:
    """Counts the results that the claims are about, over all robots; a count is None if nothing could be measured."""
    metrics = [one["metrics"] for one in select_loaded(found).values()]
    required = [one["metrics"]["experiments"] for one in found.values() if one["required"]]
    parities = [each["parity_error"] for each in metrics if each["parity_error"] is not None]
    return {
        "num_required": len(required),
        "num_complete": sum(all(each[name] == OK for name in EXPERIMENTS) for each in required),
        "parity_error": max(parities, default=None),
        "real_time_factor": min((each["real_time_factor"] for each in metrics), default=None),
    }


def judge(n: Mapping[str, Any]) -> list[ClaimResult]:
    """Judges the claims from the numbers of ``count``."""
    complete = n["num_complete"] / n["num_required"] if n["num_required"] else math.nan
    parity, factor = ([] if n[key] is None else n[key] for key in ("parity_error", "real_time_factor"))
    return [
        claim("complete", "ours", "All four simulations run on the arms that must support them, from unedited files.",
              check("share of these robots on which four simulations ran",
                    complete, Unit("%", 100.0, 0), at_least=1)),
        claim("parity", "ours", "Mass matrix, gravity, inverse dynamics and tip pose agree with Pinocchio.",
              check("largest relative difference", parity, at_most=1e-9)),
        claim("real_time", "ours", "A hold is simulated at least five times as fast as real time.",
              check("smallest real-time factor", factor, Unit(digits=1), at_least=5)),
    ]  # fmt: skip


def _summarise(loaded: Found, ours: Mapping[str, Any]) -> str:
    """Summarises falls, costs and velocities of the robots that were imported."""
    sentences = [
        "The simulations run on the arms of robots as their makers ship them, each with a path, a blow and objects"
        " that the arm can manage."
    ]
    if not loaded:
        return f"{sentences[0]} No robot was imported."
    sentences.append(
        "An arm sags under an object that is heavier than it believes, by (1 + 1/N) T²/6 times the acceleration"
        " that it did not foresee, where T is the horizon of its plan and N its number of steps. That acceleration is"
        " g times the unforeseen mass, divided by the sum of the arm's own effective mass at the hand and the"
        " believed mass. Nothing is fitted."
    )
    sags = [one["sag"] for one in loaded.values()]
    ratios = [sag["simulated"] / sag["predicted"] for sag in sags if sag["limited"] <= FREE]
    if ratios:
        sentences.append(
            f"On the {len(ratios)} arms that meet no limit the first object falls {min(ratios):.2f} to"
            f" {max(ratios):.2f} times as far as predicted: a small fall overshoots, and in a large fall the arm's"
            " posture changes."
        )
    drops = sorted(((one["weight"]["drop_m"][0], name) for name, one in loaded.items() if "weight" in one))
    if drops:
        (least, of_least), (most, of_most) = drops[0], drops[-1]
        own = 100.0 * ours["weight"]["drop_m"][0] if "weight" in ours else math.nan
        sentences.append(
            f"The first drop is {100.0 * least:.1f} cm ({of_least}) to {100.0 * most:.1f} cm ({of_most}); on our"
            f" own arm it is {own:.1f} cm."
        )
    for task in _TASKS:
        arms = [one for one in loaded.values() if task in one]
        if len(arms) >= 3:
            works = [get_excess(one, task) for one in arms]
            rho = float(spearmanr([get_mass_ratio(one["sag"]) for one in arms], works).statistic)
            sentences.append(
                f"In {_TASKS[task]} the costlier grip costs {100.0 * min(works):.1f} to"
                f" {100.0 * max(works):.1f} % more; its rank correlation with the arm's effective mass divided by"
                f" the object's mass is {rho:.2f}."
            )
    over = {name: one["heavy"] for name, one in loaded.items() if one["heavy"]["rate"] > 1.0}
    if over:
        rates = ", ".join(f"{name} {heavy['rate']:.2f} ({heavy['rate_joint']})" for name, heavy in over.items())
        sentences.append(
            "The plan keeps the limits of velocity under the believed inertia. Under a wrong belief a joint exceeds"
            " its limit by the velocity that it gains beyond its plan in one step (20 ms). When the heaviest object"
            f" is held for the first time, the largest ratios of velocity to limit are {rates}; on all other arms"
            " they are less than 1."
        )
    return " ".join(sentences)


def list_verdicts(found: Found) -> tuple[Table, ...]:
    """Tabulates by robot whether each claim of the experiments is met; returns no table if there are no claims."""
    known = {name: one["claims"] for name, one in found.items() if one.get("claims")}
    texts = dict.fromkeys((task, text) for claims in known.values() for task in claims for text in claims[task])
    words = {True: "met", False: "not met", None: "-"}
    rows = [
        [f"{task}: {text}", *(words[claims.get(task, {}).get(text)] for claims in known.values())]
        for task, text in texts
    ]
    caption = "Whether the simulations' claims are met on each robot."
    return (Table(caption, ["claim", *known], rows),) if rows else ()


def get_excess(one: Mapping[str, Any], task: str) -> float:
    """Returns by what fraction the work of the costlier grip exceeds that of the other."""
    return float(one[task]["energy_ratio_true"]) - 1.0


def get_mass_ratio(sag: Mapping[str, Any]) -> float:
    """Returns the effective mass of an arm divided by the mass of the object that it holds."""
    return float(sag["arm_mass"] / sag["object_mass"])


def _list_cells(name: str, one: Mapping[str, Any]) -> list[str]:
    """Lists the cells of a robot's row, as many as the section's table has columns."""
    metrics = one["metrics"]
    if not metrics["loads"]:
        return [name, metrics["experiments"]["weight"], *[""] * 11]
    verdicts = [met for claims in one["claims"].values() for met in claims.values()]
    return [
        name,
        f"{metrics['joints']}, {metrics['frozen_joints']}",
        "-" if metrics["parity_error"] is None else f"{metrics['parity_error']:.0e}",
        f"{metrics['payload_kg']:.2f}",
        f"{metrics['home_torque_ratio']:.2f}",
        *("ok" if metrics["experiments"][each] == OK else metrics["experiments"][each] for each in EXPERIMENTS),
        f"{metrics['real_time_factor']:.1f}",
        f"{100.0 * one['weight']['drop_m'][0]:.1f}" if "weight" in one else "-",
        ", ".join(f"{100.0 * get_excess(one, task):.1f}" if task in one else "-" for task in _TASKS),
        f"{sum(verdicts)} of {len(verdicts)}",
    ]
