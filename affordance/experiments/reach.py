"""Simulation III (paper, IV-C): choosing a grip for reaching with a tool that was never held.

Observers hold the first two objects of Simulation II. Before the first trial and after each trial, they choose a grip
for a novel tool, which they never hold. The choice is based on the cost of each grip in an inner simulation with the
believed densities. The correct grip moves the free end of the tool along a path at the least absolute work of the
joints. Expected: the probability of the correct choice grows from chance (figure 8).
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from affordance.arrays import about
from affordance.choice.inner_simulation import Choice
from affordance.choice.motion_cost import MotionCost
from affordance.choice.off_axis import measure_changes
from affordance.choice.reach import Reach
from affordance.control.task import check_start
from affordance.control.timed_path import load_path
from affordance.exceptions import BadValueError, name_object
from affordance.experiments import com
from affordance.experiments.shared.drawings import label_motions
from affordance.experiments.shared.experience import count_events, gain_experience, recall, tabulate_experience
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.grips import (
    blame,
    caption_proportions,
    check_colours_known,
    check_one_grip_is_cheaper,
    check_two_grips,
    choose_by_expectation,
    choose_by_sample,
    compare_measures,
    compute_probabilities,
    draw_proportions,
    find_grip_of_densest,
    measure_choices,
    plan_grips,
    remove_errors,
    tabulate_rules,
    tabulate_tools,
)
from affordance.experiments.shared.objects import check_can_be_held, check_honest, read_tools
from affordance.experiments.shared.observers import Setup, run_observers
from affordance.experiments.shared.results import Results
from affordance.objects.tool import Tool, find_free_end, list_colours, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.reporting.claims import ClaimResult, Unit, check, claim
from affordance.reporting.figures import draw_paths
from affordance.reporting.formatting import count_observers, label
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.reporting.replay import Replay, Scene
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.simulation.rollout import Rollout, roll_out
from affordance.simulation.trial import get_runner

TOOLS, PATH = "tools/novel.yaml", "paths/reach.yaml"  # in the folder of models; the first tool is from the paper
FAILURE = "cannot be followed"
RATIO, SHARE = Unit(digits=3), Unit("%", 100.0, 1)


def run(setup: Setup) -> Results:
    """Runs the experiment.

    Raises:
        BadValueError: The objects or the path do not fit the experiment.
    """
    held, tools, task = read(setup)
    choices, motions = plan(setup, tools, task)
    work = partial(compute_work, task, remove_errors(setup.settings))
    off_axis = measure_changes(work, tools, jobs=setup.jobs, description="reach: parts moved")
    experience = gain_experience(setup, held)
    follows_from = (held, tools, task, plan, gain_experience)
    data = run_observers("reach", setup, observe, list(choices.values()), experience, follows_from=follows_from)

    first = tools[0]
    colours = list_colours(held)
    shares = measure_choices(data, tools, choices, motions, off_axis, colours=colours, seed=setup.seed)
    numbers = {**shares, **measure(motions[first.name]), **count_events(experience)}
    p, name = numbers["p_correct"], first.name.replace("_", " ")
    others = ", ".join(tool.name.replace("_", " ") for tool in tools[1:])
    done = motions[first.name]
    best = done[numbers["correct_grip"]]
    runner = get_runner(setup.settings)
    return Results(
        order=3,
        title="Simulation III: choosing a grip for reaching",
        summary=(
            f"{count_observers(setup.observers)} held the objects of Simulation II. After every trial they chose the"
            f" end of the {name} by which to move its free end along a path of {task.duration:.2g} s with the least"
            f" absolute work of the joints, which counts braking like driving. They never held the {name}."
        )
        + (f" They also chose a grip for: {others}." if others else ""),
        finding=(
            f"The end that costs less work is chosen with a probability of {p[0]:.0%} before anything was held,"
            f" {p[1]:.0%} after one trial with other objects, and {p[-1]:.0%} after {len(p) - 1} trials."
        ),
        data=data.merge(label_motions(done, setup.settings)).merge(label_paths(done)),
        numbers=numbers,
        claims=judge(numbers, find_grip_of_densest(first, at_hand=True)),
        figures={
            "figure8": (
                f"Figure 8. {caption_proportions(tools, numbers)}",
                partial(draw_proportions, tools, numbers, "Choosing a grip for reaching", setup.observers),
            ),
            "figure7": (
                "Figure 7. The novel tools in both grips; the cross is the true centre of mass.",
                partial(draw_grips, tools),
            ),
            "path": (
                (
                    f"The path (dotted), and the motion of the free end of the {name} with each grip, simulated with"
                    " the true densities."
                ),
                partial(draw_paths, best.reference, {f"held by {grip}": each.path for grip, each in done.items()}),
            ),
        },
        tables={
            "Each tool, simulated with its true densities, and choices by the paper's rule.": tabulate_tools(numbers),
            f"The {name}: two rules of choice and two measures of cost, after 0, 1, 2, ... trials.": tabulate_rules(
                numbers
            ),
        },
        remarks=[
            "The paper specifies neither the path nor the size of the object; those used here are in models/.",
            compare_measures(numbers, first),
        ],
        lifts=tabulate_experience(experience, held, setup.settings.learner.name),
        diagram=lambda: runner.get_diagram(first.list_gripped()[numbers["correct_grip"]]).diagram,
        replay=replay(setup.settings.arm, first, done, best),
        seen=tools,
    )


def read(setup: Setup) -> tuple[Sequence[Tool], Sequence[Tool], Reach]:
    """Loads the held objects, the novel tools and the path, and checks that they fit the experiment."""
    held, path_file, file = com.read(setup)[:2], setup.models / PATH, setup.models / TOOLS
    task, tools = Reach(load_path(path_file)), read_tools(setup.models, TOOLS)
    check_start(path_file, "start", task.path.start, load_arm(setup.settings.arm))
    check_two_grips(file, tools)
    check_honest(file, tools)
    check_colours_known(file, tools, held, setup.models / com.OBJECTS)
    gripped = [each for tool in tools for each in tool.list_gripped().values()]
    check_can_be_held(file, gripped, setup.settings, task.path.start)
    return held, tools, task


def plan(setup: Setup, tools: Sequence[Tool], task: Reach) -> tuple[dict[str, Choice], dict[str, dict[str, Rollout]]]:
    """Plans the reaching motion for each grip of each observed tool, and simulates it with the true densities.

    Returns:
        Choices by tool, and simulated motions by tool and grip.

    Raises:
        BadValueError: The path cannot be followed with a grip, or two grips cost the same.
    """
    file, seed, jobs = setup.models / PATH, setup.seed, setup.jobs
    with blame(file, "points", FAILURE):
        choices = plan_grips(tools, task, setup.settings, seed=seed, jobs=jobs, description="reach: plans")
    for choice in choices.values():
        for option, cost in zip(choice.options, choice.cost_models, strict=True):
            if cost.infeasible_reason:
                problem = f"{FAILURE}: {name_object(option.name)} {cost.infeasible_reason}"
                raise BadValueError(file, "points", problem)
    simulate = partial(_simulate, task, remove_errors(setup.settings))
    with blame(file, "points", FAILURE):
        each = run_tasks([partial(simulate, tool) for tool in tools], jobs=jobs, description="reach: simulations")
    motions = dict(zip([tool.name for tool in tools], each, strict=True))
    for tool in tools:
        for grip, done in motions[tool.name].items():
            if problem := task.path.describe_error(done.error):
                raise BadValueError(file, "points", f"{FAILURE}: {name_object(tool.name)} by {grip} {problem}")
        works = [done.work for done in motions[tool.name].values()]
        check_one_grip_is_cheaper(setup.models / TOOLS, tool, works)
    return choices, motions


def _simulate(task: Reach, settings: Settings, tool: Tool) -> dict[str, Rollout]:
    """Simulates the reaching motion for each grip of a tool, with a controller that uses the true densities."""
    return {
        grip: roll_out(each, task, list_densities([tool]), settings) for grip, each in tool.list_gripped().items()
    }


def compute_work(task: Reach, settings: Settings, held: Tool) -> float:
    """Computes the absolute work of a planned reaching motion with a gripped tool of known densities, [J]."""
    cost = _plan_end(task, settings, tuple(find_free_end(held.components).tolist()))
    return float(cost.compute(held.parameters[None]).work[0])


@lru_cache(maxsize=4)
def _plan_end(task: Reach, settings: Settings, p_TF: tuple[float, ...]) -> MotionCost:
    """Plans the motion, which is the same for all tools with their free end at ``p_TF``, [m]."""
    return task.build_cost_of_end(ArmModel(load_arm(settings.arm)), np.array(p_TF), settings)


def observe(setup: Setup, choices: Sequence[Choice], experience: xr.Dataset, observer: int) -> xr.Dataset:
    """Simulates one observer's choices of a grip for each tool, before the first trial and after each trial.

    The rule of the paper compares the work for one sample of densities from the belief. The Bayes decision rule,
    which is applied to the first tool only, compares the expected work.
    """
    memories = [recall(setup, experience, observer, trial) for trial in range(experience.sizes["trial"] + 1)]
    seed = (setup.seed, observer)
    paper = [choose_by_sample(choice, memories, seed) for choice in choices]
    probabilities = [compute_probabilities(choice, memories, seed) for choice in choices]
    bayes, flips = choose_by_expectation(choices[0], memories, seed)
    meaning = "index of the grip chosen, -1 if none can be used"
    return xr.Dataset(
        {
            "paper": (("tool", "moment"), paper, about("1", f"{meaning}; by the paper's rule, one drawn density")),
            "probability": (
                ("tool", "moment", "grip"),
                probabilities,
                about("1", "probability that the paper's rule chooses the grip, of the posterior given all holds"),
            ),
            "bayes": ("moment", bayes, about("1", f"{meaning}; by the least expected absolute work, first tool")),
            "flips": ("moment", flips, about("1", "whether the integral of torque squared would choose otherwise")),
        },
        {"tool": [choice.options[0].object_name for choice in choices]},
    )


def measure(motions: Mapping[str, Rollout]) -> dict[str, Any]:
    """Computes cost and outcome of the reaching motion with the first tool, for each grip."""
    return {
        "energy_true": {grip: done.work for grip, done in motions.items()},
        "effort_true": {grip: done.effort for grip, done in motions.items()},
        "periods_limited": {grip: done.record.counts.limited for grip, done in motions.items()},
        "path_error_m": {grip: done.error for grip, done in motions.items()},
    }


def judge(n: Mapping[str, Any], densest_at_hand: str) -> list[ClaimResult]:
    """Tests the paper's claims about figure 8."""
    p, ci95 = n["p_correct"], n["p_correct_ci95"]
    ratio = n["energy_ratio_true"] if n["correct_grip"] == densest_at_hand else 1.0 / n["energy_ratio_true"]
    return [
        claim("correct_grip", "paper IV-C", "The optimal solution is to grasp the object by the steel component.",
              check("simulated absolute work with the other grip, divided by the work with this grip",
                    ratio, RATIO, above=1)),
        claim("chance", "paper IV-D, about figure 10; expected here too",
              "At the start of the experiment the robot is at chance.",
              check("correct before any experience", p[0], SHARE, at_least=0.48, at_most=0.52)),
        claim("increases", "paper IV-C, figure 8",
              "The proportion of correct choices increases as the robot gains experience with similar objects.",
              check("lower end of the last 95 % interval, above the upper end of the first",
                    ci95[-1][0], SHARE, above=ci95[0][1])),
        claim("learned", "ours", f"After {len(p) - 1} trials at least 95 of 100 choices are correct.",
              check("correct after the last trial", p[-1], SHARE, at_least=0.95)),
    ]  # fmt: skip


def draw_grips(tools: Sequence[Tool]) -> Figure:
    """Draws figure 7: each tool in both grips."""
    drawings = [
        Drawing(held, f"{label(tool.name)}, held by {label(grip)}")
        for tool in tools
        for grip, held in tool.list_gripped().items()
    ]
    return draw_objects(drawings, columns=2)


def label_paths(motions: Mapping[str, Rollout]) -> xr.Dataset:
    """Builds a dataset with the demanded path of the free end, and its motion with each grip."""
    reference = next(iter(motions.values())).reference
    return xr.Dataset(
        {
            "p_WF": (
                ("grip", "time", "axis"),
                [done.path for done in motions.values()],
                about("m", "position of the free end"),
            ),
            "p_WF_reference": (("time", "axis"), reference, about("m", "demanded position of the free end")),
        },
        {"axis": ["x", "y", "z"]},
    )


def replay(arm: Path, tool: Tool, motions: Mapping[str, Rollout], best: Rollout) -> Replay:
    """Builds the replay of the reaching motion, with one scene per grip."""
    held = tool.list_gripped()
    scenes = [
        Scene(held[grip], done.record.times, done.record.q, f"held by {grip}: absolute work {done.work:.1f} J")
        for grip, done in motions.items()
    ]
    return Replay(arm, f"Simulation III: {tool.name}", scenes, best.reference)


# The arm must be able to hold objects and to follow the path.
EXPERIMENT = Experiment(run, read, needs=("objects", "path"))
