"""Cost of planning every control period by the quadratic program, on the same trials.

By default a plan in which no limit is active is one linear solve, and the MathematicalProgram is called only where
that plan violates a limit. Here whole trials of all four simulations are run both ways: the largest difference of
joint angles, the number of periods with an active limit, and the processor time are compared.
``affordance study speed --only program_every_tick`` runs every trial at full length.
"""

import dataclasses
import functools
import time
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, cast

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import Hammer
from affordance.choice.reach import Reach
from affordance.experiments.protocol_runs import load_choice_experiment, load_hold_experiment
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.blow import simulate_blow
from affordance.simulation.rollout import roll_out
from affordance.simulation.trial import Observer, get_runner
from affordance.simulation.trial_record import TrialRecord

BY_PROGRAM = dataclasses.replace(DEFAULT_SETTINGS, mpc=dataclasses.replace(DEFAULT_SETTINGS.mpc, always_program=True))
HEADER = [
    "simulation",
    "trials",
    "largest difference of an angle, rad",
    "periods with a limit active, default",
    "the same, program",
    "default, s",
    "program, s",
    "ratio",
]

# Function that runs trials under given settings and returns their records.
Run = Callable[[Settings], Sequence[TrialRecord]]


class Comparison(NamedTuple):
    """Comparison of the trials of a simulation that were run both ways."""

    num_trials: int  # number of trials
    difference: float  # largest difference of a joint angle at any logged time, [rad]
    limited: tuple[int, int]  # control periods with a limit active, with the default and with the program
    # Processor time, with the default and with the program; each builds its own Diagrams.
    seconds: tuple[float, float]


def list_runs(*, duration: float, num_tools: int | None = None) -> Iterator[tuple[str, Run]]:
    """Yields the trials of each simulation, with its name; the duration, [s], is that of holds.

    ``num_tools`` novel tools are used, by their first grips; None for all of them, by all grips. Reaching and
    hammering have durations of their own.
    """
    yield "weight", functools.partial(_hold, load_hold_experiment("weight").tools, duration)
    yield "com", functools.partial(_hold, load_hold_experiment("com").tools, duration)
    reaching, hammering = load_choice_experiment("reach"), load_choice_experiment("hammer")
    reach, hammer = cast(Reach, reaching.task), cast(Hammer, hammering.task)
    yield (
        "reach",
        lambda settings: [
            roll_out(gripped, reach, list_densities([tool]), settings).record
            for tool, gripped in _list_gripped(reaching.novel, num_tools)
        ],
    )
    model = ArmModel(load_arm())
    # Swings are planned once: the comparison is of the arm that carries them out.
    planned = [
        (gripped, hammer.build_cost(model, gripped.components, DEFAULT_SETTINGS), list_densities([tool]))
        for tool, gripped in _list_gripped(reaching.novel, num_tools)
    ]
    yield (
        "hammer",
        lambda settings: [
            simulate_blow(gripped, hammer, cost, densities, settings).record for gripped, cost, densities in planned
        ],
    )


def compare(run: Run) -> Comparison:
    """Runs trials both ways and compares them."""
    seconds, records = [], []
    for settings in (DEFAULT_SETTINGS, BY_PROGRAM):
        start = time.process_time()
        records.append(run(settings))
        seconds.append(time.process_time() - start)
    one, other = records
    limited = (sum(record.counts.limited for record in one), sum(record.counts.limited for record in other))
    return Comparison(len(one), find_difference(one, other), limited, (seconds[0], seconds[1]))


def find_difference(one: Sequence[TrialRecord], other: Sequence[TrialRecord]) -> float:
    """Computes the largest difference of a joint angle at any logged time of the same trials, [rad]."""
    return max(float(np.abs(a.q - b.q).max()) for a, b in zip(one, other, strict=True))


def _hold(tools: Sequence[Tool], duration: float, settings: Settings) -> list[TrialRecord]:
    """Simulates one observer who holds one object after the other, and learns from each."""
    observer = Observer(get_runner(settings), MaterialMemory(), duration=duration)
    return [observer.hold(tool, (0, number)) for number, tool in enumerate(tools)]


def _list_gripped(tools: Sequence[Tool], num_tools: int | None) -> list[tuple[Tool, Tool]]:
    if num_tools is None:
        return [(tool, gripped) for tool in tools for gripped in tool.list_gripped().values()]
    return [(tool, next(iter(tool.list_gripped().values()))) for tool in tools[:num_tools]]


def measure() -> Iterator[list[str]]:
    """Compares all trials of all simulations; yields rows of a table."""
    for name, run in list_runs(duration=3.0):
        found = compare(run)
        yield [
            name,
            str(found.num_trials),
            f"{found.difference:.1e}",
            *map(str, found.limited),
            *(f"{seconds:.2f}" for seconds in found.seconds),
            f"{found.seconds[1] / found.seconds[0]:.2f}",
        ]
