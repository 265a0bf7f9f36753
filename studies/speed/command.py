"""``affordance study speed``: measures speed against peers and brute force, and makes the tables of decisions."""

import argparse
import importlib.metadata
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from affordance.commands.options import add_jobs, add_out
from affordance.exceptions import BadValueError
from affordance.files.atomic import write_text
from affordance.runs.repeats import list_versions
from studies.study import Findings, Study, Task, Work, add_only, format_table, import_part, print_table

# Modules that measure ratios, in order, and modules with a table of a decision each, which are run on demand only.
MEASURED = ("closed_loop", "mpc_tick", "regressor", "decision", "strike")
TABLES = ("convergence", "estimator_study", "inner_vs_full", "program_every_tick", "stiff_arms", "strike_tables")
# Options of these modules.
_OPTIONS = {"inner_vs_full": ("beliefs", "crooked", "jobs"), "stiff_arms": ("arms",)}
_PEERS = ("pin",)
HOW = {
    "loop_vs_cpp_hold": "wall time of the same plant under a C++ hold over that of the closed loop, all five trials",
    "loop_realtime_factor": "simulated seconds of the closed loop per second of wall time on one core",
    "mpc_tick_vs_algebra": "time of a tick, no limit active, over that of the closed form factorised at every tick",
    "mpc_tick_vs_kept_algebra": "the same over the closed form with its inverse kept, one matrix product",
    "mpc_tick_vs_drake_solver": "the same over the plan alone by Drake's equality-constrained solver, program kept",
    "mpc_limits_vs_osqp": "time of a tick with limits active over that of OSQP at 1e-6 on a kept program",
    "regressor_vs_pinocchio": "time for 300 samples over that of Pinocchio's C++ regressor in a loop",
    "decisions_vs_rollouts": "choices of a grip for reaching per second by inner simulation, 10,000 with their "
    "planning, over those by simulating both grips",
    "decisions_vs_blows": "the same for hammering, contact simulated",
    "strike_wall_s": "seconds that one core takes for the 55 ms in which tool and nail may touch, median of 24 blows",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add_only(parser, (*MEASURED, *TABLES), f"tables, which are printed; those from {TABLES[0]} on only if named")
    add("--arms", nargs="+", type=Path, default=[], metavar="DIR", help="for stiff_arms: folders of import-arm")
    add("--beliefs", type=int, default=10, metavar="N", help="for inner_vs_full: beliefs for each tool and task")
    add("--crooked", type=int, default=20, metavar="N", help="for inner_vs_full: tools that are drawn")
    add_jobs(parser, 2)
    add_out(parser)
    compare = "print the numbers in which two folders of results differ; keys that were renamed follow as OLD=NEW"
    add("--compare", nargs="+", metavar="DIR", help=compare)


def plan(arguments: argparse.Namespace) -> Work | Task:
    """Imports the peers, and plans all measurements, or tables that are printed."""
    if arguments.compare is not None:
        if len(arguments.compare) < 2:
            raise BadValueError("--compare", "", "must be two folders of results")
        return Task(partial(import_part("studies.speed.compare_results").compare_results, *arguments.compare))
    if "stiff_arms" in arguments.only and not arguments.arms:
        raise BadValueError("--arms", "", "is missing, must be folders that import-arm wrote")
    if arguments.only:
        return Task(partial(_print_tables, arguments))
    for name in MEASURED:
        import_part(f"studies.speed.{name}")
    return _measure


def _print_tables(arguments: argparse.Namespace) -> int:
    for name in arguments.only:
        part = import_part(f"studies.speed.{name}")
        options = {option: getattr(arguments, option) for option in _OPTIONS.get(name, ())}
        measured = part.measure(**options)
        print_table(part.HEADER, measured[0] if name in MEASURED else measured)
    return 0


def _measure(folder: Path) -> Iterator[Findings]:
    tables: list[str] = []
    ratios: dict[str, float] = {}
    for name in MEASURED:
        part = import_part(f"studies.speed.{name}")
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
    "how fast the program is, against peers and brute force, and the tables of decisions on accuracy and speed",
    add_arguments,
    plan,
    folder="benchmarks",
    on_one_thread=True,
)
