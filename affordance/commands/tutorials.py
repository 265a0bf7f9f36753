"""``affordance tutorials``: copies the tutorials to a folder, and opens Jupyter there."""

import argparse
import importlib.util
import subprocess
import sys
from pathlib import Path

from affordance.commands.terminal import find_width
from affordance.files.atomic import write_text
from affordance.reporting.formatting import break_line
from affordance.runs.repeats import prepare_folder

TUTORIALS = Path(__file__).parents[1] / "tutorials"
# Programs of Jupyter, the newer program first.
_PROGRAMS = ("jupyterlab", "notebook")


def run(arguments: argparse.Namespace) -> int:
    """Copies tutorials to the folder, except those that it already contains, and opens Jupyter."""
    folder = prepare_folder(arguments.out)
    for path in sorted(TUTORIALS.glob("*.ipynb")):
        target = folder / path.name
        kept = target.exists()
        if not kept:
            write_text(target, path.read_text(encoding="utf-8"))
        print(f"{target}{': exists, not changed' if kept else ''}")
    program = next((each for each in _PROGRAMS if importlib.util.find_spec(each)), None)
    if program is None:
        print("\n".join(break_line("To open them: pip install jupyterlab, then run this again.", find_width())))
    elif not arguments.copy_only:
        return subprocess.call([sys.executable, "-m", program, str(folder)])
    return 0
