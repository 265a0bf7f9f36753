"""``affordance freeze TABLE``: freezes an experiment's plan for a preregistration, or checks it."""

import argparse

from affordance.commands.options import check_bounds, open_robot, read_changes
from affordance.commands.people.people_options import open_table, read_contrasts
from affordance.exceptions import BadValueError
from affordance.extensions.people.experiments.frozen_plan import check_plan, describe_plan
from affordance.extensions.people.participant import LiftSettings
from affordance.files.atomic import write_json
from affordance.named_settings import change_settings


def run(arguments: argparse.Namespace) -> int:
    """Writes the plan next to the table. With ``--check``, compares the table and its objects with the plan."""
    check_bounds(arguments)
    path = arguments.table.with_suffix(".plan.json")
    if arguments.check:
        plan = check_plan(path, arguments.table, arguments.objects)
        print(f"{arguments.table} and its objects are as frozen in {path}, SHA-256 {plan['sha256']}")
        return 0
    if path.exists():
        raise BadValueError(path, "", "exists already, must be a new file; --check compares with it")
    changes = read_changes(arguments)
    settings = change_settings(LiftSettings(), changes)
    table, _ = open_table(arguments, arguments.table, open_robot(arguments))
    changes.pop("learner", None)
    contrasts = [each.text for each in read_contrasts(arguments, table)]
    plan = describe_plan(table, arguments.objects, settings.learner, changes, contrasts, arguments.claim)
    write_json(path, plan)
    groups = ", ".join(f"{count} in group {name}" for name, count in plan["participants"].items())
    print(f"{path}: {plan['table']['trials']} trials, {groups}, learner {plan['learner']['name']}")
    print(f"SHA-256 of the plan, to register: {plan['sha256']}")
    return 0
