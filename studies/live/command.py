"""``affordance study live``: identifies loads that two simulated robots pick up, live.

Each pick-up takes about ten seconds of one core, or half a minute over the wire. MuJoCo and cyclonedds are needed.
"""

import argparse
import importlib.util
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.commands.arguments import add_jobs, add_out, add_repeats, add_seed
from affordance.exceptions import BadValueError
from affordance.extensions.payload.live import foreign_robot
from studies.live.pickups import WAYS, WIRE, PickupConfig, run_constant, run_pickup
from studies.study import Findings, Study, Work, add_only, format_table, run_kept

_PER_MINUTE = 10  # number of pick-ups per minute of constant load
_PER_WIRE = 5  # number of other pick-ups per pick-up over the wire
_MOST_DOMAINS = 3  # largest number of simultaneous pick-ups over the wire
_CASES = {f"{arm} {way}": (arm, way) for arm in foreign_robot.ARMS for way in WAYS}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 100, "pick-ups of each arm, over the wire a fifth as many")
    add_only(parser, _CASES, "arms and streams")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Plans the pick-ups.

    Raises:
        BadValueError: A library is missing.
    """
    over_wire = any(_CASES[case][1] == WIRE for case in arguments.only or _CASES)
    if over_wire and importlib.util.find_spec("cyclonedds") is None:
        raise BadValueError("--only", "", f"names {WIRE}, which needs the library cyclonedds: pip install cyclonedds")
    return partial(_follow, arguments)


def _follow(arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    # Missing cases are None, which pages show as a dash.
    numbers: dict[str, Any] = {"seed": arguments.seed, **dict.fromkeys(case.replace(" ", "_") for case in _CASES)}
    model = Path(foreign_robot.__file__)
    for case in arguments.only or _CASES:
        config = PickupConfig(*_CASES[case], arguments.seed)
        over_wire = config.way == WIRE
        repeats, jobs, constant = arguments.repeats, arguments.jobs, None
        if over_wire:
            repeats, jobs = max(1, repeats // _PER_WIRE), min(jobs, _MOST_DOMAINS)
        keep = partial(run_kept, config, models=model, jobs=jobs)
        found = keep(run_pickup, folder=folder, repeats=repeats, description=f"live: {case}")
        if not over_wire:
            minutes, what = max(1, repeats // _PER_MINUTE), f"live: {case}, constant"
            constant = keep(run_constant, folder=folder / "constant", repeats=minutes, description=what)
        numbers[case.replace(" ", "_")] = tabulate(found, constant)
        print(f"{format_table([case, ''], list_rows(numbers[case.replace(' ', '_')]))}\n", flush=True)
        yield Findings(numbers)


def tabulate(found: Mapping[str, NDArray[Any]], constant: Mapping[str, NDArray[Any]] | None) -> dict[str, Any]:
    """Summarises pick-ups and minutes of constant load. The latter are None over the wire.

    Delays are in s, errors are relative or in mm.
    """
    delay, last, final = found["delay"], found["last"], found["final"]
    known, given = np.isfinite(last[:, 0]), np.isfinite(final[:, 0])
    error = last[known, 0] / found["mass"][known] - 1.0
    trusted = given & (final[:, 3] == 1.0)
    return {
        "pickups": len(delay),
        "noticed": int(np.isfinite(delay[:, 0]).sum()),
        "put_noticed": int(np.isfinite(found["put"]).sum()),
        **{
            f"{name}_s": _take_quantiles(delay[:, i])
            for i, name in enumerate(("noticed", "named", "five_percent", "enough"))
        },
        "beliefs": int(found["beliefs"][:, 0].sum()),
        "beliefs_inside": int(found["beliefs"][:, 1].sum()),
        "last": int(known.sum()),
        "last_inside": int(last[known, 2].sum()),
        "rms_mass_share": _take_rms(error),
        "rms_com_mm": [_take_rms(1e3 * each) for each in found["com"].T],
        "finals": int(given.sum()),
        "finals_trusted": int(trusted.sum()),
        "trusted_inside": int(final[trusted, 2].sum()),
        "agreement_rms_sd": _take_rms(found["agreement"]),
        "false_changes": int(found["false"].sum()),
        **(_tabulate_wire(found["wire"]) if constant is None else _tabulate_load(found["milliseconds"], constant)),
    }


def _tabulate_wire(wire: NDArray[Any]) -> dict[str, int]:
    names = ("sent", "received", "unused", "left_out")
    return {name: int(number) for name, number in zip(names, wire.sum(axis=0), strict=True)}


def _tabulate_load(milliseconds: NDArray[Any], constant: Mapping[str, NDArray[Any]]) -> dict[str, float]:
    return {
        "constant_minutes": float(constant["seconds"].sum() / 60.0),
        "constant_false_changes": int(constant["false"].sum()),
        "sample_ms": float(milliseconds[:, 0].mean()),
        "belief_ms": float(milliseconds[:, 1].mean()),
    }


def _take_quantiles(delays: NDArray[Any]) -> list[float | None]:
    """Computes number, median and maximum of delays. Median and maximum are None without delays."""
    there = delays[np.isfinite(delays)]
    return [float(len(there)), *((float(np.median(there)), float(there.max())) if len(there) else (None, None))]


def _take_rms(errors: NDArray[Any]) -> float | None:
    """Computes the root mean square of the finite errors; None without any."""
    there = errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(there**2))) if len(there) else None


def _format(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


def list_rows(n: Mapping[str, Any]) -> list[list[str]]:
    """Lists the rows of the printed table."""

    def show(name: str) -> str:
        number, *times = n[f"{name}_s"]
        return f"{', '.join(_format(x, '.1f') for x in times)} s in {number:.0f} of {n['pickups']}"

    return [
        ["noticed after (median, largest)", show("noticed")],
        ["named after", show("named")],
        ["SD of the mass below 5 % after", show("five_percent")],
        ["enough after", show("enough")],
        ["90 % interval holds the mass, last belief", f"{n['last_inside']} of {n['last']}"],
        ["the same, all beliefs", f"{n['beliefs_inside']} of {n['beliefs']}"],
        ["error of the mass (RMS)", _format(n["rms_mass_share"], ".1%").replace("%", " %")],
        ["error of the centre of mass (RMS)", f"{', '.join(_format(x, '.0f') for x in n['rms_com_mm'])} mm"],
        ["final answers, of these trusted", f"{n['finals']}, {n['finals_trusted']}"],
        ["trusted and 90 % interval holds the mass", f"{n['trusted_inside']} of {n['finals_trusted']}"],
        ["belief less final answer (RMS, SDs)", _format(n["agreement_rms_sd"], ".2f")],
        ["false changes in pick-ups", str(n["false_changes"])],
        *(_list_wire(n) if "sent" in n else _list_load(n)),
    ]


def _list_wire(n: Mapping[str, Any]) -> list[list[str]]:
    return [
        ["samples sent, received, of these not used", f"{n['sent']}, {n['received']}, {n['unused']}"],
        ["beliefs skipped because samples were processed late", str(n["left_out"])],
    ]


def _list_load(n: Mapping[str, Any]) -> list[list[str]]:
    return [
        ["false changes at constant load", f"{n['constant_false_changes']} in {n['constant_minutes']:.0f} min"],
        ["a sample, a belief (CPU)", f"{n['sample_ms']:.2f}, {n['belief_ms']:.0f} ms"],
    ]


STUDY = Study(
    "delays, coverage and false alarms of live identification, on two simulated robots", add_arguments, plan
)
