"""``affordance new-protocol NAME``: writes a commented protocol as a starting point."""

import argparse
import json
import re
from pathlib import Path

from affordance.exceptions import BadValueError
from affordance.files.atomic import write_text
from affordance.files.model_folder import MODELS
from affordance.protocols.protocol import FOLDER, Protocol, check_folder_is_free, load_protocol

SCHEMA_FILE = "protocol.schema.json"
# Commented template, and the placeholder of the protocol's name in it.
_TEMPLATE, _NAME = "template.yaml.txt", "NAME"


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


def build_schema() -> str:
    """Builds the JSON schema of protocols, as text."""
    return json.dumps(Protocol.model_json_schema(by_alias=True), indent=1) + "\n"


def write_protocol(name: str, folder: Path) -> tuple[Path, Path]:
    """Writes a commented, working protocol, and the schema; a wrong or existing name raises a BadValueError."""
    path, schema = folder / f"{name}.yaml", folder / SCHEMA_FILE
    if path.parent != folder:
        raise BadValueError(path, "name", f"is {name!r}, must be of small letters, digits and underscores")
    if path.exists():
        raise BadValueError(path, "", "exists already; give another name, or remove it")
    if not re.fullmatch("[a-z0-9_]+", name):
        near = re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")
        hint = f"; did you mean {near!r}?" if near else ""
        raise BadValueError(path, "name", f"is {name!r}, must be of small letters, digits and underscores{hint}")
    text = (MODELS / FOLDER / _TEMPLATE).read_text(encoding="utf-8")
    write_text(path, text.replace(_NAME, name))
    try:
        check_folder_is_free(load_protocol(path).name, path)
    except BadValueError:
        path.unlink()
        raise
    write_text(schema, build_schema())
    return path, schema
