"""What the study of arms says: its table, its claims and its paragraph, as data for the report."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scipy.stats import spearmanr

from affordance.experiments.arms.programs import NAMES, OK

_PARITY, _REAL_TIME = 1e-9, 5.0
_Found = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class ArmClaim:
    """Something that is asked of the study, and what was found.

    Attributes:
        text: What is asked.
        criterion: When it is met.
        bound: The number that is compared with.
        value: What was found.
        met: Whether it is met.
    """

    text: str
    criterion: str
    bound: float
    value: float
    met: bool


@dataclass(frozen=True)
class ArmsSection:
    """The study's part of a report.

    Attributes:
        title: Its heading.
        paragraph: What was found and why.
        claims: What was asked and found.
        captions: Of the figures, by name.
    """

    title: str
    paragraph: str
    claims: tuple[ArmClaim, ...]
    captions: Mapping[str, str]


def describe_study(found: _Found, ours: Mapping[str, Any]) -> ArmsSection:
    """Says what was found."""
    loaded = {name: one for name, one in found.items() if one["metrics"]["loads"]}
    required = {name: one for name, one in found.items() if one["required"]}
    complete = [name for name, one in required.items() if _is_complete(one)]
    parities = [
        one["metrics"]["parity_error"] for one in loaded.values() if one["metrics"]["parity_error"] is not None
    ]
    speeds = {name: one["metrics"]["real_time_factor"] for name, one in loaded.items()}
    claims = [
        ArmClaim(
            "All four experiments run on the arms that were asked for, from unedited files.",
            "robots with four experiments",
            float(len(required)),
            float(len(complete)),
            len(complete) == len(required),
        )
    ]
    if parities:
        worst = max(parities)
        text = "Mass matrix, gravity, inverse dynamics and tip pose agree with Pinocchio."
        claims.append(ArmClaim(text, "largest relative difference at most", _PARITY, worst, worst <= _PARITY))
    if speeds:
        slowest = min(speeds.values())
        text = "A hold is simulated at least five times as fast as it takes."
        claims.append(
            ArmClaim(text, "smallest real-time factor at least", _REAL_TIME, slowest, slowest >= _REAL_TIME)
        )
    captions = {
        "arms": (
            "Left: how far the first object of Simulation I falls in the hand of each arm, simulated, over what the "
            "formula predicts that has no constant to fit. Middle: the same over how heavy the arm is at the hand; "
            "green lines give every joint of an arm rotors of 0.03, 0.1 and 0.3 kg m². Right: by how much the dearer "
            "grip of the stick costs more."
        )
    }
    return ArmsSection("The same claims on other arms", _explain(loaded, ours), tuple(claims), captions)


def _explain(loaded: _Found, ours: Mapping[str, Any]) -> str:
    """The paragraph under the figure."""
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
    """Spearman's rank correlation."""
    return float(spearmanr(x, y).statistic)


def name_of_task(task: str) -> str:
    """The task as a noun."""
    return {"reach": "reaching", "hammer": "hammering"}[task]


def _is_complete(one: Mapping[str, Any]) -> bool:
    return all(one["metrics"]["experiments"][name] == OK for name in NAMES)


def write_table(found: _Found) -> str:
    """The table of all robots, in Markdown."""
    outcomes = ("first drop (cm)", "decoy lift (cm)", "reach, hammer: dearer grip (%)", "claims met")
    head = ("robot", "joints, frozen", "parity", "payload (kg)", "torque at home", *NAMES, "x real time", *outcomes)
    rows = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    for name, one in found.items():
        metrics = one["metrics"]
        if not metrics["loads"]:
            rows.append(f"| {name} | {metrics['experiments']['weight']} |" + " |" * (len(head) - 2))
            continue
        ran = ["ok" if metrics["experiments"][each] == OK else metrics["experiments"][each] for each in NAMES]
        parity = "-" if metrics["parity_error"] is None else f"{metrics['parity_error']:.0e}"
        drop = f"{100.0 * one['weight']['drop_m'][0]:.1f}" if "weight" in one else "-"
        lift = f"{100.0 * one['weight']['decoy_lift_m']:.1f}" if "weight" in one else "-"
        works = ", ".join(
            f"{100.0 * (one[task]['energy_ratio_true'] - 1.0):.1f}" if task in one else "-"
            for task in ("reach", "hammer")
        )
        verdicts = [met for claims in one["claims"].values() for met in claims.values()]
        cells = (
            name,
            f"{metrics['joints']}, {metrics['frozen_joints']}",
            parity,
            f"{metrics['payload_kg']:.2f}",
            f"{metrics['home_torque_ratio']:.2f}",
            *ran,
            f"{metrics['real_time_factor']:.1f}",
            drop,
            lift,
            works,
            f"{sum(verdicts)} of {len(verdicts)}",
        )
        rows.append("| " + " | ".join(cells) + " |")
    return "\n".join([*rows, "", *_list_verdicts(found)]) + "\n"


def _list_verdicts(found: _Found) -> list[str]:
    """A table of the experiments' claims by robot."""
    known = {name: one["claims"] for name, one in found.items() if one.get("claims")}
    texts = list(dict.fromkeys((task, text) for claims in known.values() for task in claims for text in claims[task]))
    words = {True: "met", False: "not met", None: "-"}
    rows = [f"| claim | {' | '.join(known)} |", "|" + " --- |" * (len(known) + 1)]
    for task, text in texts:
        verdicts = [words[claims.get(task, {}).get(text)] for claims in known.values()]
        rows.append(f"| {task}: {text} | {' | '.join(verdicts)} |")
    return rows
