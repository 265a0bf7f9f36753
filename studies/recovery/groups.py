"""Recovery of group differences from simulated participants, using the fits of ``affordance fit``.

Participants lift objects of Linear++ 60 times. In the population, log kappa and log push_error are normally
distributed. Kappa is larger by a factor in one condition. Many groups are drawn at random from a pool, so they share
participants: R participants in a condition correspond to R / n independent groups of size n.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.learners import KINDS_DRAWN
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.lifts import repeat
from affordance.extensions.people.fit import MOST_NOISE, Question, fit_each
from affordance.extensions.people.groups import draw_groups
from affordance.extensions.people.likelihood import list_free
from affordance.extensions.people.participant import LiftSettings, Participant
from affordance.extensions.people.pushes import Lifts, Person
from affordance.runs.repeats import run_tasks
from studies.recovery.people import GROUP, simulate_pushes

# Assumed ratio of kappa between conditions, and assumed SDs of log push_error and log kappa between participants.
EFFECT = 1.5
SPREADS = {"push_error": 0.2, "kappa": 0.3}
CYCLES = (5, 8)  # number of cycles with only the family, and with the test object
LEVELS = (0.5, 0.8, 0.9)
QUANTITIES = ("mean", "spread", "difference, with effect", "difference, without")
_CONDITIONS = 3  # number of conditions in the pool: two without the effect, and one with the effect


@dataclass(frozen=True)
class GroupRecovery:
    """Configuration of the recovery of group differences.

    Attributes:
        seed: Root seed.
        draws: Number of posterior draws for each participant.
        particles: Number of particles for each draw.
        people: Number of participants in each of the three conditions of the pool.
        sizes: Group sizes.
        groups: Number of pairs of groups of each size.
    """

    seed: int
    draws: int
    particles: int
    people: int
    sizes: tuple[int, ...]
    groups: int


def design(_: int, rng: np.random.Generator) -> pd.DataFrame:
    """Draws the 60 lifts of a participant: cycles of the family, then cycles of the test object and the family."""
    alone, mixed = CYCLES
    family = repeat([*linear.TRAINING], alone, rng, block="family")
    return pd.concat([family, repeat([*linear.TRAINING, "test"], mixed, rng, block="odd member", first=["test"])])


def list_parameters() -> list[Any]:
    """Lists the free parameters: push_error and kappa."""
    return list_free(KINDS_DRAWN, Participant(), [*SPREADS])


def simulate_person(config: GroupRecovery, number: int) -> Person:
    """Simulates the lifts of a participant in condition ``number`` modulo three, of which the last has the effect."""
    normal = np.random.default_rng([config.seed, number]).standard_normal(len(SPREADS))
    push_error, kappa = (
        each.median * math.exp(SPREADS[each.name] * z) for each, z in zip(list_parameters(), normal, strict=True)
    )
    own = KINDS_DRAWN.change(kappa=kappa * (EFFECT if number % _CONDITIONS == _CONDITIONS - 1 else 1.0))
    settings = LiftSettings(learner=own, participant=Participant(push_error=min(push_error, 1.0)))
    return simulate_pushes(f"{number}", settings, config.seed + 1 + number, design)


def recover_groups(config: GroupRecovery, jobs: int, folder: Path) -> dict[str, Any]:
    """Fits the pool, and estimates differences between groups. Finished participants are cached.

    Returns: Content of metrics.json.
    """
    people = [partial(simulate_person, config, number) for number in range(_CONDITIONS * config.people)]
    pool = tuple(run_tasks(people, jobs=jobs, description="people"))
    question = Question(
        Lifts(pool, tuple(linear.make_objects(GROUP))),
        KINDS_DRAWN,
        LiftSettings(),
        list_parameters(),
        config.draws,
        config.particles,
        seed=config.seed,
        jobs=jobs,
    )
    fits = fit_each(question, folder / "people")
    own = np.stack([each.draws.normal for each in fits])
    numbers: dict[str, Any] = {
        "people_of_each_condition": config.people,
        "groups": config.groups,
        "seed": config.seed,
        "noisy_people": sum(each.noise > MOST_NOISE for each in fits),
        "sizes": {},
    }
    for size in config.sizes:
        tasks = [partial(measure_groups, config, own, size, number) for number in range(config.groups)]
        found = np.stack(run_tasks(tasks, jobs=jobs, description=f"groups of {size}"))
        numbers["sizes"][size] = summarise_groups(found)
    return numbers


def measure_groups(config: GroupRecovery, own: Array, size: int, number: int) -> Array:
    """Draws random groups from the pool, and compares their estimates with the true values.

    Args:
        config: Configuration.
        own: Posterior draws of each participant in the pool, (people, D, F), in standard normal numbers.
        size: Group size.
        number: Number of the groups, which determines random numbers.

    Returns: Array (4, F, 2 + levels). For each of ``QUANTITIES`` and each parameter, in units of its logarithm, it
        contains the error of the posterior median, 1 if the 90 % interval excludes zero, and 1 for each of ``LEVELS``
        if the interval contains the true value.
    """
    rng = np.random.default_rng([config.seed, size, number])
    chosen = [np.arange(len(own))[k::_CONDITIONS][rng.permutation(config.people)[:size]] for k in range(_CONDITIONS)]
    names = ["first"] * size + ["other"] * size
    without, effect = (draw_groups([*own[chosen[0]], *own[chosen[k]]], names, number) for k in range(1, _CONDITIONS))
    free = list_parameters()
    change = [math.log(EFFECT) if each.name == "kappa" else 0.0 for each in free]
    none = [0.0] * len(free)
    found = (
        (effect.means[:, 0], none),
        (effect.spreads, [SPREADS[each.name] for each in free]),
        (effect.means[:, 1] - effect.means[:, 0], change),
        (without.means[:, 1] - without.means[:, 0], none),
    )
    rows = [[_judge(each.sd * values[:, p], true[p]) for p, each in enumerate(free)] for values, true in found]
    return np.array(rows)


def _judge(values: Array, true: float) -> list[float]:
    median = float(np.median(values))
    ends = [np.quantile(values, [0.5 - 0.5 * level, 0.5 + 0.5 * level]) for level in LEVELS]
    low, high = ends[-1]
    return [median - true, float(low > 0.0 or high < 0.0), *(float(a <= true <= b) for a, b in ends)]


def summarise_groups(found: NDArray[np.float64]) -> dict[str, Any]:
    """Summarises results of ``measure_groups``, (groups, 4, F, 2 + levels), by quantity and parameter."""
    return {
        quantity: {
            name: {
                "bias": float(found[:, q, p, 0].mean()),
                "rms_error": float(np.sqrt((found[:, q, p, 0] ** 2).mean())),
                "coverage": dict(zip(map(str, LEVELS), found[:, q, p, 2:].mean(axis=0).tolist(), strict=True)),
                **({"found": float(found[:, q, p, 1].mean())} if quantity.startswith("difference") else {}),
            }
            for p, name in enumerate(SPREADS)
        }
        for q, quantity in enumerate(QUANTITIES)
    }


def list_rows(numbers: Mapping[str, Any]) -> list[Sequence[str]]:
    """Lists the header and rows of a table of the results."""
    rows: list[Sequence[str]] = [["people", "parameter", "quantity", "bias", "RMS", *map(str, LEVELS), "found"]]
    for size, of_size in numbers["sizes"].items():
        for name in SPREADS:
            for quantity, found in ((key, each[name]) for key, each in of_size.items()):
                cells = [f"{found['bias']:+.2f}", f"{found['rms_error']:.2f}"]
                cells += [f"{each:.2f}" for each in found["coverage"].values()]
                cells.append(f"{found['found']:.2f}" if "found" in found else "")
                rows.append([str(size), name, quantity, *cells])
    return rows
