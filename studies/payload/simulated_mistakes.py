"""Users' mistakes in simulated pairs, one pair per load: the share not noticed, and its effect on the mass."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.exceptions import AffordanceError
from affordance.identification.settings import DEFAULT_SETTINGS
from studies.payload.errors import ARMS
from studies.payload.mistakes import list_mistakes, measure_blind_bands
from studies.payload.recordings import Recordings, simulate
from studies.recorded.mistake_outcomes import Case
from studies.recorded.solids import CLASSES

_FEW = 2000  # number of samples that is enough for a verdict


@dataclass(frozen=True)
class MistakesConfig:
    """Configuration of the mistakes made in pairs of one robot."""

    arm: str  # name in ARMS
    seed: int = 0  # root of every random draw


def list_sizes() -> list[tuple[str, float]]:
    """Lists each mistake with each of its sizes, in the order of the columns."""
    return [(mistake.name, size) for mistake in list_mistakes(np.zeros(10)) for size in mistake.sizes]


def run_mistakes(config: MistakesConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Makes every mistake in every size in one simulated pair; classes of solids are taken in turn.

    Returns:
        ``passes``, 1 if the mistake is neither refused nor doubted and the mass remains observable; ``moved``, the
        change of the mass, [kg]; and ``sds``, the same in stated SDs, (K,) each. NaN if the pair itself is not
        trusted.
    """
    rng = np.random.default_rng((config.seed, sorted(ARMS).index(config.arm), repeat))
    drawn = _simulate_pair(config.arm, tuple(CLASSES)[repeat % len(CLASSES)], rng)
    case = Case(drawn.robot, drawn.empty, drawn.loaded, float(drawn.truth[0]), gains=drawn.gains)
    nothing = np.full(len(list_sizes()), np.nan)
    try:
        found = measure_blind_bands(case, replace(DEFAULT_SETTINGS, num_samples=_FEW, seed=repeat))
    except AffordanceError:
        return {"passes": nothing, "moved": nothing, "sds": nothing}
    if found["doubts"]:
        return {"passes": nothing, "moved": nothing, "sds": nothing}
    answers = [answer for of_mistake in found["mistakes"].values() for answer in of_mistake]
    return {
        "passes": np.array([float(answer["verdict"] == "answered") for answer in answers]),
        "moved": np.array([answer["mass"] - found["mass_kg"] for answer in answers]),
        "sds": np.array([answer["moved"] for answer in answers]),
    }


def _simulate_pair(arm: str, solid: str, rng: np.random.Generator) -> Recordings:
    drawn = simulate(ARMS[arm], solid, rng)
    while not drawn.factors.paired:
        drawn = simulate(ARMS[arm], solid, rng)
    return drawn


def tabulate_mistakes(found: Mapping[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """Counts the pairs in which each mistake is not noticed, and its effect on the mass; one row for each size."""
    rows = []
    for column, (name, size) in enumerate(list_sizes()):
        ran = np.isfinite(found["passes"][:, column])
        passes = ran & (found["passes"][:, column] == 1.0)
        moved, sds = (np.abs(found[key][passes, column]) for key in ("moved", "sds"))
        rows.append(
            {
                "mistake": name,
                "size": size,
                "pairs": int(ran.sum()),
                "passes": int(passes.sum()),
                "moved_g": 1e3 * float(np.median(moved)) if len(moved) else None,
                "moved_sd": float(np.median(sds)) if len(sds) else None,
            }
        )
    return rows


def list_mistake_rows(rows: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Lists the rows of the printed table."""
    return [
        [
            row["mistake"],
            f"{row['size']:g}",
            f"{row['passes']} of {row['pairs']}",
            "" if row["moved_g"] is None else f"{row['moved_g']:.0f} g, {row['moved_sd']:.1f} SD",
        ]
        for row in rows
    ]
