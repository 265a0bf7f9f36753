"""``affordance next``: says what to hold next before tools are chosen, what it is worth, and when to stop."""

import argparse
import json
from pathlib import Path

from affordance.arguments import check_number, check_whole
from affordance.belief.object_belief import FeltObject
from affordance.choice.demand import Criterion
from affordance.choice.next_hold import HoldAdvice, Question, advise_hold
from affordance.choice.pricing import plan_options
from affordance.choice.tool_options import list_tool_options
from affordance.commands.options import (
    add_choice,
    change_by_name,
    check_bounds,
    choose_tools,
    parse_same_colours,
    read_options,
    recall,
)
from affordance.exceptions import name_object
from affordance.files.atomic import to_plain, write_json, write_text
from affordance.files.constraints import Whole
from affordance.files.model_folder import MODELS
from affordance.memory.ledger import open_memory
from affordance.memory.summary import recall_felt
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials
from affordance.reporting.figures import save_figure
from affordance.reporting.hold_figure import draw_holds
from affordance.robots.kept import open_robot
from affordance.settings import Settings

_SAMPLES = Whole(100, 1_000_000)
_USES_MAX, _PRICE_MAX = 1e9, 1e9
_NAME = "next"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("tasks", nargs="+", metavar="TASK", help="tasks of the robot that are to be done: hammer, reach, ...")
    add(
        "--may-hold",
        type=Path,
        default=MODELS / "workshop" / "blanks.yaml",
        metavar="FILE",
        help="objects that may be held first (default: our pieces of stock)",
    )
    add("--include-tools", action="store_true", help="the tools themselves may be held too")
    add("--see", choices=("drawing", "pictures"), default="drawing", help="how the tools' form is known")
    add("--by", choices=[each.value for each in Criterion], help="what is compared (default: as rank)")
    add("--uses", type=float, default=1.0, metavar="N", help="times that each task is to be done (default 1)")
    add(
        "--price",
        type=float,
        default=0.0,
        metavar="COST",
        help="price of a hold, in the unit of the cost (default 0)",
    )
    add("--samples", type=int, default=4000, metavar="N", help="samples of the belief (default 4000)")
    add_choice(parser, _NAME)


def run(arguments: argparse.Namespace) -> int:
    """Prints what to hold next, and writes it with a picture if there is a folder for it."""
    check_bounds(arguments)
    check_whole("--samples", arguments.samples, _SAMPLES)
    check_number("--uses", arguments.uses, 1e-6, _USES_MAX)
    check_number("--price", arguments.price, 0.0, _PRICE_MAX)
    robot = open_robot(arguments.robot, read_options(arguments), (arguments.out or Path("results")) / "arms")
    settings = change_by_name(arguments, Settings(arm=robot.directives))
    criterion = Criterion(arguments.by or (Criterion.WORK if robot.is_default else Criterion.GRIP))
    materials = load_materials(arguments.materials or robot.folder / MATERIALS.name)
    tools = choose_tools(load_tools(arguments.tools, materials, arguments.meshes), arguments.only, arguments.tools)
    held = load_tools(arguments.may_hold, materials)
    candidates = [*held, *(tools if arguments.include_tools else [])]
    same_colours = parse_same_colours(arguments.same_colour)
    memory = recall(arguments.memory, settings, same_colours)
    felt = _recall_felt(arguments.memory, settings)
    options = list_tool_options(tools, by_sight=arguments.see == "pictures", seed=arguments.seed)
    tasks = list(dict.fromkeys(arguments.tasks))
    questions = [Question(t, plan_options(options, robot.load_task(t), settings), arguments.uses) for t in tasks]
    advice = advise_hold(
        candidates,
        questions,
        memory,
        settings,
        criterion=criterion,
        price=arguments.price,
        felt=felt,
        num_samples=arguments.samples,
        seed=arguments.seed,
    )
    sentence = describe_stop(advice)
    content = {
        **advice._asdict(),
        "ranked": [each._asdict() for each in advice.ranked],
        "decisions": [each._asdict() for each in advice.decisions],
        "rests_on": advice.rests_on,
        "sentence": sentence,
    }
    text = "\n".join([*tabulate(advice, arguments.uses), sentence])
    if arguments.out is not None:
        write_text(arguments.out / f"{_NAME}.txt", text + "\n")
        write_json(arguments.out / f"{_NAME}.json", content)
        figure = draw_holds(
            [each.name for each in advice.ranked],
            [(each.worth, each.worth_se) for each in advice.ranked],
            [
                (task.name, task.p_best, [each.p_best_after[k] for each in advice.ranked])
                for k, task in enumerate(advice.decisions)
            ],
            unit=advice.unit,
            title=sentence,
        )
        save_figure(figure, arguments.out, _NAME)
    print(json.dumps(to_plain(content), indent=2) if arguments.json else text)
    return 0


def tabulate(advice: HoldAdvice, uses: float) -> list[str]:
    """Formats the decisions as they stand, and what may be held."""
    unit = advice.unit
    lines = [
        f"{each.name}: take {name_object(each.best)}, best with probability {each.p_best:.2f}; "
        f"expected loss {each.regret:.3g} {unit}"
        for each in advice.decisions
    ]
    width = max(len(each.name) for each in advice.ranked)
    times = "a use of each" if uses == 1.0 else f"{uses:g} uses of each"
    lines.append(f"{'':<{width}}  worth, {times} ({unit})  information (nat)  P(best) then")
    for each in advice.ranked:
        worth = f"{each.worth:9.3g} ± {each.worth_se:<8.2g}"
        then = ", ".join(f"{p:.2f}" for p in each.p_best_after)
        lines.append(f"{each.name:<{width}}  {worth:>24}  {each.information:17.2f}  {then}")
    return lines


def describe_stop(advice: HoldAdvice) -> str:
    """Says in words what to hold next, or why to stop."""
    first, unit = advice.ranked[0], advice.unit
    rests = ", and ".join(
        f"the choice for {each.name} rests on {name_object(name)} alone"
        for each in advice.decisions
        for name in each.rests_on
    )
    if advice.check:
        return f"Hold {name_object(advice.check)} to check: {rests}."
    found = f" But {rests}: holding another of its material would check it." if rests else ""
    if advice.stop == "certain":
        return f"Nothing more needs to be held: every choice is certain.{found}"
    if advice.stop:
        worst = min(advice.decisions, key=lambda each: each.p_best)
        tie = f"P = {worst.p_best:.2f} of {worst.name} is a tie worth {worst.regret:.2g} {unit}"
        return f"Nothing here is worth holding: {first.name} is worth {first.worth:.2g} {unit}; {tie}.{found}"
    if advice.pair is not None:
        one, other = (name_object(each) for each in advice.pair)
        return f"Hold {one} and then {other}: worth {advice.pair_worth:.3g} {unit} together, and little alone."
    return f"Hold {name_object(first.name)} next: worth {first.worth:.3g} ± {first.worth_se:.1g} {unit}."


def _recall_felt(place: str | None, settings: Settings) -> dict[str, FeltObject]:
    """Recalls what was told by each thing that was held; nothing without a memory."""
    if place is None:
        return {}
    with open_memory(place, create=False) as ledger:
        return recall_felt(ledger, settings.prior)
