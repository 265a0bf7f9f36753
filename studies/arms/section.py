"""Report section of the study of arms: table, claims and text."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scipy.stats import spearmanr

from affordance.reporting.section import Section, Table, render_section
from studies.arms.programs import NAMES, OK

SECTION = Path(__file__).with_name("section.yaml")
_Found = Mapping[str, Mapping[str, Any]]


def describe_study(found: _Found, ours: Mapping[str, Any]) -> Section:
    """Says what was found."""
    loaded = _select_loaded(found)
    facts = {
        "explanation": _explain(loaded, ours),
        "robot_rows": [_list_cells(name, one) for name, one in found.items()],
    }
    section = render_section(SECTION, list_numbers(found), facts)
    rows = _list_verdicts(found)
    verdicts = Table("What became of the simulations' claims on each robot.", ["claim", *_select_judged(found)], rows)
    return section._replace(tables=[*section.tables, verdicts] if rows else section.tables)


def list_numbers(found: _Found) -> dict[str, Any]:
    """The numbers that claims are about, of all robots; None where nothing could be measured."""
    metrics = [one["metrics"] for one in _select_loaded(found).values()]
    required = [one for one in found.values() if one["required"]]
    parities = [each["parity_error"] for each in metrics if each["parity_error"] is not None]
    return {
        "num_required": len(required),
        "num_complete": sum(_is_complete(one) for one in required),
        "parity_error": max(parities, default=None),
        "real_time_factor": min((each["real_time_factor"] for each in metrics), default=None),
    }


def _select_loaded(found: _Found) -> dict[str, Mapping[str, Any]]:
    return {name: one for name, one in found.items() if one["metrics"]["loads"]}


def _explain(loaded: _Found, ours: Mapping[str, Any]) -> str:
    """Writes the paragraph under the figure."""
    if not loaded:
        return "No robot was imported."
    ratios = {name: one["sag"]["simulated"] / one["sag"]["predicted"] for name, one in loaded.items()}
    free = {name: ratio for name, ratio in ratios.items() if loaded[name]["sag"]["limited"] <= 0.05}
    drops = {name: one["weight"]["drop_m"][0] for name, one in loaded.items() if "weight" in one}
    parts = [
        "An arm sags under an object it takes for lighter than it is by (1 + 1/N) T²/6 times the acceleration it did "
        "not foresee, with T the horizon of its plan and N its steps: by the mass not foreseen over the arm's own "
        "effective mass at the hand and the mass that is believed. Nothing in that is fitted."
    ]
    if free:
        low, high = min(free.values()), max(free.values())
        parts.append(
            f"On the {len(free)} arms that meet no limit the first object falls {low:.2f} to {high:.2f} times as far "
            "as predicted so: it overshoots a small fall, and turns away under a large one."
        )
    if drops:
        least, most = min(drops, key=drops.__getitem__), max(drops, key=drops.__getitem__)
        own = ours["weight"]["drop_m"][0] if "weight" in ours else float("nan")
        parts.append(
            f"The first drop is {100.0 * drops[least]:.1f} cm ({least}) to {100.0 * drops[most]:.1f} cm ({most}), "
            f"ours {100.0 * own:.1f} cm."
        )
    for task in ("reach", "hammer"):
        works = {name: one[task]["energy_ratio_true"] - 1.0 for name, one in loaded.items() if task in one}
        if len(works) > 2:
            masses = [loaded[name]["sag"]["arm_mass"] / loaded[name]["sag"]["object_mass"] for name in works]
            rho = _correlate_ranks(masses, list(works.values()))
            parts.append(
                f"In {name_of_task(task)} the dearer grip costs {100.0 * min(works.values()):.1f} to "
                f"{100.0 * max(works.values()):.1f} % more; its rank correlation with the arm's effective mass over "
                f"the object's is {rho:.2f}."
            )
    rates = {name: one["heavy"]["rate"] for name, one in loaded.items()}
    over = {name: rate for name, rate in rates.items() if rate > 1.0}
    if over:
        listed = ", ".join(
            f"{name} {rate:.2f} ({loaded[name]['heavy']['rate_joint']})" for name, rate in over.items()
        )
        parts.append(
            "Limits of rate are kept in the plan, by the believed inertia: under a wrong belief a joint exceeds its "
            "limit by what it accelerates beyond its plan in a step of the plan (20 ms). The first time the heaviest "
            f"object is held, largest rates over their limits are {listed}; on all other arms less than 1."
        )
    return " ".join(parts)


def _correlate_ranks(x: list[float], y: list[float]) -> float:
    """Computes Spearman's rank correlation."""
    return float(spearmanr(x, y).statistic)


def name_of_task(task: str) -> str:
    """Returns the noun for a task."""
    return {"reach": "reaching", "hammer": "hammering"}[task]


def _is_complete(one: Mapping[str, Any]) -> bool:
    return all(one["metrics"]["experiments"][name] == OK for name in NAMES)


def _list_cells(name: str, one: Mapping[str, Any]) -> list[str]:
    """Lists the cells of a robot's row: as many as the section's table has columns."""
    metrics = one["metrics"]
    if not metrics["loads"]:
        return [name, metrics["experiments"]["weight"], *[""] * 11]
    ran = ["ok" if metrics["experiments"][each] == OK else metrics["experiments"][each] for each in NAMES]
    works = [
        f"{100.0 * (one[task]['energy_ratio_true'] - 1.0):.1f}" if task in one else "-"
        for task in ("reach", "hammer")
    ]
    verdicts = [met for claims in one["claims"].values() for met in claims.values()]
    return [
        name,
        f"{metrics['joints']}, {metrics['frozen_joints']}",
        "-" if metrics["parity_error"] is None else f"{metrics['parity_error']:.0e}",
        f"{metrics['payload_kg']:.2f}",
        f"{metrics['home_torque_ratio']:.2f}",
        *ran,
        f"{metrics['real_time_factor']:.1f}",
        f"{100.0 * one['weight']['drop_m'][0]:.1f}" if "weight" in one else "-",
        ", ".join(works),
        f"{sum(verdicts)} of {len(verdicts)}",
    ]


def _select_judged(found: _Found) -> dict[str, Mapping[str, Any]]:
    """Selects the experiments' claims of the robots that have any, by robot."""
    return {name: one["claims"] for name, one in found.items() if one.get("claims")}


def _list_verdicts(found: _Found) -> list[list[str]]:
    """Lists the experiments' claims, one row each, with the verdict on every robot."""
    known = _select_judged(found)
    texts = list(dict.fromkeys((task, text) for claims in known.values() for task in claims for text in claims[task]))
    words = {True: "met", False: "not met", None: "-"}
    return [
        [f"{task}: {text}", *(words[claims.get(task, {}).get(text)] for claims in known.values())]
        for task, text in texts
    ]
