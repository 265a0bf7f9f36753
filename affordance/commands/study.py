"""``affordance study``: lists the studies in the repository. Each study is a subcommand."""

import argparse
import json

from affordance.commands.terminal import find_width
from affordance.files.model_folder import import_study, list_studies


def run(arguments: argparse.Namespace) -> int:
    """Prints one line for each study."""
    studies = {name: import_study(name).HELP for name in list_studies()}
    if arguments.json:
        print(json.dumps(studies, indent=2))
    elif not studies:
        print("There are no studies here: they need a clone of the repository.")
    else:
        # Imported here, because --help does not need it.
        from affordance.reporting.formatting import tabulate

        rows = [[f"  affordance study {name}", text] for name, text in studies.items()]
        print("\n".join(tabulate(rows, width=find_width())))
    return 0
