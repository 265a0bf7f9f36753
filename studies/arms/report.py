"""Report of the study of arms: what became of the claims on each robot, and what decides how far its arm sags."""

import math
from collections.abc import Mapping
from typing import Any

from scipy.stats import spearmanr

from affordance.reporting.claims import ClaimResult, Unit, check, claim
from affordance.reporting.section import ReportFigure, Section, Table
from studies.arms.robot_study import EXPERIMENTS, OK

type Found = Mapping[str, Mapping[str, Any]]

_TASKS = {"reach": "reaching", "hammer": "hammering"}
# Fraction of control periods with an active limit up to which an arm counts as free.
FREE = 0.05


def select_loaded(found: Found) -> dict[str, Mapping[str, Any]]:
    """Selects the robots that were imported."""
    return {name: one for name, one in found.items() if one["metrics"]["loads"]}


def describe(found: Found, ours: Mapping[str, Any]) -> Section:
    """Describes what was found of all robots, and of the arm that comes with the program."""
    header = ["robot", "joints, frozen", "parity", "payload (kg)", "torque at home", *EXPERIMENTS]
    header += ["x real time", "first drop (cm)", "more costly grips (%)", "claims met"]
    caption = (
        "Every robot. Torque at home is the largest share of a torque limit with an empty hand; the last but one"
        " column shows by how much the more costly grip exceeds the other one in reaching and in hammering."
    )
    figure = ReportFigure(
        file="arms.png",
        caption=(
            "Left: fall of the first object of Simulation I in the hand of each arm, simulated, against the"
            " prediction of the formula, which has no constant to fit. Middle: the same fall against how heavy the"
            " arm is at the hand; green lines give every joint of an arm rotors of 0.03, 0.1 and 0.3 kg m². Right:"
            " by how much the more costly grip of the stick exceeds the other one."
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
    """Counts what claims are about, over all robots; None where nothing could be measured."""
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
    """Judges the claims by the numbers of ``count``."""
    complete = n["num_complete"] / n["num_required"] if n["num_required"] else math.nan
    parity, factor = ([] if n[key] is None else n[key] for key in ("parity_error", "real_time_factor"))
    return [
        claim("complete", "ours", "All four simulations run on the arms that were asked for, from unedited files.",
              check("robots with four simulations, of those that must have them",
                    complete, Unit("%", 100.0, 0), at_least=1)),
        claim("parity", "ours", "Mass matrix, gravity, inverse dynamics and tip pose agree with Pinocchio.",
              check("largest relative difference", parity, at_most=1e-9)),
        claim("real_time", "ours", "A hold is simulated at least five times as fast as it takes.",
              check("smallest real-time factor", factor, Unit(digits=1), at_least=5)),
    ]  # fmt: skip


def _summarise(loaded: Found, ours: Mapping[str, Any]) -> str:
    """Summarises falls, costs and rates of the robots that were imported."""
    sentences = [
        "The simulations on the arms of robots as their makers ship them, each with a path, a blow and objects"
        " that it can do."
    ]
    if not loaded:
        return f"{sentences[0]} No robot was imported."
    sentences.append(
        "An arm sags under an object that it takes for lighter than it is by (1 + 1/N) T²/6 times the acceleration"
        " that it did not foresee, with T the horizon of its plan and N its steps. That acceleration is g times the"
        " mass not foreseen, over the sum of the arm's own effective mass at the hand and the believed mass. Nothing"
        " is fitted."
    )
    sags = [one["sag"] for one in loaded.values()]
    ratios = [sag["simulated"] / sag["predicted"] for sag in sags if sag["limited"] <= FREE]
    if ratios:
        sentences.append(
            f"On the {len(ratios)} arms that meet no limit the first object falls {min(ratios):.2f} to"
            f" {max(ratios):.2f} times as far as predicted: it overshoots a small fall, and turns away under a"
            " large one."
        )
    drops = sorted(((one["weight"]["drop_m"][0], name) for name, one in loaded.items() if "weight" in one))
    if drops:
        (least, of_least), (most, of_most) = drops[0], drops[-1]
        own = 100.0 * ours["weight"]["drop_m"][0] if "weight" in ours else math.nan
        sentences.append(
            f"The first drop is {100.0 * least:.1f} cm ({of_least}) to {100.0 * most:.1f} cm ({of_most}); for our"
            f" own arm it is {own:.1f} cm."
        )
    for task in _TASKS:
        arms = [one for one in loaded.values() if task in one]
        if len(arms) >= 3:
            works = [get_excess(one, task) for one in arms]
            rho = float(spearmanr([get_mass_ratio(one["sag"]) for one in arms], works).statistic)
            sentences.append(
                f"In {_TASKS[task]} the more costly grip costs {100.0 * min(works):.1f} to"
                f" {100.0 * max(works):.1f} % more; the rank correlation with the arm's effective mass over the"
                f" object's is {rho:.2f}."
            )
    over = {name: one["heavy"] for name, one in loaded.items() if one["heavy"]["rate"] > 1.0}
    if over:
        rates = ", ".join(f"{name} {heavy['rate']:.2f} ({heavy['rate_joint']})" for name, heavy in over.items())
        sentences.append(
            "Limits of rate are kept in the plan, by the believed inertia: under a wrong belief a joint exceeds"
            " its limit by what it accelerates beyond its plan in a step of the plan (20 ms). The first time the"
            f" heaviest object is held, the largest rates over their limits are {rates}; on all other arms they are"
            " less than 1."
        )
    return " ".join(sentences)


def list_verdicts(found: Found) -> tuple[Table, ...]:
    """Tabulates the verdict on each claim of the experiments by robot; returns no table if there are no claims."""
    known = {name: one["claims"] for name, one in found.items() if one.get("claims")}
    texts = dict.fromkeys((task, text) for claims in known.values() for task in claims for text in claims[task])
    words = {True: "met", False: "not met", None: "-"}
    rows = [
        [f"{task}: {text}", *(words[claims.get(task, {}).get(text)] for claims in known.values())]
        for task, text in texts
    ]
    caption = "What became of the simulations' claims on each robot."
    return (Table(caption, ["claim", *known], rows),) if rows else ()


def get_excess(one: Mapping[str, Any], task: str) -> float:
    """Returns the extra work of the more costly grip, over that of the other."""
    return float(one[task]["energy_ratio_true"]) - 1.0


def get_mass_ratio(sag: Mapping[str, Any]) -> float:
    """Returns the effective mass of an arm over that of the object that it holds."""
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
