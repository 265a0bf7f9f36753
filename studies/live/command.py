"""``affordance study live``: follows pick-ups by two foreign robots live.

Each pick-up takes about ten seconds of one core; needs MuJoCo.
"""

import argparse
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.commands.arguments import add_jobs, add_out, add_repeats, add_seed
from affordance.extensions.payload.live import foreign_robot
from studies.live.pickups import WAYS, PickupConfig, run_constant, run_pickup
from studies.study import Findings, Study, Work, add_only, format_table, run_kept

_PER_MINUTE = 10  # pick-ups for each minute with a constant load
_CASES = {f"{arm} {way}": (arm, way) for arm in foreign_robot.ARMS for way in WAYS}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 100, "pick-ups of each arm")
    add_only(parser, _CASES, "arms and streams")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Plans the pick-ups."""
    return partial(_follow, arguments)


def _follow(arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    # A case that is left out is None, which pages show as a dash.
    numbers: dict[str, Any] = {"seed": arguments.seed, **dict.fromkeys(case.replace(" ", "_") for case in _CASES)}
    model = Path(foreign_robot.__file__)
    for case in arguments.only or _CASES:
        config = PickupConfig(*_CASES[case], arguments.seed)
        keep = partial(run_kept, config, models=model, jobs=arguments.jobs)
        found = keep(run_pickup, folder=folder, repeats=arguments.repeats, description=f"live: {case}")
        minutes = max(1, arguments.repeats // _PER_MINUTE)
        constant = keep(
            run_constant, folder=folder / "constant", repeats=minutes, description=f"live: {case}, constant"
        )
        numbers[case.replace(" ", "_")] = tabulate(found, constant)
        print(f"{format_table([case, ''], list_rows(numbers[case.replace(' ', '_')]))}\n", flush=True)
        yield Findings(numbers)


def tabulate(found: Mapping[str, NDArray[Any]], constant: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Summarises pick-ups and minutes with a constant load.

    Delays are in s, errors are shares or in mm.
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
        "rms_mass_share": float(np.sqrt(np.mean(error**2))),
        "rms_com_mm": (1e3 * np.sqrt(np.mean(found["com"][known] ** 2, axis=0))).tolist(),
        "finals": int(given.sum()),
        "finals_trusted": int(trusted.sum()),
        "trusted_inside": int(final[trusted, 2].sum()),
        "agreement_rms_sd": (
            float(np.sqrt(np.nanmean(found["agreement"] ** 2))) if np.isfinite(found["agreement"]).any() else None
        ),
        "false_changes": int(found["false"].sum()),
        "constant_minutes": float(constant["seconds"].sum() / 60.0),
        "constant_false_changes": int(constant["false"].sum()),
        "sample_ms": float(found["milliseconds"][:, 0].mean()),
        "belief_ms": float(found["milliseconds"][:, 1].mean()),
    }


def _take_quantiles(delays: NDArray[Any]) -> list[float | None]:
    """Computes the number of delays, their median and maximum.

    Without delays these are None.
    """
    there = delays[np.isfinite(delays)]
    return [float(len(there)), *((float(np.median(there)), float(there.max())) if len(there) else (None, None))]


def list_rows(n: Mapping[str, Any]) -> list[list[str]]:
    """Lists the rows of the table that is printed."""

    def show(name: str) -> str:
        number, *times = n[f"{name}_s"]
        return f"{', '.join('-' if x is None else f'{x:.1f}' for x in times)} s in {number:.0f} of {n['pickups']}"

    agreement = "-" if n["agreement_rms_sd"] is None else f"{n['agreement_rms_sd']:.2f} SD"
    return [
        ["noticed after (median, largest)", show("noticed")],
        ["named after", show("named")],
        ["SD of the mass below 5 % after", show("five_percent")],
        ["enough after", show("enough")],
        ["90 % interval holds the mass, last belief", f"{n['last_inside']} of {n['last']}"],
        ["the same, all beliefs", f"{n['beliefs_inside']} of {n['beliefs']}"],
        ["error of the mass (RMS)", f"{100.0 * n['rms_mass_share']:.1f} %"],
        ["error of the centre of mass (RMS)", f"{', '.join(f'{x:.0f}' for x in n['rms_com_mm'])} mm"],
        ["final answers, of these trusted", f"{n['finals']}, {n['finals_trusted']}"],
        ["trusted and 90 % interval holds the mass", f"{n['trusted_inside']} of {n['finals_trusted']}"],
        ["belief less final answer (RMS)", agreement],
        ["false changes in pick-ups", str(n["false_changes"])],
        ["false changes at constant load", f"{n['constant_false_changes']} in {n['constant_minutes']:.0f} min"],
        ["a sample, a belief (CPU)", f"{n['sample_ms']:.2f}, {n['belief_ms']:.0f} ms"],
    ]


STUDY = Study(
    "delays, coverage and false alarms of live identification, on two simulated robots", add_arguments, plan
)
