"""Computes the coverage of intervals of simulated payloads for each level of each factor, and errors of means."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import AffordanceError
from affordance.extensions.payload.posterior.payload_belief import COM, MASS, MOMENTS, describe_bodies
from affordance.extensions.payload.settings import DEFAULT_SETTINGS
from studies.payload.at_rest import AT_REST
from studies.payload.errors import ARMS
from studies.payload.simulated import Recordings, simulate
from studies.payload.solids import CLASSES

SHARES = (0.5, 0.8, 0.9)
# Quantities in the order of the columns: mass, coordinates of the centre of mass, and moments.
GROUPS = {"mass": MASS, "c_x": slice(1, 2), "c_y": slice(2, 3), "c_z": slice(3, 4), "moments": MOMENTS}
# Probability of a false alarm of low coverage in at least one of all cells.
_LEVEL = 0.01
# Edges between levels of mass, [kg], duration, [s], and speed, [rad/s].
_EDGES = {"mass": (0.5, 1.5), "length": (15.0, 30.0), "speed": (0.3, 0.55)}
_NUM_SAMPLES = 16_000
# Factors that change signals of the loaded run, and words in the doubt about such a change.
CHANGES, _OF_CHANGE = (1.0, 1.02, 1.03, 1.05), "the gains of the two runs differ"


@dataclass(frozen=True)
class CoverageConfig:
    """Configuration of the loads of one robot."""

    arm: str  # name in ARMS or AT_REST
    seed: int = 0  # root seed of all random draws


class Cell(NamedTuple):
    """Coverage of one quantity at one level of a factor."""

    covered: int
    number: int

    def bound(self, level: float) -> tuple[float, float]:
        """Computes Wilson's interval of the share at a two-sided error probability."""
        z, n = float(scipy.special.ndtri(1.0 - 0.5 * level)), self.number
        share, width = self.covered / n, z * z / n
        middle, half = share + 0.5 * width, z * np.sqrt(share * (1.0 - share) / n + 0.25 * width / n)
        return float((middle - half) / (1.0 + width)), float((middle + half) / (1.0 + width))

    def is_low(self, nominal: float, num_cells: int) -> bool:
        """Tests if coverage is below nominal, one-sided and corrected for the number of cells."""
        return bool(scipy.stats.binom.cdf(self.covered, self.number, nominal) < _LEVEL / num_cells)


def run_load(config: CoverageConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Simulates and identifies one load. Successive repeats cycle through the classes of solids.

    Returns: ``place``, the posterior probability of values below the truth; ``truth``, ``mean`` and ``sd``, in the
        order of ``describe_bodies``, (10,) each; ``factors``; ``trusted``, 1 if there are no doubts; ``doubts`` in
        words; ``seconds`` of CPU time. Results are NaN if the recording was rejected.
    """
    rng = np.random.default_rng((config.seed, [*ARMS, *AT_REST].index(config.arm), repeat))
    names = tuple(CLASSES)
    number = repeat % len(names)
    draw = AT_REST.get(config.arm) or partial(simulate, ARMS[config.arm])
    drawn = draw(names[number], rng)
    factors = drawn.factors
    known = np.array([number, factors.paired, factors.mass, factors.length, factors.speed, factors.cable])
    return {"factors": known, **_identify(drawn, repeat)}


def _identify(drawn: Recordings, seed: int) -> dict[str, NDArray[Any]]:
    settings = replace(DEFAULT_SETTINGS, num_samples=_NUM_SAMPLES, seed=seed)
    truth = describe_bodies(drawn.truth[None])[0]
    start = time.process_time()
    try:
        belief = drawn.identify(settings)
    except AffordanceError as error:
        nothing = np.full(10, np.nan)
        return {
            **dict.fromkeys(("place", "mean", "sd"), nothing),
            "truth": truth,
            "trusted": np.array(np.nan),
            "seconds": np.array(time.process_time() - start),
            "doubts": np.array(str(error)[:400]),
        }
    seconds = time.process_time() - start
    values, weights, marginals = describe_bodies(belief.bodies.pi), belief.bodies.weights, belief.marginals
    return {
        "place": weights @ (values < truth) + 0.5 * weights @ (values == truth),
        "truth": truth,
        "mean": marginals.mean,
        "sd": marginals.sd,
        "trusted": np.array(float(belief.is_trusted)),
        "seconds": np.array(seconds),
        "doubts": np.array(" | ".join(belief.doubts)[:400]),
    }


def run_changes(config: CoverageConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Simulates and identifies one load with each of ``CHANGES`` applied to the signals of the loaded run.

    Returns: ``doubted``, 1 if the change of gains was doubted, shape (len(CHANGES),).
    """
    names = tuple(CLASSES)
    rng = np.random.default_rng((config.seed, len(ARMS) + len(AT_REST), repeat))
    drawn = simulate(ARMS[config.arm], names[repeat % len(names)], rng, share_paired=1.0)
    settings = replace(DEFAULT_SETTINGS, num_samples=1000, seed=repeat)
    doubted = []
    for change in CHANGES:
        loaded = replace(drawn.loaded, signal=change * drawn.loaded.signal)
        doubts = drawn._replace(loaded=loaded).identify(settings).doubts
        doubted.append(any(_OF_CHANGE in each for each in doubts))
    return {"doubted": np.array(doubted, dtype=float)}


def tabulate(found: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Computes coverage for each level of each factor, and compares errors of means with stated SDs."""
    ran = np.isfinite(found["trusted"])
    place, levels = found["place"][ran], _list_levels(found["factors"][ran])
    num_cells = sum(len(each) for each in levels.values()) * len(SHARES) * 4
    table: dict[str, Any] = {}
    for factor, masks in levels.items():
        table[factor] = {
            level: {
                name: [_count(place[rows, columns], share, num_cells) for share in SHARES]
                for name, columns in GROUPS.items()
            }
            for level, rows in masks.items()
        }
    low = [
        f"{factor} {level}, {name} at {share:g}"
        for factor, masks in table.items()
        for level, cells in masks.items()
        for name, row in cells.items()
        if name != "moments"
        for share, cell in zip(SHARES, row, strict=True)
        if cell["is_low"]
    ]
    return {
        "loads": len(ran),
        "refused": int((~ran).sum()),
        "doubted": int((found["trusted"][ran] == 0.0).sum()),
        "coverage": table,
        "low": low,
        "cells": num_cells,
        "rms": _compare_means({key: values[ran] for key, values in found.items()}, levels),
        "seconds": float(found["seconds"][ran].mean()),
    }


def _count(place: Array, share: float, num_cells: int) -> dict[str, Any]:
    inside = np.abs(place - 0.5) <= 0.5 * share
    cell = Cell(int(inside.sum()), inside.size)
    low, high = cell.bound(0.05)
    return {
        "share": cell.covered / cell.number,
        "low95": low,
        "high95": high,
        "number": cell.number,
        "is_low": cell.is_low(share, num_cells),
    }


def _list_levels(factors: Array) -> dict[str, dict[str, NDArray[np.bool_]]]:
    """Lists masks of the loads at each level of each factor. Levels without loads are left out."""
    solid, paired, mass, length, speed, cable = factors.T
    levels = {"all": {"all": np.ones(len(factors), dtype=bool)}}
    levels["solid"] = {name: solid == number for number, name in enumerate(CLASSES)}
    levels["runs"] = {"paired": paired == 1.0, "unpaired": paired == 0.0}
    for name, values in (("mass", mass), ("length", length), ("speed", speed)):
        first, second = _EDGES[name]
        levels[name] = {
            f"below {first:g}": values < first,
            f"{first:g} to {second:g}": (values >= first) & (values < second),
            f"{second:g} and more": values >= second,
        }
    levels["cable"] = {"without": cable == 0.0, "with": cable > 0.0}
    return {factor: {level: rows for level, rows in of.items() if rows.any()} for factor, of in levels.items()}


def _compare_means(
    found: Mapping[str, NDArray[Any]], levels: Mapping[str, Mapping[str, NDArray[np.bool_]]]
) -> dict[str, Any]:
    """Compares RMS errors of the posterior means with stated SDs, for mass and centre of mass."""
    rows: dict[str, Any] = {}
    for factor in ("all", "runs", "mass"):
        for level, of_level in levels[factor].items():
            errors = {
                "mean": found["mean"][of_level] - found["truth"][of_level],
                "stated": found["sd"][of_level],
            }
            rows[f"{factor} {level}"] = {
                name: {
                    "mass_g": 1e3 * float(np.sqrt(np.mean(each[:, 0] ** 2))),
                    "com_mm": [1e3 * float(x) for x in np.sqrt(np.mean(each[:, COM] ** 2, axis=0))],
                }
                for name, each in errors.items()
            }
    return rows
