"""Numbers of the study of the loop: choices and predictions of many observers on several robots."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.inner_simulation import Choice, TaskCostModel
from affordance.choice.listed_options import list_seen_options
from affordance.choice.pricing import GripBounds, plan_options
from affordance.choice.ranking import rank_draws
from affordance.files.model_folder import MODELS
from affordance.memory.ledger import open_memory
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Grip, Tool
from affordance.reporting.statistics import estimate_proportion
from affordance.robots.robot import Robot
from affordance.settings import Settings
from affordance.vision.pixels.camera_sensor import TURNING_RIG, CameraSensor
from studies.active.world import find_true_costs
from studies.loop.lives import LEVELS, Truths, draw_truth, is_mass_covered, judge, live
from studies.loop.recordings import MOTORS, TORQUE_SENSORS, build_recorder
from studies.loop.specimens import draw_things

TASKS = ("hammer", "reach")
CRITERIA = (Criterion.WORK, Criterion.GRIP)
# Tools that are also used for hammering; kitchen tools are only used for reaching.
_HAMMERS, _KITCHEN = "tools.yaml", "uncommon.yaml"
_SAMPLES = 1000
# Numbers of options and of belief samples for ``rank_seconds``.
_TIMED_OPTIONS, _TIMED_SAMPLES = 10, 10_000
# After all pieces, a robot chooses well if this share of choices or more is right, or if regret is at most this.
_RIGHT, _REGRET = 0.95, 0.01


@dataclass(frozen=True)
class LoopConfig:
    """Configuration of the observers' lives on one robot."""

    folder: Path  # folder of models of the robot
    has_torque_sensors: bool  # true for torque sensors at the joints, false for motor torques
    seed: int = 0  # root of every random draw


class Bench(NamedTuple):
    """Robot with its stock, tools and plans; it is planned only once, because every observer sees the same tools."""

    robot: Robot
    settings: Settings  # settings, with the robot as arm
    pieces: Sequence[Tool]  # pieces of stock
    tools: Sequence[Tool]  # three hammers and two kitchen tools
    tasks: Mapping[str, TaskCostModel]  # tasks by name
    choices: Mapping[str, Choice]  # planned options by task


@lru_cache(maxsize=4)
def build_bench(config: LoopConfig) -> Bench:
    """Builds the bench of a robot: tools are seen in pictures, and every motion is planned."""
    robot = Robot.load(config.folder)
    settings = Settings(arm=robot.directives)
    materials = load_materials(MODELS / "materials.yaml")
    hammers, kitchen = (load_tools(MODELS / "workshop" / name, materials) for name in (_HAMMERS, _KITCHEN))
    seen = list_seen_options([*hammers, *kitchen], config.seed)
    names = {tool.name for tool in hammers}
    tasks = {name: robot.load_task(name) for name in TASKS}
    choices = {
        name: plan_options([each for each in seen if name != "hammer" or each.object_name in names], task, settings)
        for name, task in tasks.items()
    }
    pieces = load_tools(MODELS / "workshop" / "blanks.yaml", materials)
    return Bench(robot, settings, pieces, [*hammers, *kitchen], tasks, choices)


class Life(NamedTuple):
    """Observer with its true tools and its memories."""

    rng: np.random.Generator  # generator for all further draws
    truths: Truths  # tools with their true inertias
    memories: Mapping[int, MaterialMemory]  # memory after each number of pieces held
    taught: float  # fraction of the recordings that the memory learned from; the others were rejected


def start_life(config: LoopConfig, bench: Bench, repeat: int) -> Life:
    """Lets an observer hold all pieces of stock."""
    rng = np.random.default_rng([config.seed, repeat, 17])
    recorder = build_recorder(bench.robot, TORQUE_SENSORS if config.has_torque_sensors else MOTORS, rng)
    truths = {tool.name: draw_truth(tool, bench.settings.prior.deviation, rng) for tool in bench.tools}
    with TemporaryDirectory() as folder:
        place = Path(folder) / "memory.sqlite"
        lives = dict(enumerate(live(place, recorder, bench.pieces, bench.settings, rng)))
        with open_memory(place) as ledger:
            return Life(rng, truths, lives, len(ledger) / len(bench.pieces))


def run_life(config: LoopConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Runs one observer's life.

    Returns:
        Arrays by name, NaN where no option can do the task with the true inertias. ``right`` and ``regret``, (levels,
        tasks, criteria). ``known``, both for an observer that knows materials exactly, (tasks, criteria, 2).
        ``covered``, (levels, tools), and ``own_covered``, (levels, own objects): whether intervals contain the true
        mass. ``taught``, the fraction of recordings that the memory learned from. ``spread``, the excess cost of the
        most expensive usable option over the cheapest, as a fraction, (tasks, criteria).
    """
    bench = build_bench(config)
    rng, truths, memories, taught = start_life(config, bench, repeat)
    shape = (len(LEVELS), len(TASKS), len(CRITERIA))
    right, regret, covered = np.zeros(shape), np.zeros(shape), np.zeros((len(LEVELS), len(bench.tools)))
    # An observer that knows every material exactly, but not how a piece or a tool deviates from it.
    informed = MaterialMemory.from_densities(
        {part.material.colour: part.material.density for tool in bench.tools for part in tool.components}
    )
    things, own_truths = see_things(config, bench, repeat)
    own_covered = np.zeros((len(LEVELS), len(own_truths)))
    for level, number in enumerate(LEVELS.values()):
        memory = memories[number]
        for i, task in enumerate(TASKS):
            for j, criterion in enumerate(CRITERIA):
                judged = judge(bench.choices[task], memory, truths, criterion, _SAMPLES, rng)
                right[level, i, j], regret[level, i, j] = judged
        covered[level] = is_mass_covered(bench.choices["reach"], memory, truths, rng)
        own_covered[level] = is_mass_covered(things, memory, own_truths, rng)
    known = [
        [judge(bench.choices[task], informed, truths, each, _SAMPLES, rng) for each in CRITERIA] for task in TASKS
    ]
    spread = [[_find_spread(bench.choices[task], truths, each) for each in CRITERIA] for task in TASKS]
    return {
        "right": right,
        "regret": regret,
        "covered": covered,
        "own_covered": own_covered,
        "taught": np.array(taught),
        "spread": np.array(spread),
        "known": np.array(known),
    }


def see_things(config: LoopConfig, bench: Bench, repeat: int) -> tuple[Choice, Truths]:
    """Lets an observer see its own objects; returns them as options without a plan, and their true inertias."""
    drawn, seed = np.random.default_rng([config.seed, repeat, 18]), int(1e6) * config.seed + repeat
    things = draw_things(drawn, load_materials(MODELS / "materials.yaml"))
    truths = {thing.name: draw_truth(thing, bench.settings.prior.deviation, drawn) for thing in things}
    held = [replace(thing, grips=(Grip("", np.eye(4)),)) for thing in things]
    return Choice(list_seen_options(held, seed, CameraSensor(TURNING_RIG)), (), bench.settings), truths


def _find_spread(choice: Choice, truths: Truths, criterion: Criterion) -> float:
    costs = find_true_costs(choice, truths, criterion)
    usable: Array = costs[np.isfinite(costs)]
    return float(usable.max() / usable.min() - 1.0) if len(usable) else np.nan


def describe_robot(
    arrays: Mapping[str, NDArray[Any]], tasks: Sequence[str] = TASKS
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Summarises the results on a robot.

    Returns:
        Content of metrics.json for the criterion in which options differ most: shares of right choices and regret by
        level, over both tasks; the fraction of recordings that the memory learned from; and the coverage of predicted
        masses of own objects and of the tools after all pieces. Then details: right choices and regret by task and
        criterion, with 95 % intervals.
    """
    best = int(np.argmax(np.nanmean(arrays["spread"], axis=(0, 1))))
    right, regret = (np.nanmean(arrays[name][..., best], axis=2) for name in ("right", "regret"))
    known = np.nanmean(arrays["known"][:, :, best], axis=1)
    metrics = {
        "by": CRITERIA[best].value,
        "right": {name: float(right[:, i].mean()) for i, name in enumerate(LEVELS)},
        "regret": {name: float(regret[:, i].mean()) for i, name in enumerate(LEVELS)},
        "right_if_known": float(known[:, 0].mean()),
        "regret_if_known": float(known[:, 1].mean()),
        "coverage_mass": float(arrays["own_covered"][:, -1].mean()),
        "coverage_tools": float(arrays["covered"][:, -1].mean()),
        "taught": float(arrays["taught"].mean()),
        "coverage_by_experience": {name: float(arrays["own_covered"][:, i].mean()) for i, name in enumerate(LEVELS)},
    }
    details: dict[str, Any] = {
        task: {
            criterion.value: {name: _describe_cell(arrays, (level, i, j)) for level, name in enumerate(LEVELS)}
            | {"spread": _average(arrays["spread"][:, i, j])}
            for j, criterion in enumerate(CRITERIA)
        }
        for i, task in enumerate(tasks)
    }
    return metrics, details


def summarise_robots(robots: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    """Returns, for each claim, the worst value over all robots."""
    each = list(robots.values())
    return {
        "settled": float(
            np.mean([robot["right"]["after_5"] >= _RIGHT or robot["regret"]["after_5"] <= _REGRET for robot in each])
        ),
        "least_right": min(robot["right"]["after_5"] for robot in each),
        "largest_regret": max(robot["regret"]["after_5"] for robot in each),
        "largest_rise": max(robot["regret"][level] - robot["regret"]["before"] for robot in each for level in LEVELS),
        "least_coverage": min(robot["coverage_mass"] for robot in each),
        "largest_coverage": max(robot["coverage_mass"] for robot in each),
    }


def _describe_cell(arrays: Mapping[str, NDArray[Any]], place: tuple[int, int, int]) -> dict[str, Any]:
    """Summarises the choices for one task, criterion and level; values are None if no option can do the task."""
    hits = arrays["right"][:, *place]
    hits = hits[np.isfinite(hits)]
    share = estimate_proportion(np.array(hits.sum()), max(len(hits), 1))
    return {
        "right": float(share.mean) if len(hits) else None,
        "right_ci95": [float(share.low), float(share.high)] if len(hits) else [None, None],
        "regret": _average(arrays["regret"][:, *place]),
        "worlds": len(hits),
    }


def _average(values: Array) -> float | None:
    """Returns the mean over observers that can do the task; None if there are none."""
    found = values[np.isfinite(values)]
    return float(found.mean()) if len(found) else None


def time_ranking(config: LoopConfig) -> dict[str, float]:
    """Measures the time to rank ten options under 10,000 beliefs, [s], with planning and then without it."""
    bench = build_bench(config)
    options = bench.choices["reach"].options[:_TIMED_OPTIONS]
    settings = Settings(arm=bench.settings.arm, angle_margin=bench.settings.angle_margin * (1.0 + 1e-12))
    times = []
    for _ in range(2):  # new settings, so that nothing has been planned for them yet
        begin = perf_counter()
        choice, rng = plan_options(options, bench.tasks["reach"], settings), np.random.default_rng(0)
        rank_draws(choice, choice.draw(MaterialMemory(), rng, _TIMED_SAMPLES), rng, bounds=GripBounds())
        times.append(perf_counter() - begin)
    return {"first": times[0], "repeated": times[1]}
