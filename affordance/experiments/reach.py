"""Simulation III (paper, IV-C): choosing a grip for reaching with a tool.

Observers hold the objects of simulation II, and after every trial choose which end of a novel object to hold so that
moving its free end along a path costs least. They never hold it. Which grip really is the cheaper one is measured:
both are simulated with the true densities.
"""

import functools
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.choice.reach import Reach
from affordance.control.timed_path import load_path
from affordance.exceptions import AffordanceError, BadValueError
from affordance.experiments.shared import correct_grip as right_grip
from affordance.experiments.shared import sensitivity
from affordance.experiments.shared.camera_views import add_camera_views
from affordance.experiments.shared.correct_grip import (
    check_one_grip_is_cheaper,
    find_cheaper_grip,
    find_grip_of_densest,
)
from affordance.experiments.shared.decisions import (
    NUM_PRIOR_CHOICES,
    Choices,
    compute_proportions,
    describe_effort,
    describe_headed,
    describe_rules,
    draw_proportions,
    label_choices,
    list_by_grip,
    plan_choices,
    run_repeat,
)
from affordance.experiments.shared.experience import ExperienceConfig, collect_experience
from affordance.experiments.shared.novel_objects import NovelObjects, hold, load_subjects
from affordance.experiments.shared.outputs import describe_run, label_motions, name_faults
from affordance.experiments.vision_comparison import save_vision_metrics
from affordance.files.atomic import write_json
from affordance.files.model_folder import MODELS
from affordance.files.netcdf import Labelled, write_trajectories
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.reporting import figures
from affordance.reporting.diagram_picture import save_diagram
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.reporting.replay import Scene, write_replay
from affordance.reporting.report import Claim, Picture, Section, write_section
from affordance.reporting.wording import count_observers, introduce_observers, show_beside, warn_of_few_observers
from affordance.runs.repeats import compute_key, run_repeats
from affordance.settings import Settings
from affordance.simulation.rollout import Rollout, roll_out
from affordance.simulation.trial import get_runner
from affordance.vision.features import FeatureSource

NAME = "reach"


@dataclass(frozen=True)
class ReachConfig:
    """What is run.

    Attributes:
        experience: The objects that are held, and how they are learned.
        novel: The objects that are chosen about.
        task: The path to follow.
    """

    experience: ExperienceConfig
    novel: NovelObjects
    task: Reach


def load_config(
    models: Path = MODELS, seed: int = 0, feature_source: FeatureSource = FeatureSource.FEATURES
) -> ReachConfig:
    """Reads arm, objects and path from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    experience, novel = load_subjects(models, seed, feature_source)
    path = models / "paths" / "reach.yaml"
    config = ReachConfig(experience, novel, Reach(load_path(path)))
    # What cannot be planned or carried out is refused here, before anything is written.
    try:
        choices = build_choices(config)
    except AffordanceError as error:
        raise BadValueError(path, "points", f"cannot be followed: {error}") from error
    for choice in choices:
        for option, cost_model in zip(choice.options, choice.cost_models, strict=True):
            if cost_model.infeasible_reason:
                raise BadValueError(
                    path, "points", f"cannot be followed: the {option.name} {cost_model.infeasible_reason}"
                )
    for tool in (novel.plain, novel.headed):
        executed = execute(config, tool)
        for grip, rollout in executed.items():
            if misses := config.task.path.describe_error(rollout.error):
                raise BadValueError(path, "points", f"cannot be followed: the {tool.name} by {grip} {misses}")
        check_one_grip_is_cheaper(models, tool, [rollout.work for rollout in executed.values()])
    return config


def build_choices(config: ReachConfig) -> Choices:
    """Plans the task with each grip of each object.

    Raises:
        AffordanceError: The path cannot be planned.
    """
    return plan_choices(config.novel, config.task, config.experience.settings, config.experience.seed)


def execute(config: ReachConfig, tool: Tool) -> dict[str, Rollout]:
    """Simulates the task under the true densities with each grip of a tool."""
    return _execute(replace(config, experience=right_grip.remove_errors_of(config.experience)), tool)


@functools.lru_cache(maxsize=2)  # simulated to refuse what cannot be followed, reported when it is run
def _execute(config: ReachConfig, tool: Tool) -> dict[str, Rollout]:

    def follow_path(held: Tool, densities: Mapping[Colour, float], settings: Settings) -> Rollout:
        return roll_out(held, config.task, densities, settings)

    return right_grip.execute(tool, config.experience.settings, follow_path)


def run(config: ReachConfig, folder: Path, *, repeats: int, jobs: int) -> None:
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
    executed = execute(config, config.novel.plain)
    executed_headed = execute(config, config.novel.headed)
    experience = collect_experience(config.experience, folder.parent / "experience", repeats=repeats, jobs=jobs)
    kept = folder / "repeats" / compute_key(config, settings.arm.parent)
    arrays = run_repeats(
        kept, partial(run_repeat, choices, experience, seed), repeats=repeats, jobs=jobs, description=NAME
    )
    numbers = compute_metrics(config, choices, arrays, executed, executed_headed)
    numbers.update(experience.count_faults())
    correct = list(executed).index(numbers["correct_grip"])
    studied = sensitivity.study(config.experience, choices.plain, correct, repeats=repeats, jobs=jobs)
    _write_trajectories(folder / "trajectories.nc", config, arrays, executed)
    held = hold(config.novel.plain)
    save_diagram(get_runner(settings).get_diagram(held[numbers["correct_grip"]]).diagram, folder, "diagram")
    _draw(config, numbers, executed, folder, repeats)
    sensitivity.save_drawing(studied, folder, repeats)
    section = name_faults(describe(config, numbers, repeats), settings.faults, right_grip.WITHOUT_FAULTS)
    write_section(
        folder, add_camera_views(section, folder, (config.novel.plain, config.novel.headed), settings, seed)
    )
    scenes = [
        Scene(held[grip], rollout.record.times, rollout.record.q, f"held by {grip}: {rollout.work:.1f} J")
        for grip, rollout in executed.items()
    ]
    path = executed[numbers["correct_grip"]].reference
    title = f"Simulation III: {config.novel.plain.name}"
    write_replay(folder / "replay.html", settings.arm, scenes, title=title, p_WG=path)
    described = describe_run(config, seed=seed, repeats=repeats, wall_s=time.perf_counter() - start)
    save_vision_metrics(folder, numbers, settings, seed=seed, repeats=repeats)
    # Last: where it is, the rest is too.
    write_json(folder / "metrics.json", {**numbers, "p_correct_sensitivity": studied, **described})


def compute_metrics(
    config: ReachConfig,
    choices: Choices,
    arrays: Mapping[str, NDArray[Any]],
    executed: Mapping[str, Rollout],
    executed_headed: Mapping[str, Rollout],
) -> dict[str, Any]:
    """Computes the numbers of the results contract.

    Args:
        config: What was run.
        choices: The choices of a grip.
        arrays: Choices of all observers, (repeats, K + 1) each.
        executed: The task with each grip of the plain object, under the true densities.
        executed_headed: The same for the headed object.
    """
    grips = list(executed)
    correct_grip, correct_headed = find_cheaper_grip(executed), find_cheaper_grip(executed_headed)
    correct, correct_of_headed = grips.index(correct_grip), list(executed_headed).index(correct_headed)
    return {
        **compute_proportions(choices, arrays, config.experience, correct, correct_of_headed),
        "correct_grip": correct_grip,
        "correct_grip_headed_tool": correct_headed,
        "density_true": {part.material.name: part.material.density for part in config.novel.plain.components},
        "energy_true": {grip: rollout.work for grip, rollout in executed.items()},
        "energy_ratio_true": max(done.work for done in executed.values()) / executed[correct_grip].work,
        "energy_true_headed_tool": {grip: rollout.work for grip, rollout in executed_headed.items()},
        "effort_true": {grip: rollout.effort for grip, rollout in executed.items()},
        "periods_limited": {grip: rollout.record.counts.limited for grip, rollout in executed.items()},
        "path_error_m": {grip: rollout.error for grip, rollout in executed.items()},
    }


def describe(config: ReachConfig, numbers: Mapping[str, Any], repeats: int) -> Section:
    """Puts the numbers beside what the paper says."""
    p, interval = np.asarray(numbers["p_correct"]), np.asarray(numbers["p_correct_ci95"])
    errors = 1000.0 * max(numbers["path_error_m"].values())
    plain, headed_name = config.novel.plain.name, config.novel.headed.name
    last = len(p) - 1
    claims = [
        Claim(
            "IV-C",
            "The optimal solution is to grasp the object by the steel component.",
            bool(numbers["correct_grip"] == find_grip_of_densest(config.novel.plain, at_hand=True)),
            f"simulated with the true densities, {list_by_grip(numbers['energy_true'], 'J')} (ratio "
            f"{numbers['energy_ratio_true']:.3f}); the free end keeps to the path within {errors:.0f} mm",
        ),
        Claim(
            "IV-D (of figure 10); expected here too",
            "At the start of the experiment the robot is at chance.",
            bool(abs(p[0] - 0.5) < 0.02),
            f"{p[0]:.3f} of {NUM_PRIOR_CHOICES} choices before any experience",
        ),
        Claim(
            "IV-C, figure 8",
            "The proportion of correct choices increases as the robot gains experience with similar objects.",
            bool(p[-1] > p[0] and interval[-1, 0] > interval[0, 1]),
            "after 0, 1, 2, ... trials: " + ", ".join(f"{value:.3f}" for value in p),
        ),
        Claim(
            "ours",
            f"After {last} trials at least 95 of 100 choices are correct.",
            bool(p[-1] >= 0.95),
            f"{show_beside(p[-1], 0.95, 3)} after {last} trials, "
            f"95 % interval {interval[-1, 0]:.3f} to {interval[-1, 1]:.3f}",
        ),
    ]
    return Section(
        order=3,
        title="Simulation III: choosing a grip for reaching",
        summary=(
            f"{introduce_observers(repeats, 'hold', 'holds')} the objects of simulation II. After every trial they "
            f"choose which end of the {plain} to hold, to move its free end along a path of "
            f"{config.task.duration:g} s with the least work. They never hold the {plain}. "
            f"Beside it they choose about the {headed_name}: "
            f"{describe_headed(numbers)}. {_describe_materials(config.novel.plain, config.novel.headed)}"
            f"{warn_of_few_observers(repeats)}"
        ),
        pictures=[
            Picture(
                "figure7.png", "Figure 7. The novel objects in both grips; the cross is the true centre of mass."
            ),
            Picture("figure8.png", "Figure 8. Correct choices after trials with the objects of simulation II."),
            Picture(
                "path.png",
                "The path (dotted), and where the free end went with each grip, simulated under the true densities.",
            ),
            sensitivity.PICTURE,
        ],
        claims=claims,
        differences=[
            "The paper does not say what the path was, nor the sizes of the object; here they are those of models/.",
            describe_rules(numbers),
            describe_effort(numbers),
        ],
    )


def _describe_materials(plain: Tool, headed: Tool) -> str:
    """Says what the two objects are made of."""
    of_plain, of_headed = (
        list(dict.fromkeys(part.material.name for part in tool.components)) for tool in (plain, headed)
    )
    if set(of_plain) == set(of_headed):
        return f"Both are of {' and '.join(of_plain)}."
    return f"The {plain.name} is of {' and '.join(of_plain)}, the {headed.name} of {' and '.join(of_headed)}."


def _draw(
    config: ReachConfig,
    numbers: Mapping[str, Any],
    executed: Mapping[str, Rollout],
    folder: Path,
    repeats: int,
) -> None:
    drawings = [
        Drawing(held, f"{tool.name}, held by {grip}")
        for tool in (config.novel.plain, config.novel.headed)
        for grip, held in hold(tool).items()
    ]
    figures.save_figure(draw_objects(drawings, columns=2), folder, "figure7")
    title = f"Choosing a grip for reaching, {count_observers(repeats)}, 95 % intervals"
    figure = draw_proportions(config.novel, numbers, title)
    figures.save_figure(figure, folder, "figure8")
    paths = {f"held by {grip}": rollout.path for grip, rollout in executed.items()}
    reference = next(iter(executed.values())).reference
    figures.save_figure(figures.draw_paths(reference, paths), folder, "path")


def _write_trajectories(
    path: Path, config: ReachConfig, arrays: Mapping[str, NDArray[Any]], executed: Mapping[str, Rollout]
) -> None:
    ends = {
        "p_WF": Labelled(
            ("trial", "time", "axis"),
            np.stack([done.path for done in executed.values()]),
            "m",
            "where the free end went",
        ),
        "p_WF_reference": Labelled(("time", "axis"), next(iter(executed.values())).reference, "m", "the path"),
    }
    records = [done.record for done in executed.values()]
    held = next(iter(hold(config.novel.plain).values()))
    joint_names = get_runner(config.experience.settings).get_diagram(held).arm.joint_names
    write_trajectories(
        path,
        {**label_choices(arrays), **ends, **label_motions(records, "executed under the true densities")},
        {"trial": list(executed), "joint": joint_names, "axis": ["x", "y", "z"]},
    )
