"""Simulation IV (paper, IV-D): choosing a grip for hammering.

Observers hold the objects of simulation II, and after every trial choose which end of a novel object to hold so that
driving a nail with a demanded peak force costs least. They never hold it. Which grip really is the cheaper one is
measured: both blows are simulated with the true densities, contact included.
"""

import dataclasses
import functools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance import figures
from affordance.arm import ArmModel, load_arm
from affordance.blow import Blow, deal_blow
from affordance.choice import NO_OPTION, Choice, list_options, pick_cheapest
from affordance.diagram_picture import save_diagram
from affordance.exceptions import BadValueError
from affordance.experience import ExperienceConfig, collect_experience
from affordance.experiments.decisions import (
    BASELINE,
    MAX_STUDIED,
    NUM_PRIOR_CHOICES,
    Choices,
    NovelObjects,
    check_one_grip_is_cheaper,
    compute_proportions,
    draw_proportions,
    find_grip_of_densest,
    label_choices,
    load_subjects,
    plan_choices,
    run_repeat,
    study_sensitivity,
)
from affordance.experiments.modes import keep_mode
from affordance.experiments.outputs import describe_run, label_motions, name_faults
from affordance.experiments.sights import show_sights
from affordance.hammering_map import HammeringMap, find_crossovers, map_work
from affordance.memory import MaterialMemory
from affordance.nail import Nail
from affordance.optimal_swing import SwingComparison, compare_swings
from affordance.photographs import Pose, take_close_ups, take_pictures
from affordance.replay import Scene, write_replay
from affordance.report import Claim, Picture, Section, write_section
from affordance.results import compute_key, run_repeats, write_json
from affordance.settings import Sight
from affordance.tasks.hammer import BlowEnergies, Hammer, load_hammer
from affordance.tools import MODELS, Tool, list_densities
from affordance.trajectories import Labelled, write_trajectories
from affordance.trial import get_runner
from affordance.visual_prior import ComponentFeatures

Array = NDArray[np.float64]

NAME = "hammer"
# A blow does what is asked if the peak of the nail's resistance is off by no more than this (issue 4; the formula by
# which blows are planned leaves aside what nail and contact take, docs/decisions/0013-nail.md).
FORCE_TOLERANCE = 0.15
# The map: from a little above the resistance of the set nail to a multiple of the demanded force, and over densities
# of the denser part from less than that of wood to that of lead, [kg/m^3].
_MAP_FORCES, _MAP_DENSITIES = 80, 60
_MAP_MIN_FORCE, _MAP_MAX_FORCE = 1.02, 2.0
_MAP_MIN_DENSITY, _MAP_MAX_DENSITY = 300.0, 11_340.0
# The replay is so much slower from so long before to so long after the strike: driving takes 5 ms, [s].
_SLOWER, _SLOW_BEFORE, _SLOW_AFTER = 80.0, 0.01, 0.03
# Stands for the choices that are compared with the order of the densities, in seeds.
_LIGHT_ENDS = 10**6 + 5


@dataclass(frozen=True)
class HammerConfig:
    """What is run.

    Attributes:
        experience: The objects that are held, and how they are learned.
        novel: The objects that are chosen about.
        task: The blow.
    """

    experience: ExperienceConfig
    novel: NovelObjects
    task: Hammer


def load_config(models: Path = MODELS, seed: int = 0, sight: Sight = Sight.FEATURES) -> HammerConfig:
    """Reads arm, objects and nail from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    experience, novel = load_subjects(models, seed, sight)
    path = models / "nail.yaml"
    config = HammerConfig(experience, novel, load_hammer(path))
    # What cannot be planned or carried out is refused here, before anything is written.
    choices = build_choices(config)
    for choice in choices:
        for option, energies in zip(choice.options, choice.energies, strict=True):
            if energies.obstacle:
                raise BadValueError(path, "blow", f"cannot be dealt: {option.name}: {energies.obstacle}")
    for tool in (novel.plain, novel.headed):
        for grip, energies in get_energies(config, tool).items():
            if not energies.compute(hold(tool)[grip].parameters[None]).feasible[0]:
                problem = f"cannot be reached with the {tool.name} by {grip}: a joint lacks torque or speed"
                raise BadValueError(path, "depth_demanded", problem)
        executed = execute(config, tool)
        for grip, blow in executed.items():
            if abs(blow.force / config.task.force - 1.0) > FORCE_TOLERANCE:
                problem = f"asks for {config.task.force:.0f} N, the {tool.name} by {grip} gives {blow.force:.0f} N"
                raise BadValueError(path, "blow", f"{problem}, must agree to {100 * FORCE_TOLERANCE:.0f} %")
        check_one_grip_is_cheaper(models, tool, [blow.work for blow in executed.values()])
    return config


@functools.lru_cache(maxsize=1)  # loading plans to refuse what cannot be dealt, running to choose
def build_choices(config: HammerConfig) -> Choices:
    """Plans the blows with each grip of each object."""
    return plan_choices(config.novel, config.task, config.experience.settings, config.experience.seed)


def get_energies(config: HammerConfig, tool: Tool) -> dict[str, BlowEnergies]:
    """The blows that were planned for each grip of one of the novel objects."""
    choices = build_choices(config)
    choice = choices.plain if tool is config.novel.plain else choices.headed
    found = {}
    for option, energies in zip(choice.options, choice.energies, strict=True):
        assert isinstance(energies, BlowEnergies)  # what a Hammer builds
        found[option.grip] = energies
    return found


@functools.lru_cache(maxsize=2)  # likewise: simulated when it is loaded, reported when it is run
def execute(config: HammerConfig, tool: Tool) -> dict[str, Blow]:
    """Simulates the blow under the true densities with each grip of a tool."""
    densities, settings = list_densities([tool]), config.experience.settings
    energies = get_energies(config, tool)
    return {grip.name: deal_blow(tool.hold_by(grip), energies[grip.name], densities, settings) for grip in tool.grips}


def find_cheaper_grip(executed: Mapping[str, Blow]) -> str:
    """Names the grip of least work; both are known to give the force."""
    return min(executed, key=lambda grip: executed[grip].work)


class Study(NamedTuple):
    """What is computed beside the choices.

    Attributes:
        executed: The blow with each grip of the plain object, under the true densities.
        executed_headed: The same for the headed object.
        crossovers: Forces at which both grips of the plain object cost the same, [N].
        checked: Blows on either side of the first of them, by force and grip; empty if there is none.
        yielding: The same blows on a nail of constant resistance, by grip.
        swings: What other swings to the same strike take, by grip.
        map: Work over force and density of the denser part.
        densities: Of the map's rows, (R,), [kg/m^3].
    """

    executed: Mapping[str, Blow]
    executed_headed: Mapping[str, Blow]
    crossovers: list[float]
    checked: Mapping[float, Mapping[str, Blow]]
    yielding: Mapping[str, Blow]
    swings: Mapping[str, SwingComparison]
    map: HammeringMap
    densities: Array


def hold(tool: Tool) -> dict[str, Tool]:
    """The tool in each of its grips."""
    return {grip.name: tool.hold_by(grip) for grip in tool.grips}


def study(config: HammerConfig) -> Study:
    """Executes the blows, and those that show where the cheaper grip is the other one."""
    settings, task, plain = config.experience.settings, config.task, config.novel.plain
    energies, held, true = get_energies(config, plain), hold(plain), list_densities([plain])

    def deal(force: float | None = None, nail: Nail | None = None) -> dict[str, Blow]:
        return {
            grip: deal_blow(tool, energies[grip], true, settings, force=force, nail=nail)
            for grip, tool in held.items()
        }

    executed = execute(config, plain)
    model = ArmModel(load_arm(settings.arm))
    least, most = task.nail.stiffness * task.nail.depth_set, _MAP_MAX_FORCE * task.force
    forces = np.linspace(_MAP_MIN_FORCE * least, most, _MAP_FORCES)
    stronger = dataclasses.replace(task, force=most)
    up_to_most = {grip: stronger.build_energies(model, tool.components, settings) for grip, tool in held.items()}
    crossovers = find_crossovers(up_to_most, {grip: tool.parameters for grip, tool in held.items()}, forces)
    checked = {}
    if crossovers:
        # Half way, in proportion, to the least force and to the demanded one.
        for end in (least, task.force):
            force = float(np.sqrt(crossovers[0] * end))
            checked[force] = deal(force)
    # The mean of the skin friction over the demanded travel takes the same energy.
    mean = 0.5 * task.nail.stiffness * (task.nail.depth_set + task.nail.depth_demanded)
    swings = {
        grip: compare_swings(model, energies[grip].target, executed[grip].strike.swing, tool.parameters)
        for grip, tool in held.items()
    }
    densest = max(plain.components, key=lambda part: part.material.density).looks_like.colour
    densities = np.linspace(_MAP_MIN_DENSITY, _MAP_MAX_DENSITY, _MAP_DENSITIES)
    parameters = [
        np.array([tool.make_of({**true, densest: float(density)}).parameters for density in densities])
        for tool in held.values()
    ]
    return Study(
        executed,
        execute(config, config.novel.headed),
        crossovers,
        checked,
        deal(nail=dataclasses.replace(task.nail, yield_force=mean)),
        swings,
        map_work(list(up_to_most.values()), parameters, forces),
        densities,
    )


def run(config: HammerConfig, folder: Path, *, repeats: int, jobs: int) -> None:
    """Runs all observers and writes numbers, figures, trajectories, diagram, replay and section of the report.

    Args:
        config: What is run.
        folder: Receives the files; repeats that it holds already are not run again. Experience is kept beside it.
        repeats: Number of observers, at least 1.
        jobs: Number of processes, at least 1.
    """
    start = time.perf_counter()
    settings, seed = config.experience.settings, config.experience.seed
    choices = build_choices(config)
    studied = study(config)
    experience = collect_experience(config.experience, folder.parent / "experience", repeats=repeats, jobs=jobs)
    kept = folder / "repeats" / compute_key(config, settings.arm.parent)
    arrays = run_repeats(
        kept, partial(run_repeat, choices, experience, seed), repeats=repeats, jobs=jobs, description=NAME
    )
    numbers = compute_metrics(config, choices, arrays, studied)
    numbers.update(experience.count_faults())
    correct = list(studied.executed).index(numbers["correct_grip"])
    sensitivity = study_sensitivity(
        config.experience, choices.plain, correct, repeats=min(repeats, MAX_STUDIED), jobs=jobs
    )
    _write_trajectories(folder / "trajectories.nc", config, arrays, studied)
    tool = hold(config.novel.plain)[numbers["correct_grip"]]
    placement = studied.executed[numbers["correct_grip"]].strike.placement
    save_diagram(get_runner(settings).get_diagram(tool, placement).diagram, folder, "diagram")
    _draw(config, numbers, studied, sensitivity, folder, repeats)
    section = name_faults(describe(config, numbers, repeats), settings.faults)
    tools = (config.novel.plain, config.novel.headed)
    write_section(folder, show_sights(section, folder, tools, settings, seed))
    _write_replay(config, studied, folder)
    described = describe_run(config, seed=seed, repeats=repeats, wall_s=time.perf_counter() - start)
    keep_mode(folder, numbers, settings, seed=seed, repeats=repeats)
    # Last: where it is, the rest is too.
    write_json(folder / "metrics.json", {**numbers, "p_correct_sensitivity": sensitivity, **described})


def compute_metrics(
    config: HammerConfig, choices: Choices, arrays: Mapping[str, NDArray[Any]], studied: Study
) -> dict[str, Any]:
    """Computes the numbers of the results contract.

    Args:
        config: What was run.
        choices: The choices of a grip.
        arrays: Choices of all observers, (repeats, K + 1) each.
        studied: What was computed beside them.
    """
    executed, executed_headed = studied.executed, studied.executed_headed
    correct_grip, correct_headed = find_cheaper_grip(executed), find_cheaper_grip(executed_headed)
    correct, correct_of_headed = list(executed).index(correct_grip), list(executed_headed).index(correct_headed)
    return {
        **compute_proportions(choices, arrays, config.experience, correct, correct_of_headed),
        "correct_grip": correct_grip,
        "correct_grip_headed_tool": correct_headed,
        "density_true": {part.material.name: part.material.density for part in config.novel.plain.components},
        "energy_ratio_true": max(blow.work for blow in executed.values()) / executed[correct_grip].work,
        **_measure_blows(executed, ""),
        **_measure_blows(executed_headed, "_headed_tool"),
        **_measure_demand(config, executed),
        "swings": {
            grip: {
                kind: {"energy": swing.work, "effort": swing.effort, "converged": swing.converged}
                for kind, swing in swings._asdict().items()
            }
            for grip, swings in studied.swings.items()
        },
        **_measure_crossover(studied),
        "yielding_nail": {
            grip: {
                "travel_m": blow.travel,
                "force_measured_N": blow.force,
                "contact_peak_N": float(blow.nail.contact.max()),
            }
            for grip, blow in studied.yielding.items()
        },
        "p_light_end_held": _count_light_ends(config),
    }


def _measure_blows(executed: Mapping[str, Blow], suffix: str) -> dict[str, Any]:
    """What blows cost and did, by grip."""
    measures: dict[str, Callable[[Blow], float]] = {
        "energy_true": lambda blow: blow.work,
        "energy_raising_true": lambda blow: blow.work_raising,
        "energy_without_raising_true": lambda blow: blow.work - blow.work_raising,
        "kinetic_energy_true": lambda blow: blow.kinetic_energy,
        "effort_true": lambda blow: blow.effort,
        "force_measured_N": lambda blow: blow.force,
        "contact_peak_N": lambda blow: float(blow.nail.contact.max()),
        "travel_m": lambda blow: blow.travel,
        "ticks_limited": lambda blow: blow.record.counts.limited,
    }
    return {
        name + suffix: {grip: measure(blow) for grip, blow in executed.items()} for name, measure in measures.items()
    }


def _measure_demand(config: HammerConfig, executed: Mapping[str, Blow]) -> dict[str, Any]:
    """What the demanded force means for the tip of the plain object."""
    task, nail = config.task, config.task.nail
    energies = get_energies(config, config.novel.plain)
    pi = {grip: tool.parameters[None] for grip, tool in hold(config.novel.plain).items()}
    speeds = {grip: energies[grip].find_speed(pi[grip]) for grip in executed}
    slower = min(speeds.values())
    at_equal_speed = {grip: float(energies[grip].compute_at_speed(pi[grip], slower).work[0]) for grip in executed}
    return {
        "force_demanded_N": task.force,
        "tip_speed": {grip: float(speed[0]) for grip, speed in speeds.items()},
        "energy_planned": {grip: float(energies[grip].compute(pi[grip]).work[0]) for grip in executed},
        "energy_at_equal_tip_speed": at_equal_speed,
        # What the nail takes from where it was set, and from the surface of the wood.
        "tip_energy": (task.force**2 - (nail.stiffness * nail.depth_set) ** 2) / (2.0 * nail.stiffness),
        "tip_energy_from_surface": task.force**2 / (2.0 * nail.stiffness),
    }


def _measure_crossover(studied: Study) -> dict[str, Any]:
    """Where the cheaper grip changes, as planned, and what contact simulation says on either side."""
    first, last = studied.map.forces[[0, -1]]
    reason = None if studied.crossovers else f"one grip is the cheaper one from {first:.0f} to {last:.0f} N"
    return {
        "force_crossover_N": studied.crossovers[0] if studied.crossovers else None,
        "force_crossover_reason": reason,
        "force_crossovers_N": studied.crossovers,
        "force_crossover_checked": [
            {"force_demanded_N": force, **_measure_blows(blows, "")} for force, blows in studied.checked.items()
        ],
    }


def _count_light_ends(config: HammerConfig) -> float:
    """Share of choices, by densities from the prior, that put what is less dense into the hand.

    Of the object as it is, however observers see it: it is the task that is asked about.
    """
    settings = config.experience.settings
    choice = Choice(list_options(config.novel.plain), config.task, settings)
    memory = MaterialMemory().meet(config.experience.looks, settings.prior)
    rng = np.random.default_rng([config.experience.seed, _LIGHT_ENDS])
    rho = memory.belief.spread(settings.prior.deviation_sd).draw_samples(rng, NUM_PRIOR_CHOICES)
    chosen = pick_cheapest(choice.compute_costs(choice.compute_parameters(memory, rho)), rng)
    near, far = np.array([_order_looks(option.gripped, memory) for option in choice.options]).T
    decided = chosen != NO_OPTION
    each = np.arange(len(rho))[decided]
    return float((rho[each, near[chosen[decided]]] < rho[each, far[chosen[decided]]]).mean())


def _order_looks(parts: Sequence[ComponentFeatures], memory: MaterialMemory) -> tuple[int, int]:
    """Which materials are nearest to and farthest from the hand."""
    ordered = sorted(parts, key=lambda part: float(np.linalg.norm(part.X_TE[:3, 3])))
    looks = [memory.looks.index(part.colour) for part in (ordered[0], ordered[-1])]
    return looks[0], looks[1]


def describe(config: HammerConfig, numbers: Mapping[str, Any], repeats: int) -> Section:
    """Puts the numbers beside what the paper says."""
    p, interval = np.asarray(numbers["p_correct"]), np.asarray(numbers["p_correct_ci95"])
    bayes, headed = np.asarray(numbers["p_correct_bayes"]), np.asarray(numbers["p_correct_headed_tool"])
    energy, force, task = numbers["energy_true"], numbers["force_measured_N"], config.task
    effort = numbers["effort_true"]
    flips = ", ".join(f"{100 * value:.0f}" for value in numbers["effort_flips"])
    plain, headed_name = config.novel.plain.name, config.novel.headed.name
    claims = [
        Claim(
            "IV-D",
            "For this task the optimal choice is to grasp the wooden side of the object.",
            bool(numbers["correct_grip"] == find_grip_of_densest(config.novel.plain, at_hand=False)),
            "simulated with the true densities and contact, "
            + " and ".join(f"{work:.2f} J held by {grip}" for grip, work in energy.items())
            + f" (ratio {numbers['energy_ratio_true']:.3f}) from rest to the strike",
        ),
        Claim(
            "IV-D",
            "Efficiently hit a nail with sufficient force.",
            bool(all(abs(value / task.force - 1.0) <= FORCE_TOLERANCE for value in force.values())),
            f"{task.force:.0f} N demanded of the nail's resistance; measured in the contact simulation "
            + " and ".join(f"{value:.0f} N held by {grip}" for grip, value in force.items())
            + "; the nail went in by "
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
            f"{repeats} simulated observers hold the objects of simulation II and after every trial choose which end "
            f"of the {plain} to hold, to drive a nail with the least work up to a resistance of {task.force:.0f} N. "
            f"They never hold the {plain}. Beside it they choose about the {headed_name}: before any experience "
            f"{100 * headed[0]:.0f} of 100 choices of its grip are correct, as its shape alone speaks for the other "
            "grip. The blows of figure 9 are simulated with contact between tool and nail."
        ),
        pictures=[
            Picture(
                "figure9.png", "Figure 9. The start and the strike, rendered, with each grip of the plain object."
            ),
            Picture("figure10.png", "Figure 10. Correct choices after trials with the objects of simulation II."),
            Picture("blow.png", "Force on the nail during the blow, with each grip, and how far the nail goes in."),
            Picture(
                "map.png",
                "Which grip of the plain object is the cheaper one, over demanded force and density. The "
                "edges of what is possible are as coarse as the speeds at which swings are planned.",
            ),
            Picture(
                "sensitivity.png",
                "How correct choices depend on what is assumed, one thing at a time: noise, prior, and the density "
                "that stands for the belief. Observers here feel objects at rest; black is what all simulations use.",
            ),
        ],
        claims=claims,
        differences=[
            *_predict_crossover(config, numbers),
            "The paper gives neither nail nor force; ours are in models/nail.yaml and were fixed before any "
            "observer's choice was computed (docs/decisions/0013-nail.md, 0014). Work counts from rest in the home "
            "posture to the strike, "
            + _list_by_grip(numbers["energy_raising_true"], "J")
            + " of it for raising the tool; at the strike arm and tool move with "
            + _list_by_grip(numbers["kinetic_energy_true"], "J")
            + f", of which the nail takes {numbers['tip_energy']:.2f} J (F^2 / 2k from the surface of the wood is "
            f"{numbers['tip_energy_from_surface']:.2f} J).",
            _describe_other_swings(numbers),
            "On a nail that yields at a constant force the same blows drive it by "
            + _list_by_grip({grip: 1e3 * each["travel_m"] for grip, each in numbers["yielding_nail"].items()}, "mm")
            + ": the energy at the tip decides, and the same works are compared. Were a peak of the contact force "
            "demanded instead, which the speed of the tip and the stiffness of what touches decide whatever mass is "
            "behind it, both grips would need the same speed; at the slower one of the two swings they take "
            + _list_by_grip(numbers["energy_at_equal_tip_speed"], "J")
            + ".",
            "Figures 8 and 10 are of the same observers and nearly the same question: with equal cross-sections both "
            f"choices turn on which part is believed denser. Here {100 * numbers['p_light_end_held']:.1f} of 100 "
            "choices by densities from the prior hold what is less dense, in reaching what is denser.",
            "The integral of |tau|^2, another measure of effort, "
            + ("agrees" if min(effort, key=effort.__getitem__) == numbers["correct_grip"] else "does not agree")
            + " with the work on the correct grip: "
            + _list_by_grip(effort, "N^2 m^2 s")
            + "; over the whole swing it is mostly what holds arm and tool up. Before the first and after each trial "
            f"its expectation would have led to another choice in {flips} of 100 cases, that is to the other grip.",
            f"By the rule of least expected work {bayes[0]:.2f} of the choices are correct before, and after each "
            "trial " + ", ".join(f"{value:.2f}" for value in bayes[1:]) + "; the paper's rule draws one density.",
        ],
    )


def _list_by_grip(values: Mapping[str, float], unit: str) -> str:
    return " and ".join(f"{value:.2f} {unit} held by {grip}" for grip, value in values.items())


def _predict_crossover(config: HammerConfig, numbers: Mapping[str, Any]) -> list[str]:
    """The prediction for an experiment, in words; none where there is no crossover."""
    if numbers["force_crossover_N"] is None:
        return []
    nail, (low, high) = config.task.nail, numbers["force_crossover_checked"]
    tap, drive = (min(each["energy_true"], key=each["energy_true"].__getitem__) for each in (low, high))
    travel = 1e3 * (numbers["force_crossover_N"] / nail.stiffness - nail.depth_set)
    checks = "; ".join(
        f"at {each['force_demanded_N']:.0f} N "
        + _list_by_grip(each["energy_true"], "J")
        + " for driving it by "
        + _list_by_grip({grip: 1e3 * value for grip, value in each["travel_m"].items()}, "mm")
        for each in (low, high)
    )
    if tap == drive:
        crossing = f"{numbers['force_crossover_N']:.0f} N"
        return [f"The planned works cross at {crossing}, the simulated ones do not: {checks}."]
    return [
        f"A prediction: whoever has felt both materials will hold the {drive} end of the "
        f"{config.novel.plain.name} to drive this nail by half a centimetre with one blow, but the {tap} end to tap "
        f"it without driving it. The cheaper grip changes at {numbers['force_crossover_N']:.0f} N, where the nail "
        f"moves by {travel:.1f} mm: "
        "whenever it really is driven, what counts is the mass behind the tip; in a tap arm and tool are merely "
        "lowered, and a tool with its mass at the hand weighs less on the shoulder. Contact simulation finds this "
        f"order on either side: {checks}."
    ]


def _describe_other_swings(numbers: Mapping[str, Any]) -> str:
    """What the result owes to the way the swing is planned."""

    def compare(kind: str) -> tuple[str, str, float]:
        works = {grip: each[kind]["energy"] for grip, each in numbers["swings"].items()}
        cheaper, dearer = sorted(works, key=works.__getitem__)
        return _list_by_grip(works, "J"), cheaper, 100.0 * (works[dearer] / works[cheaper] - 1.0)

    listed, cheaper, saved = compare("least_work")
    with_most_effort, _, _ = compare("least_effort")
    _, _, ours = compare("least_acceleration")
    ended = all(each[kind]["converged"] for each in numbers["swings"].values() for kind in each)
    return (
        "The advantage is one of swings of least angular acceleration, the paper's and ours, which know no dynamics. "
        f"Swings to the same strike of least work, found with the true dynamics, take {listed}: holding {cheaper} "
        f"is cheaper by {saved:.0f} % instead of {ours:.0f} %, no more than such searches differ by between "
        f"starts{'' if ended else ', and not all of them converged'}. Swings of least integral of |tau|^2 take "
        f"{with_most_effort} (docs/decisions/0017-dynamically-consistent-swing.md)."
    )


def _draw(
    config: HammerConfig,
    numbers: Mapping[str, Any],
    studied: Study,
    sensitivity: dict[str, dict[str, Array]],
    folder: Path,
    repeats: int,
) -> None:
    _draw_blows(config, studied, folder)
    title = f"Choosing a grip for hammering, {repeats} observers, 95 % intervals"
    figures.save_figure(draw_proportions(config.novel, numbers, title), folder, "figure10")
    grips = [f"hold by {grip}" for grip in studied.executed]
    densest = max(config.novel.plain.components, key=lambda part: part.material.density).material
    figure = figures.draw_map(
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
    figures.save_figure(
        figures.draw_sensitivity(sensitivity, baseline=BASELINE, num_repeats=min(repeats, MAX_STUDIED)),
        folder,
        "sensitivity",
    )


def _draw_blows(config: HammerConfig, studied: Study, folder: Path) -> None:
    """Draws figure 9, rendered, and what happens to the nail."""
    held, arm = hold(config.novel.plain), config.experience.settings.arm
    poses, close = [], []
    for grip, blow in studied.executed.items():
        row = int(np.argmin(np.abs(blow.record.times - blow.time_of_touch)))
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
    figures.save_figure(figures.draw_photographs(rows, titles=titles), folder, "figure9")
    records = {f"held by {grip}": blow.nail for grip, blow in studied.executed.items()}
    figures.save_figure(figures.draw_blow(records, force_demanded=config.task.force), folder, "blow")


def _write_replay(config: HammerConfig, studied: Study, folder: Path) -> None:
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


def _write_trajectories(path: Path, config: HammerConfig, arrays: Mapping[str, NDArray[Any]], studied: Study) -> None:
    executed = studied.executed
    times = np.arange(-0.002, 0.012, 2e-5)
    blows = {
        name: Labelled(
            ("trial", "time_since_touch"),
            np.stack(
                [np.interp(times, b.nail.times - b.time_of_touch, getattr(b.nail, name)) for b in executed.values()]
            ),
            unit,
            meaning,
        )
        for name, unit, meaning in (
            ("resistance", "N", "resistance of the nail"),
            ("contact", "N", "force of the tool on the nail"),
            ("travel", "m", "how far the nail was driven"),
        )
    }
    mapped = {
        "map_work": Labelled(("trial", "density", "force"), studied.map.work, "J", "work of a blow"),
        "map_feasible": Labelled(
            ("trial", "density", "force"), studied.map.feasible.astype(float), "1", "whether the blow can be dealt"
        ),
    }
    coordinates = {
        "time_since_touch": Labelled(("time_since_touch",), times, "s", "time since the tool touched the nail"),
        "force": Labelled(("force",), studied.map.forces, "N", "demanded peak of the nail's resistance"),
        "density": Labelled(("density",), studied.densities, "kg/m^3", "density of the denser part"),
    }
    records = [blow.record for blow in executed.values()]
    joint_names = get_runner(config.experience.settings).get_diagram(next(iter(hold(config.novel.plain).values())))
    write_trajectories(
        path,
        {
            **label_choices(arrays),
            **blows,
            **mapped,
            **coordinates,
            **label_motions(records, "executed under the true densities"),
        },
        {"trial": list(executed), "joint": joint_names.arm.joint_names},
    )
