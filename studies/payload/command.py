"""``affordance study payload``: tests how accurate identified payloads and their intervals are.

Without options, simulated loads with known truth are identified. With ``--data``, published recordings are read: a
UR10e with a weighed load, and a Panda whose torques are combined with torques of simulated payloads.
"""

import argparse
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from affordance.arguments import REPEATS, check_whole
from affordance.arrays import Array
from affordance.commands.arguments import add_jobs, add_out, add_repeats, add_seed
from affordance.extensions.payload.settings import IdentificationSettings
from studies.payload.at_rest import AT_REST, WRIST
from studies.payload.clones import UR10E_LOAD, PandaData, Ur10eData, load_panda, load_ur10e
from studies.payload.coverage import CHANGES, GROUPS, SHARES, CoverageConfig, run_changes, run_load, tabulate
from studies.payload.errors import ARMS
from studies.payload.panda import study_panda
from studies.payload.ur10e import study_ur10e
from studies.study import Findings, Study, Work, add_only, format_table, run_kept

# Robots whose signals change only in the loaded run, for each case.
_OF_CHANGES = {"panda_changes": "panda", "ur_changes": "ur"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 400, "simulated loads of each robot; not used with --data")
    what = "identify loads in recordings instead; folder with the clones, named like the repositories"
    parser.add_argument("--data", type=Path, metavar="DIR", help=what)
    what = "number of payloads for each length of window, with --data (default 200)"
    parser.add_argument("--injections", type=int, default=200, metavar="N", help=what)
    add_only(parser, (*ARMS, *AT_REST, *_OF_CHANGES), "robots or cases")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Plans the simulated loads, or reads all recordings so that a missing clone is reported at once."""
    check_whole("--injections", arguments.injections, REPEATS)
    if arguments.data is None:
        return partial(_simulate, arguments)
    return partial(_read, arguments, load_ur10e(arguments.data), load_panda(arguments.data))


def _simulate(arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    numbers: dict[str, Any] = {}
    for name in arguments.only or (*ARMS, *AT_REST, *_OF_CHANGES):
        run = run_kept(
            CoverageConfig(_OF_CHANGES.get(name, name), arguments.seed),
            run_changes if name in _OF_CHANGES else run_load,
            folder,
            [WRIST[0], *(errors.robot for errors in ARMS.values())],
            repeats=arguments.repeats,
            jobs=arguments.jobs,
            description=f"payload: {name}",
        )
        if name in _OF_CHANGES:
            numbers[name] = _print_changes(name, run["doubted"])
        else:
            numbers[name] = tabulate(run)
            _print_coverage(name, numbers[name])
        yield Findings(numbers)


def _read(arguments: argparse.Namespace, pair: Ur10eData, panda: PandaData, folder: Path) -> Iterator[Findings]:
    settings = IdentificationSettings(seed=arguments.seed)
    numbers = {"ur10e": study_ur10e(pair, settings)}
    _print_table(
        [f"UR10e, load of {UR10E_LOAD:g} kg, analysed with", "mass (kg)", "SD (g)"], _list_ur10e(numbers["ur10e"])
    )
    numbers["panda"] = study_panda(panda, settings, num_injections=arguments.injections, seed=arguments.seed)
    header = [
        "Panda, windows of (s)",
        "stretches",
        "90 % coverage: mass (range over stretches)",
        "centre of mass",
        "moments",
        "RMS error (g)",
        "SD (g)",
    ]
    _print_table(header, [_list_panda(name, found) for name, found in numbers["panda"].items()])
    yield Findings({**numbers, "injections": arguments.injections, "seed": arguments.seed})


def _list_ur10e(n: Mapping[str, Any]) -> list[list[str]]:
    rows = [
        ("gains from the second half, mass of the first", n["half_mass_kg"][0], n["half_sd_kg"][0]),
        ("gains from the first half, mass of the second", n["half_mass_kg"][1], n["half_sd_kg"][1]),
        ("an arm fitted to the empty run, gains from the pair", n["unpaired_mass_kg"], n["unpaired_mass_sd_kg"]),
        ("gains from the arm's weight in its file", n["by_arm_weight_mass_kg"], n["by_arm_weight_mass_sd_kg"]),
    ]
    return [[name, f"{mass:.3f}", f"{1e3 * sd:.0f}"] for name, mass, sd in rows]


def _list_panda(name: str, found: Mapping[str, Any]) -> list[str]:
    white = f"{name.removeprefix('white_')}, errors taken for white" if name.startswith("white_") else name
    cells = [
        f"{found[key]:{form}} ({low:{form}} to {high:{form}})"
        for key, (low, high) in found["range_of_stretches"].items()
        for form in [".0f" if key.endswith("_g") else ".2f"]
    ]
    return [white, str(found["stretches"]), *cells]


def _print_coverage(name: str, table: dict[str, Any]) -> None:
    """Prints coverage at 50, 80 and 90 % for each level of each factor. A star marks a significantly low coverage."""
    print(f"{name}: {table['loads']} loads, {table['refused']} refused, {table['doubted']} doubted")
    rows = []
    for factor, levels in table["coverage"].items():
        for level, cells in levels.items():
            shown = [" ".join(f"{c['share']:.2f}{'*' * c['is_low']}" for c in cells[group]) for group in GROUPS]
            number = str(cells["mass"][0]["number"])
            rows.append(["all loads" if factor == "all" else f"{factor}: {level}", number, *shown])
    of_all = name in AT_REST  # without motion, the other levels are uninformative
    _print_table(
        [f"coverage at {', '.join(f'{s:g}' for s in SHARES)}", "loads", *GROUPS], rows[: 1 if of_all else None]
    )
    rows = [
        [f"{level}, {what}", f"{each['mass_g']:.0f}", " ".join(f"{x:.1f}" for x in each["com_mm"])]
        for level, of_level in table["rms"].items()
        for what, each in of_level.items()
    ]
    header = ["root mean square error", "mass (g)", "centre of mass (mm)"]
    _print_table(header, rows[: 2 if of_all else None])


def _print_changes(name: str, doubted: Array) -> dict[str, float]:
    """Prints the share of doubted loads for each change of signals in the loaded run.

    ``doubted`` has shape (loads, changes).

    Returns: The shares.
    """
    shares = {f"{change:g}": float(share) for change, share in zip(CHANGES, doubted.mean(axis=0), strict=True)}
    rows = [[f"x {change}", f"{share:.2f}"] for change, share in shares.items()]
    _print_table([f"{name}: signals of the loaded run", f"doubted, of {len(doubted)} loads"], rows)
    return shares


def _print_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    print(f"{format_table(header, rows)}\n", flush=True)


STUDY = Study("coverage and errors of identified payloads, simulated or in published recordings", add_arguments, plan)
