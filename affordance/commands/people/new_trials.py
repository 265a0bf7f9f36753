"""``affordance new-trials FILE``: writes a table of trials, optionally also for PsychoPy, jsPsych or BIDS."""

import argparse

from affordance.arguments import check_whole
from affordance.commands.options import check_bounds, open_robot
from affordance.commands.people.people_options import open_objects, open_table
from affordance.commands.setups import check_own_name
from affordance.exceptions import BadValueError
from affordance.extensions.people.experiments.designs import FORMATS
from affordance.extensions.people.experiments.new_trials import build_trials, describe_balance, parse_block
from affordance.extensions.people.experiments.trials import check_trials
from affordance.files.atomic import write_text
from affordance.files.constraints import Whole

# Default number of participants, and its bounds.
_PARTICIPANTS, _BOUND = 8, Whole(1, 10_000)


def run(arguments: argparse.Namespace) -> int:
    """Writes the table unless it exists, and a folder for each format. Reports if orders are balanced."""
    check_bounds(arguments)
    path, robot, lines = arguments.file, open_robot(arguments), []
    check_own_name(path)
    folders = {name: path.with_name(f"{path.stem}_{name}") for name in arguments.formats}
    for new in (*folders.values(), *([path] if arguments.block else [])):
        if new.exists():
            raise BadValueError(new, "", f"exists already, must be a new {'file' if new == path else 'folder'}")
    text = ""
    if arguments.block:
        tools, materials = open_objects(arguments, path, robot)
        participants = check_whole("--participants", arguments.participants or _PARTICIPANTS, _BOUND)
        groups, order = arguments.groups or ["all"], arguments.order or "latin"
        blocks = [parse_block(each, [tool.name for tool in tools], groups) for each in arguments.block]
        frame = build_trials(blocks, participants, groups=groups, order=order, seed=arguments.seed)
        table = check_trials(frame, tools, materials, name="--block")._replace(source=path)
        text = frame.to_csv(index=False, lineterminator="\n")
        lines += [
            f"{path}: {len(frame)} trials of {participants} participants. "
            + describe_balance(blocks, participants, groups, order)
        ]
    else:
        for option in ("participants", "groups", "order"):
            if getattr(arguments, option) is not None:
                raise BadValueError(f"--{option}", "", "is for a new table, must be given with --block")
        if not folders:
            problem = "is missing, must describe a block, such as 'learn: all x 5'; or --for writes out a table"
            raise BadValueError("--block", "", problem)
        table, _ = open_table(arguments, path, robot)
    lines += [FORMATS[name](table, folder) for name, folder in folders.items()]
    if text:
        write_text(path, text)
    print("\n".join(lines))
    return 0
