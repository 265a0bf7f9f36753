"""Prints the answers and remarks of commands, and writes answers to the folder of ``--out``.

Standard output is either text or JSON. This module does not import Drake, so that small commands start quickly.
"""

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from affordance.exceptions import PROSE, show_text
from affordance.files.atomic import to_plain, write_json, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def tell(arguments: argparse.Namespace, remark: str) -> None:
    """Prints a remark, which is not part of the answer.

    With ``--json``, remarks are printed to standard error. With ``--quiet``, they are omitted.
    """
    if not getattr(arguments, "quiet", False):
        print(remark, file=sys.stderr if getattr(arguments, "json", False) else sys.stdout, flush=True)


def print_answer(arguments: argparse.Namespace, text: str, content: Any) -> None:
    """Prints an answer as text, or its content as JSON if ``--json`` is given."""
    print(json.dumps(to_plain(content), indent=2) if arguments.json else text)


def give_answer(
    arguments: argparse.Namespace,
    name: str,
    text: str,
    content: Mapping[str, Any],
    draw: "Callable[[], Figure] | None" = None,
) -> None:
    """Prints an answer, and writes it as text, JSON and an optional figure to the folder of ``--out``."""
    text = show_text(text, PROSE)
    if arguments.out is not None:
        write_text(arguments.out / f"{name}.txt", text + "\n")
        write_json(arguments.out / f"{name}.json", content)
        if draw is not None:
            # Imported here, so that runs without --out start faster.
            from affordance.reporting.figures import save_figure

            save_figure(draw(), arguments.out, name)
    print_answer(arguments, text, content)
