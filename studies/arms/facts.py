"""Facts that the section of the study of arms names: numbers over all robots, and cells of its tables."""

from collections.abc import Mapping
from typing import Any

from scipy.stats import spearmanr

from affordance.reporting.section import Table
from studies.arms.robot_study import EXPERIMENTS, OK

type Found = Mapping[str, Mapping[str, Any]]

_TASKS = {"reach": "reaching", "hammer": "hammering"}
# Fraction of control periods with an active limit up to which an arm counts as free.
FREE = 0.05


def select_loaded(found: Found) -> dict[str, Mapping[str, Any]]:
    """Selects the robots that were imported."""
    return {name: one for name, one in found.items() if one["metrics"]["loads"]}


def list_facts(found: Found, ours: Mapping[str, Any]) -> dict[str, Any]:
    """Lists falls, costs and rates of the robots that were imported, and the rows of the table of all robots."""
    loaded = select_loaded(found)
    sags = [one["sag"] for one in loaded.values()]
    drops = {name: one["weight"]["drop_m"][0] for name, one in loaded.items() if "weight" in one}
    return {
        "loaded": list(loaded),
        "free_ratios": [sag["simulated"] / sag["predicted"] for sag in sags if sag["limited"] <= FREE],
        "drops": sorted(drops.items(), key=lambda drop: drop[1]),
        "own_drop": ours["weight"]["drop_m"][0] if "weight" in ours else float("nan"),
        "works": [entry for task in _TASKS if (entry := _compare_works(loaded, task))],
        "over": {name: one["heavy"] for name, one in loaded.items() if one["heavy"]["rate"] > 1.0},
        "robot_rows": [_list_cells(name, one) for name, one in found.items()],
    }


def list_verdicts(found: Found) -> tuple[Table, ...]:
    """Lists the experiments' claims, a row each, with the verdict on every robot; no table if there is none."""
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


def _compare_works(loaded: Found, task: str) -> dict[str, Any] | None:
    """Correlates the ranks of effective masses and of additional costs in a task; None of fewer than three arms."""
    arms = [one for one in loaded.values() if task in one]
    if len(arms) < 3:
        return None
    masses = [get_mass_ratio(one["sag"]) for one in arms]
    works = [get_excess(one, task) for one in arms]
    rho = float(spearmanr(masses, works).statistic)
    return {"task": _TASKS[task], "low": min(works), "high": max(works), "rho": rho}


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
