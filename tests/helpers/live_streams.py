"""Streams of a generated robot whose load changes while it moves, for tests of live identification."""

from collections.abc import Iterable, Sequence

import numpy as np

from affordance import LiveEvent, LiveIdentifier, Run
from affordance.arrays import Array
from affordance.plant.serial_chain import SerialChain
from helpers.generated_runs import Truth, generate_run

TRUTH = Truth(friction=(0.5, 0.3, 0.2), file_error=0.05)


def record_empty(robot: SerialChain, rng: np.random.Generator) -> list[Run]:
    """Three empty runs of 15 s, of different motions."""
    return [
        generate_run(robot, None, truth=TRUTH, rng=rng, duration=15.0, motion_seed=k, source=f"empty {k}")
        for k in (1, 2, 3)
    ]


def record_loads(
    robot: SerialChain, rng: np.random.Generator, loads: Sequence[tuple[float, Array | None]], motion_seed: int = 4
) -> Run:
    """A run in which each load, (10,) or None, is held for its time, [s]; loads change from one row to the next."""
    length = sum(time for time, _ in loads)
    runs = [
        generate_run(robot, load, truth=TRUTH, rng=rng, duration=length, motion_seed=motion_seed, source="stream")
        for _, load in loads
    ]
    ends = np.cumsum([time for time, _ in loads])
    which = np.minimum(np.searchsorted(ends, runs[0].times, side="right"), len(loads) - 1)
    signal = np.stack([run.signal for run in runs])[which, np.arange(len(which))]
    return Run("stream", runs[0].description, runs[0].times, runs[0].q, signal, runs[0].v)


def compute_signal(robot: SerialChain, q: Array, v: Array, vdot: Array) -> Array:
    """The signal of the empty robot along any motion, (N, n), as in its runs but without noise."""
    links = robot.link_parameters * (1.0 + TRUTH.file_error * np.random.default_rng(5).standard_normal((6, 1)))
    coulomb, viscous, offset = TRUTH.friction
    signal: Array = robot.compute_link_regressors(q, v, vdot) @ links.ravel()
    return signal + coulomb * np.sign(v) + viscous * v + offset


def list_rows(run: Run, has_v: bool = True) -> list[tuple[float, Array, Array | None, Array]]:
    """The samples of a run."""
    velocities = run.v if has_v and run.v is not None else [None] * len(run.times)
    return list(zip(map(float, run.times), run.q, velocities, run.signal, strict=True))  # type: ignore[arg-type]


def follow(
    live: LiveIdentifier, rows: Iterable[tuple[float, Array, Array | None, Array]], behind: float = 0.0
) -> list[LiveEvent]:
    """The events of a stream."""
    return [event for row in rows for event in live.add(*row, behind=behind)]


def list_kinds(events: Iterable[LiveEvent]) -> list[str]:
    """The kinds of events, without beliefs."""
    return [event.kind for event in events if event.kind != "belief"]
