"""Simulation IV (paper, IV-D): choosing a grip for hammering.

Observers hold the objects of simulation II, and after every trial choose which end of a novel object to hold so that
driving a nail with a demanded peak force costs least. They never hold it. Which grip really is the cheaper one is
measured: both blows are simulated with the true densities, contact included.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import load_hammer
from affordance.choice.ranking import NO_OPTION, Chosen, pick_cheapest
from affordance.exceptions import AffordanceError, BadValueError
from affordance.experiments.hammer.blows import (
    FORCE_TOLERANCE,
    HammerConfig,
    Study,
    build_choices,
    execute,
    get_costs,
    study,
)
from affordance.experiments.hammer.section import describe, draw_figures, write_slow_replay
from affordance.experiments.shared import sensitivity
from affordance.experiments.shared.camera_views import add_camera_views
from affordance.experiments.shared.correct_grip import (
    WITHOUT_FAULTS,
    check_one_grip_is_cheaper,
    find_cheaper_grip,
    remove_errors,
)
from affordance.experiments.shared.decisions import (
    NUM_PRIOR_CHOICES,
    Choices,
    compute_proportions,
    label_choices,
    plan_choice,
    run_repeat,
)
from affordance.experiments.shared.experience import collect_experience
from affordance.experiments.shared.novel_objects import hold, load_subjects
from affordance.experiments.shared.outputs import describe_run, label_motions, name_faults
from affordance.experiments.vision_comparison import save_vision_metrics
from affordance.files.atomic import write_json
from affordance.files.model_folder import MODELS
from affordance.files.netcdf import Labelled, write_trajectories
from affordance.random_streams import Stream
from affordance.reporting.diagram_picture import save_diagram
from affordance.reporting.report import write_section
from affordance.runs.repeats import compute_key, run_repeats
from affordance.simulation.blow import Blow
from affordance.simulation.trial import get_runner
from affordance.vision.features import ComponentFeatures, FeatureSource

NAME = "hammer"
# What is kept of a nail: around the first touch, driving takes 5 ms, [s].
_KEPT_FROM, _KEPT_TO, _KEPT_STEP = -0.002, 0.012, 2e-5


def load_config(
    models: Path = MODELS, seed: int = 0, feature_source: FeatureSource = FeatureSource.FEATURES
) -> HammerConfig:
    """Reads arm, objects and nail from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    experience, novel = load_subjects(models, seed, feature_source)
    path = models / "nail.yaml"
    config = HammerConfig(experience, novel, load_hammer(path))
    # What cannot be planned or carried out is refused here, before anything is written.
    for choice in build_choices(config):
        for option, planned in zip(choice.options, choice.cost_models, strict=True):
            if planned.infeasible_reason:
                raise BadValueError(path, "blow", f"cannot be dealt: {option.name}: {planned.infeasible_reason}")
    for tool in (novel.plain, novel.headed):
        for grip, cost_model in get_costs(config, tool).items():
            if cost_model.infeasible_reason:
                raise BadValueError(
                    path, "blow", f"cannot be dealt: {tool.name} by {grip}: {cost_model.infeasible_reason}"
                )
            lack = cost_model.describe_lack(hold(tool)[grip].parameters)
            if lack:
                asked = f"is {config.task.nail.depth_demanded:g} m and asks for {config.task.force:.0f} N"
                problem = f"{asked}, for which with the {tool.name} by {grip} {lack}"
                raise BadValueError(path, "depth_demanded", f"{problem}; {_bound_depth(config)}")
        try:
            executed = execute(config, tool)
        except AffordanceError as error:
            raise BadValueError(path, "blow", f"cannot be dealt: {error}") from error
        for grip, blow in executed.items():
            if abs(blow.force / config.task.force - 1.0) > FORCE_TOLERANCE:
                problem = f"asks for {config.task.force:.0f} N, the {tool.name} by {grip} gives {blow.force:.0f} N"
                raise BadValueError(path, "blow", f"{problem}, must agree to {100 * FORCE_TOLERANCE:.0f} %")
        check_one_grip_is_cheaper(models, tool, [blow.work for blow in executed.values()])
    return config


def _bound_depth(config: HammerConfig) -> str:
    """Says how deep a nail can be driven at most with either grip of either object."""
    depth = min(
        cost_model.find_greatest_depth(hold(tool)[grip].parameters)
        for tool in (config.novel.plain, config.novel.headed)
        for grip, cost_model in get_costs(config, tool).items()
    )
    floor = math.floor(1e4 * depth) / 1e4
    if floor <= config.task.nail.depth_set:
        return "no depth is within the joints' limits"
    return f"must be at most {floor:g} m"


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
    panels = sensitivity.study(config.experience, choices.plain, correct, repeats=repeats, jobs=jobs)
    _write_trajectories(folder / "trajectories.nc", config, arrays, studied)
    tool = hold(config.novel.plain)[numbers["correct_grip"]]
    placement = studied.executed[numbers["correct_grip"]].strike.placement
    save_diagram(get_runner(settings).get_diagram(tool, placement).diagram, folder, "diagram")
    draw_figures(config, numbers, studied, folder, repeats)
    sensitivity.save_drawing(panels, folder, repeats)
    section = name_faults(describe(config, numbers, repeats), settings.faults, WITHOUT_FAULTS)
    tools = (config.novel.plain, config.novel.headed)
    write_section(folder, add_camera_views(section, folder, tools, settings, seed))
    write_slow_replay(config, studied, folder)
    described = describe_run(config, seed=seed, repeats=repeats, wall_s=time.perf_counter() - start)
    save_vision_metrics(folder, numbers, settings, seed=seed, repeats=repeats)
    # Last: where it is, the rest is too.
    write_json(folder / "metrics.json", {**numbers, "p_correct_sensitivity": panels, **described})


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
        "periods_limited": lambda blow: blow.record.counts.limited,
    }
    return {
        name + suffix: {grip: measure(blow) for grip, blow in executed.items()} for name, measure in measures.items()
    }


def _measure_demand(config: HammerConfig, executed: Mapping[str, Blow]) -> dict[str, Any]:
    """What the demanded force means for the tip of the plain object."""
    task, nail = config.task, config.task.nail
    cost_model = get_costs(config, config.novel.plain)
    pi = {grip: tool.parameters[None] for grip, tool in hold(config.novel.plain).items()}
    speeds = {grip: cost_model[grip].find_speed(pi[grip]) for grip in executed}
    slower = min(speeds.values())
    at_equal_speed = {grip: float(cost_model[grip].compute_at_speed(pi[grip], slower).work[0]) for grip in executed}
    return {
        "force_demanded_N": task.force,
        "tip_speed": {grip: float(speed[0]) for grip, speed in speeds.items()},
        "energy_planned": {grip: float(cost_model[grip].compute(pi[grip]).work[0]) for grip in executed},
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


def _count_light_ends(config: HammerConfig) -> float | None:
    """Share of choices, by densities from the prior, that put what is less dense into the hand.

    Of the object as it is, however observers see it: it is the task that is asked about.
    """
    settings = remove_errors(config.experience.settings)
    choice = plan_choice(config.novel.plain, config.task, settings, config.experience.seed)
    memory = MaterialMemory().add_colours(config.experience.colours, settings.prior)
    rng = np.random.default_rng([config.experience.seed, Stream.LIGHT_ENDS])
    rho = memory.belief.add_object_variation(settings.prior.deviation_sd).draw_samples(rng, NUM_PRIOR_CHOICES)
    chosen = pick_cheapest(choice.compute_costs(choice.compute_parameters(memory, rho)), rng)
    near, far = np.array([_order_looks(option.gripped, memory) for option in choice.options]).T
    return compute_share_of_light_ends(chosen, rho=rho, near=near, far=far)


def compute_share_of_light_ends(
    chosen: Chosen, *, rho: Array, near: NDArray[np.intp], far: NDArray[np.intp]
) -> float | None:
    """Share of choices that put what is less dense into the hand.

    Args:
        chosen: Index of the option, or NO_OPTION, (S,).
        rho: Densities that are chosen by, (S, M), [kg/m^3].
        near: Which density is nearest to the hand, by option.
        far: Which is farthest from it, by option.

    Returns: The share of those where something was chosen; None if that is none.
    """
    decided = np.flatnonzero(chosen != NO_OPTION)
    if not len(decided):
        return None
    option = chosen[decided]
    return float((rho[decided, near[option]] < rho[decided, far[option]]).mean())


def _order_looks(parts: Sequence[ComponentFeatures], memory: MaterialMemory) -> tuple[int, int]:
    """Which materials are nearest to and farthest from the hand."""
    ordered = sorted(parts, key=lambda part: float(np.linalg.norm(part.X_TE[:3, 3])))
    colours = [memory.colours.index(part.colour) for part in (ordered[0], ordered[-1])]
    return colours[0], colours[1]


def _write_trajectories(path: Path, config: HammerConfig, arrays: Mapping[str, NDArray[Any]], studied: Study) -> None:
    executed = studied.executed
    times = np.arange(_KEPT_FROM, _KEPT_TO, _KEPT_STEP)
    blows = {
        name: Labelled(
            ("trial", "time_since_touch"),
            np.stack(
                [
                    np.interp(times, b.nail.times - b.nail.time_of_touch, getattr(b.nail, name))
                    for b in executed.values()
                ]
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
    held = next(iter(hold(config.novel.plain).values()))
    joint_names = get_runner(config.experience.settings).get_diagram(held).arm.joint_names
    write_trajectories(
        path,
        {
            **label_choices(arrays),
            **blows,
            **mapped,
            **coordinates,
            **label_motions(records, "executed under the true densities"),
        },
        {"trial": list(executed), "joint": joint_names},
    )
