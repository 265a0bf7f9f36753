"""``affordance study speed``: compares the program's speed with other libraries and with brute force."""

import argparse
import importlib.metadata
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from affordance.belief.learners import LEARNERS
from affordance.commands.options import add_out
from affordance.files.atomic import write_text
from affordance.runs.repeats import list_versions
from studies.study import Findings, Study, Task, Work, add_only, format_table, import_part, print_table

# Modules that measure ratios, in the order in which they are reported.
MEASURED = ("closed_loop", "mpc_tick", "regressor", "decision", "strike", "observers")
_PEERS = ("pin",)
HOW = {
    "loop_vs_cpp_hold": "wall time of the same plant under a C++ controller divided by that of the closed loop, all "
    "five trials",
    "loop_realtime_factor": "simulated seconds of the closed loop per second of wall time on one core",
    "mpc_tick_vs_algebra": "time of a control period, no limit active, divided by that of the closed form factorised "
    "in every period",
    "mpc_tick_vs_kept_algebra": "the same divided by the time of the closed form with a stored inverse, one product",
    "mpc_tick_vs_drake_solver": "the same divided by the time of the plan alone with Drake's equality-constrained "
    "solver on a stored program",
    "mpc_limits_vs_osqp": "time of a control period with limits active divided by that of OSQP at 1e-6 on a stored "
    "program",
    "regressor_vs_pinocchio": "time for 300 samples divided by that of Pinocchio's C++ regressor in a loop",
    "decisions_vs_rollouts": "choices of a grip for reaching per second by inner simulation, 10,000 with their "
    "planning, divided by those by simulating both grips",
    "decisions_vs_blows": "the same for hammering, with simulated contact",
    **{
        f"observers_at_once_{name}": "time of lifts of 1,000 observers one by one divided by that as arrays, "
        f"{each.label}"
        for name, each in LEARNERS.items()
    },
    "strike_wall_s": "seconds that one core takes for the 55 ms in which tool and nail may touch, median of 24 blows",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_only(parser, MEASURED, "tables, which are printed and not written")
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work | Task:
    """Imports the peers, and plans all measurements, or only chosen tables, which are printed."""
    names = arguments.only or MEASURED
    parts = [import_part(f"studies.speed.{name}") for name in names]
    if not arguments.only:
        return partial(_measure, parts)

    def print_tables() -> int:
        for part in parts:
            print_table(part.HEADER, part.measure()[0])
        return 0

    return Task(print_tables)


def _measure(parts: Sequence[Any], folder: Path) -> Iterator[Findings]:
    tables: list[str] = []
    ratios: dict[str, float] = {}
    for part in parts:
        rows, found = part.measure()
        tables.append(print_table(part.HEADER, rows))
        ratios |= found
    versions = {**list_versions(), **{name: importlib.metadata.version(name) for name in _PEERS}}
    rows = [[name, f"{value:.3g}", HOW[name]] for name, value in ratios.items()]
    summary = format_table(["ratio", "value", "what it is"], rows)
    measured_with = ", ".join(f"{name} {version}" for name, version in versions.items())
    print(f"{summary}\n\n{measured_with}")
    text = "\n\n".join([summary, measured_with, *tables]) + "\n"
    numbers = {**ratios, "how": HOW, "versions": versions}
    yield Findings(numbers, writers=(lambda folder: write_text(folder / "tables.md", text),))


STUDY = Study(
    "how fast the program is, compared with other libraries and brute force",
    add_arguments,
    plan,
    folder="benchmarks",
    on_one_thread=True,
)
