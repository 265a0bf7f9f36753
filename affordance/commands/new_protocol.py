"""``affordance new-protocol NAME``: writes a commented protocol as a starting point."""

import argparse
from pathlib import Path

from affordance.protocols.schema import write_protocol


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "name", help="small letters, digits and underscores; names the file and its folder of results"
    )
    parser.add_argument("--folder", type=Path, default=Path(), help="where to (default: here)")


def run(arguments: argparse.Namespace) -> int:
    """Writes the protocol and its schema."""
    path, schema = write_protocol(arguments.name, arguments.folder)
    print(f"{path}: protocol that runs as it is; {schema.name} in the same folder describes its keys to editors")
    print(f"affordance predict {path}")
    print(f"affordance run {path} --repeats 20")
    return 0
