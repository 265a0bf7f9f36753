"""``affordance new-tools FILE``: writes a tools file with comments, to be completed by the user."""

import argparse

from affordance.exceptions import BadValueError
from affordance.files.atomic import write_text
from affordance.files.model_folder import MODELS
from affordance.objects.materials import load_materials

_TEMPLATE = MODELS / "tools" / "template.yaml.txt"
# Placeholder of the materials in the template, and the number of materials per line.
_MATERIALS, _IN_A_LINE = "MATERIALS", 8


def run(arguments: argparse.Namespace) -> int:
    """Writes the file, and prints how to use it."""
    if arguments.file.exists():
        raise BadValueError(arguments.file, "", "exists already, must be a new file")
    if not arguments.file.parent.is_dir():
        raise BadValueError(
            arguments.file, "", f"must be in an existing folder, but {arguments.file.parent} does not exist"
        )
    names = list(load_materials())
    lines = [", ".join(names[k : k + _IN_A_LINE]) for k in range(0, len(names), _IN_A_LINE)]
    text = _TEMPLATE.read_text(encoding="utf-8").replace(_MATERIALS, ",\n#   ".join(lines))
    write_text(arguments.file, text)
    print(f"{arguments.file}: one tool, ready to be ranked; replace it with your own, then run:")
    print(f"affordance rank hammer --tools {arguments.file}")
    return 0
