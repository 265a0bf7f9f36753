"""``affordance tutorials``: copies the tutorials to a folder, and opens Jupyter there."""

import argparse
import importlib
import importlib.util
import re
import subprocess
import sys
from pathlib import Path

from affordance.commands.terminal import find_width
from affordance.files.atomic import write_text
from affordance.reporting.formatting import break_line
from affordance.runs.repeats import prepare_folder

TUTORIALS = Path(__file__).parents[1] / "tutorials"
# Jupyter's programs, the newer one first.
_PROGRAMS = ("jupyterlab", "notebook")


def run(arguments: argparse.Namespace) -> int:
    """Copies new tutorials to the folder, and opens Jupyter."""
    folder = prepare_folder(arguments.out)
    for path in sorted(TUTORIALS.glob("*.md")):
        text, suffix = convert(path.read_text(encoding="utf-8"))
        target = folder / f"{path.stem}{suffix}"
        kept = target.exists()
        if not kept:
            write_text(target, text)
        print(f"{target}{': exists, not changed' if kept else ''}")
    program = next((each for each in _PROGRAMS if importlib.util.find_spec(each)), None)
    if program is None:
        missing = ["jupyterlab", *([] if importlib.util.find_spec("jupytext") else ["jupytext"])]
        hint = (
            f"To open them as notebooks: pip install {' '.join(missing)}, then run this again; any editor shows them."
        )
        print("\n".join(break_line(hint, find_width())))
    elif not arguments.copy_only:
        return subprocess.call([sys.executable, "-m", program, str(folder)])
    return 0


def convert(text: str) -> tuple[str, str]:
    """Converts a Markdown tutorial to a notebook. Without jupytext it stays unchanged.

    Returns: Text and suffix of the file.
    """
    if not importlib.util.find_spec("jupytext"):
        return text, ".md"
    jupytext = importlib.import_module("jupytext")
    linked = re.sub(r"\((\d_\w+)\.md\)", r"(\1.ipynb)", text)
    return str(jupytext.writes(jupytext.reads(linked, fmt="md:myst"), fmt="ipynb")), ".ipynb"
