"""What the report says and shows of simulation IV: its section, figures and replay."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from affordance.experiments.hammer.blows import FORCE_TOLERANCE, HammerConfig, Study
from affordance.experiments.shared import sensitivity
from affordance.experiments.shared.correct_grip import find_grip_of_densest
from affordance.experiments.shared.decisions import (
    NUM_PRIOR_CHOICES,
    describe_effort,
    describe_headed,
    describe_rules,
    draw_proportions,
    list_by_grip,
)
from affordance.experiments.shared.novel_objects import hold
from affordance.reporting import figures
from affordance.reporting.blow_figures import draw_blow, draw_map, draw_photographs
from affordance.reporting.renderings import Pose, take_close_ups, take_pictures
from affordance.reporting.replay import Scene, write_replay
from affordance.reporting.report import Claim, Picture, Section
from affordance.reporting.wording import count_observers, introduce_observers, warn_of_few_observers

# The replay is so much slower from so long before to so long after the strike: driving takes 5 ms, [s].
_SLOWER, _SLOW_BEFORE, _SLOW_AFTER = 80.0, 0.01, 0.03


def describe(config: HammerConfig, numbers: Mapping[str, Any], repeats: int) -> Section:
    """Puts the numbers beside what the paper says."""
    p, interval = np.asarray(numbers["p_correct"]), np.asarray(numbers["p_correct_ci95"])
    force, task = numbers["force_measured_N"], config.task
    plain, headed_name = config.novel.plain.name, config.novel.headed.name
    claims = [
        Claim(
            "IV-D",
            "For this task the optimal choice is to grasp the wooden side of the object.",
            bool(numbers["correct_grip"] == find_grip_of_densest(config.novel.plain, at_hand=False)),
            f"simulated with the true densities and contact, {list_by_grip(numbers['energy_true'], 'J')}"
            f" (ratio {numbers['energy_ratio_true']:.3f}) from rest to the strike",
        ),
        Claim(
            "IV-D",
            "Efficiently hit a nail with sufficient force.",
            bool(all(abs(value / task.force - 1.0) <= FORCE_TOLERANCE for value in force.values())),
            f"{task.force:.0f} N demanded of the nail's resistance; measured in the contact simulation "
            f"{list_by_grip(force, 'N', 0)}; the nail went in by "
            + " and ".join(f"{1000.0 * value:.1f} mm" for value in numbers["travel_m"].values()),
        ),
        Claim(
            "IV-D",
            "At the start of the experiment the robot is at chance.",
            bool(abs(p[0] - 0.5) < 0.02),
            f"{p[0]:.3f} of {NUM_PRIOR_CHOICES} choices before any experience",
        ),
        Claim(
            "IV-D, figure 10",
            "After the first trial, the robot chooses the correct grasp 65 % of the times.",
            bool(interval[1, 0] <= 0.65 <= interval[1, 1]),
            f"{p[1]:.3f}, 95 % interval {interval[1, 0]:.3f} to {interval[1, 1]:.3f}",
        ),
        Claim(
            "IV-D, figure 10",
            "After the second trial it chooses the correct grasp all the time.",
            bool(interval[2, 1] >= 1.0 - 1e-9),
            f"{p[2]:.3f}, 95 % interval {interval[2, 0]:.3f} to {interval[2, 1]:.3f}",
        ),
    ]
    return Section(
        order=4,
        title="Simulation IV: choosing a grip for hammering",
        summary=(
            f"{introduce_observers(repeats, 'hold', 'holds')} the objects of simulation II. After every trial they "
            f"choose which end of the {plain} to hold, to drive a nail with the least work up to a resistance of "
            f"{task.force:.0f} N. They never hold the {plain}. Beside it they choose about the {headed_name}: "
            f"{describe_headed(numbers)}. The blows of figure 9 are simulated with contact between tool and nail."
            f"{warn_of_few_observers(repeats)}"
        ),
        pictures=[
            Picture(
                "figure9.png", "Figure 9. The start and the strike, rendered, with each grip of the plain object."
            ),
            Picture("figure10.png", "Figure 10. Correct choices after trials with the objects of simulation II."),
            Picture("blow.png", "Force on the nail during the blow, with each grip, and how far the nail goes in."),
            Picture(
                "map.png",
                "Which grip of the plain object is the cheaper one, over demanded force and density.",
            ),
            sensitivity.PICTURE,
        ],
        claims=claims,
        differences=[
            *_predict_crossover(config, numbers),
            "The paper gives neither nail nor force; those of models/nail.yaml have their sources in "
            "docs/decisions/0013-nail.md. Work counts from rest in the home "
            "posture to the strike, "
            + list_by_grip(numbers["energy_raising_true"], "J")
            + " of it for raising the tool; at the strike arm and tool move with "
            + list_by_grip(numbers["kinetic_energy_true"], "J")
            + f", of which the nail takes {numbers['tip_energy']:.2f} J (F^2 / 2k from the surface of the wood is "
            f"{numbers['tip_energy_from_surface']:.2f} J).",
            _describe_other_swings(numbers),
            "On a nail that yields at a constant force, which takes the same energy over the demanded travel, the "
            "same blows drive it by "
            + list_by_grip({grip: 1e3 * each["travel_m"] for grip, each in numbers["yielding_nail"].items()}, "mm")
            + ", instead of "
            + list_by_grip({grip: 1e3 * value for grip, value in numbers["travel_m"].items()}, "mm")
            + ". Were a peak of the contact force "
            "demanded instead, which the speed of the tip and the stiffness of what touches decide whatever mass is "
            "behind it, both grips would need the same speed; at the slower one of the two swings they take "
            + list_by_grip(numbers["energy_at_equal_tip_speed"], "J")
            + ".",
            _describe_light_ends(numbers),
            describe_effort(numbers),
            describe_rules(numbers),
        ],
    )


def _describe_light_ends(numbers: Mapping[str, Any]) -> str:
    """What choices have in common that know nothing."""
    share = numbers["p_light_end_held"]
    if share is None:
        found = "No density drawn from the prior lets the blow be dealt with any grip."
    else:
        found = f"Of 100 choices by densities from the prior {100 * share:.1f} hold what is less dense."
    return f"Figures 8 and 10 are of the same observers. {found}"


def _predict_crossover(config: HammerConfig, numbers: Mapping[str, Any]) -> list[str]:
    """The prediction for an experiment, in words; none where there is no crossover."""
    if numbers["force_crossover_N"] is None:
        return []
    nail, (low, high) = config.task.nail, numbers["force_crossover_checked"]
    tap, drive = (min(each["energy_true"], key=each["energy_true"].__getitem__) for each in (low, high))
    first, *others = numbers["force_crossovers_N"]
    travel = 1e3 * (first / nail.stiffness - nail.depth_set)
    checks = "; ".join(
        f"at {each['force_demanded_N']:.0f} N "
        + list_by_grip(each["energy_true"], "J")
        + " for driving it by "
        + list_by_grip({grip: 1e3 * value for grip, value in each["travel_m"].items()}, "mm")
        + ", "
        + list_by_grip(each["energy_raising_true"], "J")
        + " of it for raising the tool"
        for each in (low, high)
    )
    if tap == drive:
        return [f"The planned works cross at {first:.0f} N, the simulated ones do not: {checks}."]
    again = f", and again at {', '.join(f'{force:.0f}' for force in others)} N" if others else ""
    return [
        f"A prediction: whoever has felt both materials will hold the {drive} end of the "
        f"{config.novel.plain.name} to drive this nail by {1e3 * high['travel_m'][drive]:.1f} mm with one blow, but "
        f"the {tap} end to drive it by {1e3 * low['travel_m'][tap]:.1f} mm. The cheaper grip changes at {first:.0f} "
        f"N, where the nail moves by {travel:.1f} mm{again}. Contact simulation finds this order on either side: "
        f"{checks}."
    ]


def _describe_other_swings(numbers: Mapping[str, Any]) -> str:
    """What the result owes to the way the swing is planned."""
    if not numbers["swings"]:
        return "Swings to the same strike by another criterion than least angular acceleration were not found."

    def compare(kind: str) -> tuple[str, str, float]:
        works = {grip: each[kind]["energy"] for grip, each in numbers["swings"].items()}
        cheaper, dearer = sorted(works, key=works.__getitem__)
        return list_by_grip(works, "J"), cheaper, 100.0 * (works[dearer] / works[cheaper] - 1.0)

    listed, cheaper, saved = compare("least_work")
    with_least_effort, _, _ = compare("least_effort")
    _, cheaper_of_ours, ours = compare("least_acceleration")
    ended = all(each[kind]["converged"] for each in numbers["swings"].values() for kind in each)
    return (
        "Swings of least angular acceleration, the paper's and ours, know no dynamics; with them holding "
        f"{cheaper_of_ours} is cheaper by {ours:.0f} %. Swings to the same strike of least work, found with the true "
        f"dynamics, take {listed}: holding {cheaper} is cheaper by {saved:.0f} %. Swings of least integral of "
        f"|tau|^2 take {with_least_effort}. {'All' if ended else 'Not all'} of these searches converged; by how much "
        "they differ between starts says docs/decisions/0017-dynamically-consistent-swing.md."
    )


def draw_figures(
    config: HammerConfig,
    numbers: Mapping[str, Any],
    studied: Study,
    folder: Path,
    repeats: int,
) -> None:
    """Draws the figures of the section.

    Args:
        config: What was run.
        numbers: Those of the results contract.
        studied: What was computed beside the choices.
        folder: Receives the figures.
        repeats: Number of observers.
    """
    _draw_blows(config, studied, folder)
    title = f"Choosing a grip for hammering, {count_observers(repeats)}, 95 % intervals"
    figures.save_figure(draw_proportions(config.novel, numbers, title), folder, "figure10")
    grips = [f"hold by {grip}" for grip in studied.executed]
    densest = max(config.novel.plain.components, key=lambda part: part.material.density).material
    figure = draw_map(
        forces=studied.map.forces,
        values=studied.densities,
        work=dict(zip(grips, studied.map.work, strict=True)),
        feasible=dict(zip(grips, studied.map.feasible, strict=True)),
        case=(config.task.force, densest.density),
        case_label="simulation IV",
        value_label=f"density of the {densest.name} part (kg/m³)",
        title=f"Work of driving the nail with the {config.novel.plain.name}",
    )
    figures.save_figure(figure, folder, "map")


def _draw_blows(config: HammerConfig, studied: Study, folder: Path) -> None:
    """Draws figure 9, rendered, and what happens to the nail."""
    held, arm = hold(config.novel.plain), config.experience.settings.arm
    poses, close = [], []
    for grip, blow in studied.executed.items():
        row = int(np.argmin(np.abs(blow.record.times - blow.nail.time_of_touch)))
        start = Pose(held[grip], blow.strike.placement, blow.record.q[0])
        strike = start._replace(
            q=blow.record.q[row], travel=float(np.interp(blow.record.times[row], blow.nail.times, blow.nail.travel))
        )
        poses += [start, strike]
        close.append(strike)
    pictures = take_pictures(arm, poses, width=1000, height=380)
    close_ups = take_close_ups(arm, close, width=400, height=380)
    rows = {
        f"held by {grip}": [*pictures[2 * i : 2 * i + 2], close_ups[i]] for i, grip in enumerate(studied.executed)
    }
    titles = ["start", "strike", "the nail at the strike"]
    figures.save_figure(draw_photographs(rows, titles=titles), folder, "figure9")
    records = {f"held by {grip}": blow.nail for grip, blow in studied.executed.items()}
    figures.save_figure(draw_blow(records, force_demanded=config.task.force), folder, "blow")


def write_slow_replay(config: HammerConfig, studied: Study, folder: Path) -> None:
    """Writes ``replay.html``: the blow with each grip of the plain object, in slow motion around the strike."""
    held = hold(config.novel.plain)
    scenes = []
    for grip, blow in studied.executed.items():
        strike, times = blow.strike.time_of_strike, blow.record.times
        scenes.append(
            Scene(
                held[grip],
                times,
                blow.record.q,
                f"held by {grip}: {blow.work:.1f} J, {blow.force:.0f} N",
                placement=blow.strike.placement,
                travel=np.interp(times, blow.nail.times, blow.nail.travel),
                slow=(strike - _SLOW_BEFORE, strike + _SLOW_AFTER, _SLOWER),
            )
        )
    title = f"Simulation IV: {config.novel.plain.name}"
    write_replay(folder / "replay.html", config.experience.settings.arm, scenes, title=title)
