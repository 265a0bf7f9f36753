"""``affordance rank``: ranks tools and the ends to hold them by."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from affordance.arguments import check_whole
from affordance.belief.memory_file import read_memory
from affordance.choice.hammer import load_hammer
from affordance.choice.inner_simulation import TaskCostModel
from affordance.choice.ranking import Ranking
from affordance.choice.reach import Reach
from affordance.choice.which_end import (
    AFTER,
    BEFORE,
    ONE_DENSITY,
    build_beliefs,
    list_options,
    rank_grips,
)
from affordance.commands.options import add_seed, add_set, change_by_name, check_bounds, refuse_changes
from affordance.control.timed_path import load_path
from affordance.exceptions import AffordanceError, BadValueError, describe_choice
from affordance.files.constraints import Whole
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools, select_known
from affordance.objects.materials import MATERIALS, load_materials
from affordance.objects.tool import Tool
from affordance.simulation.holds import gain_experience

HELP = "rank tools and the ends to hold them by, for hammering, reaching or mashing, from meshes or pictures"
TASKS = ("hammer", "reach", "mash")
_BELIEFS = {
    BEFORE: "before any experience",
    AFTER: "after holding other things",
    ONE_DENSITY: "with one density for everything",
}
_SAMPLES, _HOLDS = Whole(1, 1_000_000), Whole(1, 100)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    workshop = MODELS / "workshop"
    parser.add_argument("task", choices=TASKS, help="drive a nail, reach with the free end, or mash with it")
    parser.add_argument(
        "--tools", type=Path, default=workshop / "tools.yaml", metavar="FILE", help="tools with grips (default: ours)"
    )
    parser.add_argument("--only", action="append", default=[], metavar="NAME", help="tools of it; more than once")
    parser.add_argument(
        "--meshes", type=Path, metavar="DIR", help="folder of the mesh files (default: folder of the tools file)"
    )
    parser.add_argument("--materials", type=Path, default=MATERIALS, metavar="FILE", help="materials (default: ours)")
    parser.add_argument(
        "--by", choices=("drawing", "pictures"), default="drawing", help="how their form is known (default: drawing)"
    )
    parser.add_argument(
        "--held",
        type=Path,
        default=workshop / "blanks.yaml",
        metavar="FILE",
        help="what was held before (default: ours)",
    )
    parser.add_argument("--holds", type=int, default=2, metavar="N", help="how often each of it was (default: 2)")
    parser.add_argument(
        "--memory",
        type=Path,
        metavar="FILE",
        help="densities learned before, as by identify --memory, in place of holding anything",
    )
    parser.add_argument("--samples", type=int, default=4000, metavar="N", help="densities drawn (default: 4000)")
    add_seed(parser)
    add_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Ranks the options, and prints a table for each of three beliefs.

    Raises:
        AffordanceError: An argument or a file is invalid, or a motion cannot be planned.
    """
    check_bounds(arguments)
    check_whole("--samples", arguments.samples, _SAMPLES)
    check_whole("--holds", arguments.holds, _HOLDS)
    refuse_changes(arguments, ["learner"], "what was held is learned about with one density for each colour")
    settings = change_by_name(arguments)
    materials = load_materials(arguments.materials)
    tools = choose_tools(load_tools(arguments.tools, materials, arguments.meshes), arguments.only, arguments.tools)
    held = load_tools(arguments.held, materials)
    titles = _BELIEFS
    if arguments.memory is None:
        experience = gain_experience(held, settings, holds=arguments.holds, seed=arguments.seed)
    else:
        experience = read_memory(arguments.memory)
        titles = {**_BELIEFS, AFTER: f"by the memory {arguments.memory.name}"}
    beliefs = build_beliefs(select_known(materials, [*tools, *held]), experience, settings)
    rankings = rank_grips(
        list_options(tools, by_sight=arguments.by == "pictures", seed=arguments.seed),
        load_task(arguments.task),
        {name: beliefs[name] for name in _BELIEFS},
        settings,
        seed=arguments.seed,
        num_samples=arguments.samples,
    )
    for name, ranking in rankings.items():
        print("\n".join(describe_ranking(titles[name], ranking)))
    return 0


def choose_tools(tools: Sequence[Tool], names: Sequence[str], path: Path) -> list[Tool]:
    """Selects tools by their names, all if no names are given.

    Raises:
        BadValueError: A name is unknown.
        AffordanceError: A tool has no grips.
    """
    known = {tool.name: tool for tool in tools}
    for name in names:
        if name not in known:
            raise BadValueError(path, "--only", describe_choice(name, list(known)))
    chosen = [known[name] for name in names] or list(tools)
    for tool in chosen:
        if not tool.grips:
            raise AffordanceError(f"{path}: {tool.name} has no grips, must name those it can be held by")
    return chosen


def load_task(name: str) -> TaskCostModel:
    """Loads a task by name from the models."""
    if name == "hammer":
        return load_hammer(MODELS / "nail.yaml")
    return Reach(load_path(MODELS / "paths" / f"{name}.yaml"))


def describe_ranking(title: str, ranking: Ranking) -> list[str]:
    """Formats a table of the options in order of preference."""
    width = max(len(f"{each.option.object_name}, {each.option.grip}") for each in ranking.ranked)
    lines = [f"{title}:", f"  {'':<{width}}  work (J)  P(best)  P(best of tool)  P(feasible)"]
    for each in ranking.ranked:
        name = f"{each.option.object_name}, {each.option.grip}"
        why = each.infeasible_reason
        numbers = f"{each.work:8.2f}  {each.p_best:7.2f}  {each.p_best_of_tool:15.2f}  {each.p_feasible:11.2f}"
        lines.append(f"  {name:<{width}}  {numbers}{f'  {why}' if why else ''}")
    if ranking.p_none > 0.0:
        lines.append(f"  with probability {ranking.p_none:.2f} no option is feasible")
    return lines
