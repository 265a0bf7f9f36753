"""``affordance study payload``: coverage of identified payloads on simulated recordings whose truth is known."""

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from affordance.commands.options import add_jobs, add_out, add_repeats, add_seed
from studies.payload.coverage import GROUPS, SHARES, CoverageConfig, run_load, tabulate
from studies.payload.errors import ARMS
from studies.study import Findings, Study, Work, add_only, print_table, run_kept


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 400, "simulated loads of each robot")
    add_only(parser, ARMS, "robots")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Plans the loads of each robot."""
    return partial(_work, arguments)


def _work(arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    numbers: dict[str, Any] = {}
    for arm in arguments.only or ARMS:
        found = run_kept(
            CoverageConfig(arm, arguments.seed),
            run_load,
            folder,
            [ARMS[arm].robot],
            repeats=arguments.repeats,
            jobs=arguments.jobs,
            description=f"payload: {arm}",
        )
        numbers[arm] = tabulate(found)
        _print_coverage(arm, numbers[arm])
        yield Findings(numbers, details=numbers)


def _print_coverage(arm: str, table: dict[str, Any]) -> None:
    """Prints coverage at 50, 80 and 90 % by level of each factor, a star where it is significantly low."""
    print(f"{arm}: {table['loads']} loads, {table['refused']} refused, {table['doubted']} doubted")
    rows = []
    for factor, levels in table["coverage"].items():
        for level, cells in levels.items():
            shown = [" ".join(f"{c['share']:.2f}{'*' * c['is_low']}" for c in cells[name]) for name in GROUPS]
            number = str(cells["mass"][0]["number"])
            rows.append(["all loads" if factor == "all" else f"{factor}: {level}", number, *shown])
    print_table([f"coverage at {', '.join(f'{s:g}' for s in SHARES)}", "loads", *GROUPS], rows)
    header = ["root mean square error", "mass (g)", "centre of mass (mm)"]
    print_table(
        header,
        [
            [f"{level}, {name}", f"{each['mass_g']:.0f}", " ".join(f"{x:.1f}" for x in each["com_mm"])]
            for level, of_level in table["rms"].items()
            for name, each in of_level.items()
        ],
    )


STUDY = Study("coverage of identified payloads on simulated recordings whose truth is known", add_arguments, plan)
