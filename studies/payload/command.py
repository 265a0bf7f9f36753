"""``affordance study payload``: coverage and mistakes on simulated payloads, or methods and mistakes on recordings.

With ``--data`` it compares other methods on the development recordings, and measures how large a mistake can be
without being noticed.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from affordance.arguments import check_whole
from affordance.commands.options import add_jobs, add_out, add_repeats, add_seed
from affordance.files.constraints import Whole
from affordance.identification.identify import Runs, identify
from affordance.identification.settings import DEFAULT_SETTINGS
from studies.payload.coverage import GROUPS, SHARES, CoverageConfig, run_load, tabulate
from studies.payload.errors import ARMS
from studies.payload.mistakes import list_rows as list_mistakes
from studies.payload.mistakes import measure_blind_bands
from studies.payload.peers import compare
from studies.payload.peers import list_rows as list_peers
from studies.payload.simulated_mistakes import MistakesConfig, list_mistake_rows, run_mistakes, tabulate_mistakes
from studies.recorded.clones import UR10E_LOAD, load_ur10e
from studies.recorded.mistake_outcomes import Case
from studies.study import Findings, Study, Work, add_only, print_table, run_kept

_NUM_WINDOWS = 100  # number of payloads injected into windows of the Panda's recording
_MOST_PAIRS = Whole(0, 10_000)
_FEW = 2000  # number of samples that is enough for a verdict


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 400, "simulated loads of each robot; not used with --data")
    what = "number of simulated pairs of each robot in which mistakes are made; not used with --data (default 8)"
    parser.add_argument("--mistakes", type=int, default=8, metavar="N", help=what)
    what = "folder with clones, as for study recorded: compare methods and make mistakes in these recordings instead"
    parser.add_argument("--data", type=Path, metavar="DIR", help=what)
    add_only(parser, ARMS, "robots")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Plans the simulated loads of each robot, or the comparison on recordings."""
    check_whole("--mistakes", arguments.mistakes, _MOST_PAIRS)
    return partial(_work if arguments.data is None else _compare, arguments)


def _compare(arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    """Compares methods on recordings, then makes mistakes in the UR10e's pair."""
    peers = compare(arguments.data, _NUM_WINDOWS, arguments.seed)
    header = ["recording", "method", "rms error (g)", "stated 90 % (g)", "inside", "CPU (s)"]
    print_table(header, list_peers(peers))
    recorded = load_ur10e(arguments.data)
    settings = replace(DEFAULT_SETTINGS, num_samples=_FEW, seed=arguments.seed)
    runs = Runs(recorded.loaded, (recorded.empty,))
    gains = identify(recorded.robot, runs, reference_mass=UR10E_LOAD, settings=settings).calibration
    case = Case(recorded.robot, recorded.empty, recorded.loaded, UR10E_LOAD, gains=gains)
    mistakes = measure_blind_bands(case, settings)
    header = ["mistake", "unnoticed sizes", "largest effect: size, mass", "noticed from size"]
    print_table(header, list_mistakes(mistakes))
    numbers = {"peers": peers, "mistakes": mistakes}
    yield Findings(numbers, details=numbers)


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
        if arguments.mistakes:
            made = run_kept(
                MistakesConfig(arm, arguments.seed),
                run_mistakes,
                folder,
                [ARMS[arm].robot],
                repeats=arguments.mistakes,
                jobs=arguments.jobs,
                description=f"payload: mistakes, {arm}",
            )
            numbers[arm]["mistakes"] = tabulate_mistakes(made)
            header = ["mistake", "size", "unnoticed", "median effect on the mass if unnoticed"]
            print_table(header, list_mistake_rows(numbers[arm]["mistakes"]))
        yield Findings(numbers, details=numbers)


def _print_coverage(arm: str, table: dict[str, Any]) -> None:
    """Prints coverage at 50, 80 and 90 % for each level of each factor; a star marks a significantly low coverage."""
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
