"""``affordance new-experiment NAME``: writes an example experiment that the user can change."""

import argparse
import inspect

from affordance.commands.setups import check_own_name
from affordance.exceptions import BadValueError
from affordance.extensions.people.experiments import starting_point
from affordance.files.atomic import write_text


def run(arguments: argparse.Namespace) -> int:
    """Writes the file, which must not exist yet, and prints how to run it."""
    name = arguments.name.removesuffix(".py")
    path = arguments.out / f"{name}.py"
    if not name.isidentifier():
        raise BadValueError("name", "", f"is {arguments.name!r}, must be letters, digits and '_', a letter first")
    check_own_name(path)
    if path.exists():
        raise BadValueError(path, "", "exists already, must be a new file")
    source = inspect.getsource(starting_point)
    write_text(path, source.replace(starting_point.NAME, name).replace("FILE", str(path)))
    print(f"{path}: change it as you like, then run it: affordance run {path}")
    return 0
