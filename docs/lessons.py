"""Outputs of lessons, which lessons keep: ``make lessons`` executes all lessons and writes their outputs anew."""

import argparse
import difflib
import os
import resource
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

from affordance.commands.tutorials import TUTORIALS
from affordance.files.atomic import write_text
from docs.quoted_outputs import ROOT, WIDTH, is_same

# Longest CPU time of a lesson, with the processes that it starts, [s].
_LONGEST = 60.0
_TEXTS, _PICTURE = ("text", "text/plain", "text/html"), "image/png"
_METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def execute(text: str) -> str:
    """Executes a notebook in an empty folder; returns it with its outputs, which name no folder of the machine."""
    notebook = nbformat.reads(text, as_version=4)  # type: ignore[no-untyped-call]
    environment = {  # commands of lessons are those of this environment
        "COLUMNS": str(WIDTH),
        "TQDM_DISABLE": "1",
        "PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]),
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
    }
    with tempfile.TemporaryDirectory() as folder:
        # What a command prints comes in pieces that end within lines; a loaded machine starts slowly and prints late.
        NotebookClient(
            notebook,
            timeout=None,
            startup_timeout=600,
            iopub_timeout=600,
            coalesce_streams=True,
            record_timing=False,
            extra_arguments=["--log-level=ERROR"],
            resources={"metadata": {"path": folder}},
        ).execute(env=os.environ | environment)
    notebook.metadata = _METADATA
    for number, cell in enumerate(notebook.cells, start=1):
        cell.id = f"cell-{number}"
    text = nbformat.writes(notebook)  # type: ignore[no-untyped-call]
    return f"{text}\n".replace(f"{folder}/", "").replace(f"{ROOT}/", "")


def list_lines(text: str, kinds: tuple[str, ...]) -> list[str]:
    """Lists the lines of a notebook's cells and of their outputs of some kinds."""
    lines = []
    for cell in nbformat.reads(text, as_version=4).cells:  # type: ignore[no-untyped-call]
        lines += cell.source.splitlines()
        for output in cell.get("outputs", []):
            shown = output.get("data", output)
            lines += [line for kind in kinds for line in shown.get(kind, "").splitlines()]
    return lines


def main() -> int:
    """Executes all lessons or those that are named, and writes their outputs; with --check, only compares texts."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("lessons", nargs="*", type=Path, help="lessons; all if none is named")
    parser.add_argument("--check", action="store_true", help="change nothing; exit status 1 if a text would change")
    chosen = parser.parse_args()
    failed = False
    for path in chosen.lessons or sorted(TUTORIALS.glob("*.ipynb")):
        before, began = path.read_text(encoding="utf-8"), _measure_children()
        after, took = execute(before), _measure_children() - began
        # Other versions of fonts draw other pictures.
        kinds = _TEXTS if chosen.check else (*_TEXTS, _PICTURE)
        old, new = list_lines(before, kinds), list_lines(after, kinds)
        is_kept, is_short = is_same("\n".join(old), "\n".join(new)), took <= _LONGEST
        print(f"{path.name}: {took:.0f} s of CPU time{'' if is_short else f', must take at most {_LONGEST:g} s'}")
        failed |= not (is_kept and is_short)
        if not is_kept and chosen.check:
            print("\n".join(difflib.unified_diff(old, new, path.name, path.name, "", "", 1, "")))
        elif not is_kept:
            write_text(path, after)
    return int(chosen.check and failed)


def _measure_children() -> float:
    """Measures the CPU time of all processes that were started and have ended, [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    sys.exit(main())
