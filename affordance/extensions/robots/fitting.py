"""Adapts path, blow and objects to what an arm can do, and reports every change.

Variants are tried in a fixed order. The path is tried unchanged, mirrored, slower and finally smaller. The blow is
tried unchanged, slower and less deep. Objects are scaled only if the arm cannot hold them. Variants are planned as in
the experiments, with true densities. Feasible plans are then simulated with functions of the caller.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from affordance.choice.blow_cost import BlowCost
from affordance.choice.carry import Carry, Keep
from affordance.choice.hammer import Hammer, load_hammer
from affordance.choice.motion_cost import MotionCost
from affordance.choice.reach import Reach
from affordance.choice.tasks import load_task
from affordance.control.timed_path import TimedPath, load_path
from affordance.exceptions import AffordanceError, name_object
from affordance.files.atomic import write_text
from affordance.files.bounded import read_yaml
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool
from affordance.plant.arm import ARM
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.reporting.formatting import format_beside
from affordance.settings import Settings

# Key for all lengths of the objects in a tools file; its values are scale factors.
SIZE_OF_TOOLS = "size"
_LENGTHS = ("tools.*.components.*.semi_axes", "tools.*.components.*.position", "tools.*.grips.*.position")
PATH, NAIL, CARRY = "paths/reach.yaml", "nail.yaml", "tasks/carry.yaml"
_HELD = ("tools/weight.yaml", "tools/com.yaml", "tools/novel.yaml")
_ALL_TOOLS = (*_HELD, "tools/uncommon.yaml")
# Factors of a path's duration, and of its size if slowing down is not enough.
_PACES, _SIZES = (1.0, 1.25, 1.5, 2.0, 3.0), (1.0, 0.75, 0.5, 0.35)
_SWING_PACES, _CARRYING_PACES = (1.0, 1.5, 2.0), (1.0, 1.5)
# Factors of the size of objects, and the largest static load at home that leaves enough torque for motion, as a
# fraction of a joint's torque limit.
_FACTORS, _ENOUGH = (0.9, 0.8, 0.7, 0.6, 0.5, 0.4), 0.8
_STEP_OF_DEPTH = 1e-4  # depths are multiples of 0.1 mm


class Change(NamedTuple):
    """Change of a value in a task file, with its reason. The new value None removes the key."""

    file: str
    key: str
    old: Any
    new: Any
    why: str

    def __str__(self) -> str:
        return f"{self.file}: {self.key}: {show(self.old)} -> {show(self.new)} ({self.why})"


def show(value: Any) -> str:
    """Formats a value. Numbers get four significant digits."""
    if value is None:
        return "removed"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(show(entry) for entry in value)}]"
    return str(value)


def apply_changes(models: Path, changes: Sequence[Change]) -> None:
    """Applies changes to the files of a model folder, with a comment at the top of each changed file.

    Keys are paths such as ``blow.duration``, or SIZE_OF_TOOLS.
    """
    for file in dict.fromkeys(change.file for change in changes):
        of_file = [change for change in changes if change.file == file]
        path = models / file
        content = read_yaml(path)
        for change in of_file:
            if change.key == SIZE_OF_TOOLS:
                factor = change.new / change.old
                for key in _LENGTHS:
                    _edit(content, key.split("."), partial(_scale, factor))
            else:
                _edit(content, change.key.split("."), partial(lambda new, _: new, change.new))
        notes = "".join(f"# Changed by affordance import-arm: {change}\n" for change in of_file)
        write_text(path, notes + yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110))


def _edit(content: Any, keys: Sequence[str], change: Callable[[Any], Any]) -> None:
    """Changes the value at a path of keys. ``*`` selects all values, and missing keys are ignored."""
    first, rest = keys[0], keys[1:]
    if first == "*":
        for entry in content.values() if isinstance(content, dict) else content:
            _edit(entry, rest, change)
    elif first in content:
        if rest:
            _edit(content[first], rest, change)
        else:
            content[first] = change(content[first])
            if content[first] is None:
                del content[first]


def _scale(factor: float, value: Any) -> Any:
    """Multiplies a number, or all numbers of a list, and rounds to six significant digits."""
    if isinstance(value, list):
        return [_scale(factor, entry) for entry in value]
    return float(f"{value * factor:.6g}")


class Fitted(NamedTuple):
    """Changes that adapt tasks to an arm, and the reasons why tasks are infeasible, for each task name."""

    changes: tuple[Change, ...]
    lacks: dict[str, str]


# Functions that simulate a task with a tool and describe the fault; empty without a fault.
type SimulatePath = Callable[[Tool, TimedPath, Settings], str]
type SimulateBlow = Callable[[Tool, Hammer, BlowCost, Settings], str]


class TaskFit(NamedTuple):
    """Changes that make one task feasible, or the reason why it is infeasible."""

    changes: tuple[Change, ...]
    lack: str = ""


class Holding(NamedTuple):
    """Largest static load of the arm in its home posture."""

    load: float  # largest fraction of a torque limit
    joint: str
    object_name: str  # object that causes this load; empty for the empty hand
    mass: float  # mass of that object, [kg]


def fit_tasks(
    models: Path,
    simulate_path: SimulatePath,
    simulate_blow: SimulateBlow,
    tell: Callable[[str], None] = lambda step: None,
) -> Fitted:
    """Adapts the tasks of a model folder to its simulated arm. Infeasible tasks remain unchanged.

    ``tell`` is called with the name of each task before it is adapted.
    """
    changes: tuple[Change, ...] = ()
    lacks: dict[str, str] = {}
    for name, fit in (
        ("objects", fit_objects),
        ("path", partial(fit_path, simulate=simulate_path)),
        ("blow", partial(fit_blow, simulate=simulate_blow)),
        ("carry", fit_carry),
    ):
        if "objects" in lacks:
            break  # an arm that cannot hold the objects cannot move them
        tell(f"fitting tasks: {name}")
        found: TaskFit = fit(models)
        apply_changes(models, found.changes)
        changes += found.changes
        if found.lack:
            lacks[name] = found.lack
    return Fitted(changes, lacks)


def list_held(models: Path, files: Sequence[str] = _HELD) -> list[Tool]:
    """Lists all held objects. Novel objects appear once per grip."""
    materials = load_materials(models / "materials.yaml")
    tools = [tool for file in files for tool in load_tools(models / file, materials)]
    return [held for tool in tools for held in ([tool.gripped_by(grip) for grip in tool.grips] or [tool])]


def measure_holding(models: Path, factor: float = 1.0) -> Holding:
    """Finds the scaled object that loads the arm most in its home posture."""
    arm = load_arm(models / ARM.name)
    static = StaticHold(arm)
    empty = arm.limits.compute_loads(static.tau_arm)
    # Mass is proportional to the third power of size, first moments to the fourth, moments of inertia to the fifth.
    growth = factor ** np.array([3.0, *[4.0] * 3, *[5.0] * 6])
    found = Holding(float(empty.max()), arm.joint_names[int(np.argmax(empty))], "", 0.0)
    for tool in list_held(models):
        load = arm.limits.compute_loads(static.tau_arm + static.Y @ (growth * tool.parameters))
        if load.max() > found.load:
            joint = arm.joint_names[int(np.argmax(load))]
            found = Holding(float(load.max()), joint, tool.name, factor**3 * tool.mass)
    return found


def fit_objects(models: Path) -> TaskFit:
    """Scales objects down if the arm cannot hold them."""
    holding = measure_holding(models)
    if holding.load <= 1.0:
        return TaskFit(())
    too_heavy = (
        f"{name_object(holding.object_name)} of {holding.mass:.2f} kg"
        if holding.object_name
        else "the arm's own weight"
    ) + f" loads {holding.joint} with {format_beside(100.0 * holding.load, 100.0, 0)} % of its torque limit"
    for factor in _FACTORS:
        if measure_holding(models, factor).load <= _ENOUGH:
            why = f"{too_heavy}; masses are {factor**3:.2f} times the original ones"
            files = [file for file in _ALL_TOOLS if (models / file).exists()]
            return TaskFit(tuple(Change(file, SIZE_OF_TOOLS, 1.0, factor, why) for file in files))
    least = 100.0 * measure_holding(models, _FACTORS[-1]).load
    return TaskFit((), f"{too_heavy}, and still {least:.0f} % with objects scaled to {_FACTORS[-1]:g} of their size")


def fit_path(models: Path, simulate: SimulatePath) -> TaskFit:
    """Finds a path that the arm can follow with every novel object in every grip."""
    settings, asked = Settings(arm=models / ARM.name), load_path(models / PATH)
    model = ArmModel(load_arm(settings.arm))
    tools = list_held(models, ("tools/novel.yaml",))
    return _fit_easier(PATH, asked, _PACES, lambda path: _find_lack(model, path, tools, settings, simulate))


def fit_carry(models: Path) -> TaskFit:
    """Finds a path for carrying every novel object in every grip, by planning only."""
    settings, asked = Settings(arm=models / ARM.name), load_task(models, "carry")
    assert isinstance(asked, Carry)
    model = ArmModel(load_arm(settings.arm))
    tools = list_held(models, ("tools/novel.yaml",))
    # An object that overloads the resting arm at the start cannot be carried along any path.
    if lack := _find_lack_of_carrying(model, Keep(asked.duration, asked.path.start), tools, settings):
        return TaskFit((), lack)

    def find_lack(path: TimedPath) -> str:
        return _find_lack_of_carrying(model, replace(asked, path=path), tools, settings)

    return _fit_easier(CARRY, asked.path, _CARRYING_PACES, find_lack)


def _fit_easier(
    file: str, asked: TimedPath, paces: Sequence[float], find_lack: Callable[[TimedPath], str]
) -> TaskFit:
    """Finds the first feasible path, from the given path to increasingly easy variants."""
    first_lack = ""
    for path, why in asked.list_easier(paces, _SIZES):
        lack = find_lack(path)
        first_lack = first_lack or lack
        if not lack:
            explained = f"unchanged, {first_lack}; {why}" if first_lack else ""
            return TaskFit(tuple(_list_path_changes(file, asked, path, explained)))
    return TaskFit((), first_lack)


def _find_lack_of_carrying(model: ArmModel, task: Carry | Keep, tools: Sequence[Tool], settings: Settings) -> str:
    """Explains which tool cannot be carried along a motion. Empty if all can be carried."""
    try:
        cost = task.build_cost(model, tools[0].components, settings)
    except AffordanceError as error:
        return str(error)
    return cost.infeasible_reason or next(filter(None, (_describe_overload(model, cost, tool) for tool in tools)), "")


def _find_lack(
    model: ArmModel, path: TimedPath, tools: list[Tool], settings: Settings, simulate: SimulatePath
) -> str:
    """Explains why a path cannot be followed with some tool. Empty if it can be followed with all.

    A tool that fails is moved to the front of the list, because it will probably fail on the next path too.
    """
    # A feasible plan may still fail in simulation, for example where joint limits slow the arm down.
    for find in (partial(_find_lack_of_plan, model), simulate):
        for k, tool in enumerate(tools):
            if lack := find(tool, path, settings):
                tools.insert(0, tools.pop(k))
                return lack
    return ""


def _find_lack_of_plan(model: ArmModel, tool: Tool, path: TimedPath, settings: Settings) -> str:
    try:
        cost = Reach(path).build_cost(model, tool.components, settings)
    except AffordanceError as error:
        return str(error)
    if cost.infeasible_reason:
        return f"{tool.name} by {tool.grip} {cost.infeasible_reason}"
    return _describe_overload(model, cost, tool)


def _describe_overload(model: ArmModel, cost: MotionCost, tool: Tool) -> str:
    """Names the joint that a tool overloads during a motion. Empty without one."""
    loads = cost.compute_joint_loads(tool.parameters[None])[:, 0]
    if loads.max() <= 1.0:
        return ""
    joint = model.arm.joint_names[int(np.argmax(loads))]
    load = format_beside(100.0 * loads.max(), 100.0, 0)
    return f"{tool.name} by {tool.grip} loads {joint} with {load} % of its torque limit"


def _list_path_changes(file: str, old: TimedPath, new: TimedPath, why: str) -> Iterator[Change]:
    if old.points != new.points:
        yield Change(file, "points", [list(p) for p in old.points], [list(p) for p in new.points], why)
    if old.duration != new.duration:
        yield Change(file, "duration", old.duration, new.duration, why)


def fit_blow(models: Path, simulate: SimulateBlow) -> TaskFit:
    """Finds a nail depth and swing duration that are feasible with every novel object in every grip.

    A blow is feasible if it can be planned and, in a simulation with contact, drives the nail with the required
    force. Simulation takes most of the time, so the swing with the deepest plan is simulated first.
    """
    settings, asked = Settings(arm=models / ARM.name), load_hammer(models / NAIL)
    tools = list_held(models, ("tools/novel.yaml",))
    demanded, lack = asked.nail.depth_demanded, ""
    planned: list[_PlannedBlow] = []
    for pace in _SWING_PACES:
        task = replace(asked, duration=asked.duration * pace)
        least = max((each.depth for each in planned), default=asked.nail.depth_set)
        plan = _plan_depth(task, tools, settings, least=least)
        lack = lack or plan.reason
        if plan.depth >= demanded:
            fault = _simulate_blows(plan, tools, settings, simulate)
            if not fault:
                return TaskFit(tuple(_list_blow_changes(asked, plan, lack)))
            lack = lack or fault
        elif plan.depth > least:
            planned.append(plan)
    for plan in reversed(planned):  # deepest first
        fault = _simulate_blows(plan, tools, settings, simulate)
        if not fault:
            return TaskFit(tuple(_list_blow_changes(asked, plan, lack)))
        lack = lack or fault
    return TaskFit((), lack)


class _PlannedBlow(NamedTuple):
    """Planned blow with one duration, to the greatest depth that is feasible with all tools."""

    task: Hammer
    depth: float  # [m]
    reason: str  # why the required depth is not reached; empty if it is
    costs: dict[tuple[str, str], BlowCost]  # plans for the required depth, for each tool and grip


def _list_blow_changes(asked: Hammer, plan: _PlannedBlow, lack: str) -> Iterator[Change]:
    if plan.depth < asked.nail.depth_demanded:
        yield Change(NAIL, "depth_demanded", asked.nail.depth_demanded, plan.depth, lack)
    if plan.task.duration != asked.duration:
        yield Change(NAIL, "blow.duration", asked.duration, plan.task.duration, lack)


def _plan_depth(task: Hammer, tools: list[Tool], settings: Settings, *, least: float) -> _PlannedBlow:
    """Plans blows with one duration for every tool, until a tool reaches at most the depth ``least``, [m].

    The tool with the smallest depth is moved to the front of the list, because it will probably limit the next plan
    too.
    """
    model, depth, reason = ArmModel(load_arm(settings.arm)), task.nail.depth_demanded, ""
    costs: dict[tuple[str, str], BlowCost] = {}
    weakest = 0
    for k, tool in enumerate(tools):
        cost = task.build_cost(model, tool.components, settings)
        costs[tool.name, tool.grip] = cost
        reached = _bound_depth(cost, tool)
        if reached < depth:
            depth, weakest = reached, k
            reason = f"with {name_object(tool.name)} by {tool.grip} {cost.explain_infeasibility(tool.parameters)}"
        if depth <= least:
            break
    tools.insert(0, tools.pop(weakest))
    return _PlannedBlow(task, max(depth, least), reason, costs)


def _simulate_blows(plan: _PlannedBlow, tools: list[Tool], settings: Settings, simulate: SimulateBlow) -> str:
    """Simulates a blow with every tool. Returns the first fault, or an empty text.

    A tool that fails is moved to the front of the list, because it will probably fail in the next blow too.
    """
    model, task, costs = ArmModel(load_arm(settings.arm)), plan.task, plan.costs
    if plan.depth < task.nail.depth_demanded:  # a different depth needs a new plan
        nail = replace(task.nail, depth_demanded=plan.depth)
        task, costs = replace(task, nail=nail, force=nail.force_demanded), {}
    for k, tool in enumerate(tools):
        cost = costs.get((tool.name, tool.grip)) or task.build_cost(model, tool.components, settings)
        if fault := simulate(tool, task, cost, settings):
            tools.insert(0, tools.pop(k))
            return fault
    return ""


def _bound_depth(cost: BlowCost, tool: Tool) -> float:
    """Computes the required depth or the greatest feasible depth, [m], rounded down to 0.1 mm."""
    nail = cost.nail
    if cost.infeasible_reason:
        return nail.depth_set
    depth = cost.find_greatest_depth(tool.parameters)
    return depth if depth >= nail.depth_demanded else round(math.floor(depth / _STEP_OF_DEPTH) * _STEP_OF_DEPTH, 6)
