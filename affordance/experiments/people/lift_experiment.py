"""Experiments of many lifts, simulated in closed form: observers with any learner, and their measures."""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import joblib
import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.kind_memory import KindMemory
from affordance.belief.learner import Learner
from affordance.belief.learners import start_memory
from affordance.objects.tool import Tool
from affordance.random_streams import Stream
from affordance.settings import Settings
from affordance.simulation.static_lifts import Lift, LiftRecord, StaticLifter


class LiftedObjects(NamedTuple):
    """Forces of one observer in N lifts.

    Attributes:
        tool: Index of the lifted object, (N,).
        force: Upward force before release, (N,), [N].
        weight: True weight, (N,), [N].
    """

    tool: NDArray[np.intp]
    force: Array
    weight: Array

    def select(self, lifts: "slice | NDArray[np.bool_]") -> "LiftedObjects":
        """Returns some of the lifts."""
        return LiftedObjects(self.tool[lifts], self.force[lifts], self.weight[lifts])


class Measure(NamedTuple):
    """Measure of an observer.

    Attributes:
        meaning: Meaning in words.
        unit: SI unit; 1 if it has none.
        compute: Function that computes it.
    """

    meaning: str
    unit: str
    compute: Callable[[LiftedObjects], float]


@dataclass(frozen=True)
class LiftExperiment:
    """Experiment of many lifts.

    Attributes:
        name: Name of the experiment.
        tools: Objects of the experiment.
        honest: Indices of the objects whose appearance is not misleading.
        draw_lifts: Function that draws an observer's lifts; must be picklable for other processes.
        measures: Measures, by name.
    """

    name: str
    tools: tuple[Tool, ...]
    honest: tuple[int, ...]
    draw_lifts: Callable[[np.random.Generator], Sequence[Lift]]
    measures: Mapping[str, Measure]


@dataclass(frozen=True)
class Observers:
    """Forces of R observers with one learner in N lifts.

    Attributes:
        tool: Index of the lifted object, (R, N).
        force: Upward force before release, (R, N), [N].
        weight: True weight, (R, N), [N].
        founded: True where a lift created a new kind, (R, N).
    """

    tool: NDArray[np.intp]
    force: Array
    weight: Array
    founded: NDArray[np.bool_]

    def list_observers(self) -> list[LiftedObjects]:
        """Lists the lifts of each observer."""
        return [LiftedObjects(*row) for row in zip(self.tool, self.force, self.weight, strict=True)]

    def measure(self, measure: Measure) -> Array:
        """Computes a measure of each observer, shape (R,)."""
        return np.array([measure.compute(lifted) for lifted in self.list_observers()])

    def count_needless_kinds(self, honest: Sequence[int]) -> tuple[int, int]:
        """Counts first lifts of regular objects that created a kind although one of their colour existed.

        The first object that an observer lifts creates a kind rightly, and is not counted.

        Returns: Number of such lifts, and number of first lifts.
        """
        needless = lifts = 0
        for tools, founded in zip(self.tool, self.founded, strict=True):
            for tool in honest:
                found = np.flatnonzero(tools == tool)
                if len(found) and found[0] > 0:
                    needless += int(founded[found[0]])
                    lifts += 1
        return needless, lifts


def simulate_observers(
    experiment: LiftExperiment,
    learner: Learner,
    settings: Settings,
    *,
    repeats: int,
    seed: int,
    jobs: int,
    kappa: float | None = None,
) -> Observers:
    """Simulates observers, each with lifts, measurement errors and draws of its own.

    Observer r of a seed is given the same lifts and errors with every learner. Results do not depend on jobs.

    Args:
        experiment: Experiment to simulate.
        learner: Learner of the observers.
        settings: Settings of all simulations.
        repeats: Number of observers, at least 1.
        seed: Root of every random draw.
        jobs: Number of processes.
        kappa: Breadth of a category relative to its mean; None for the fitted value.
    """
    run = functools.partial(_run_observer, experiment, learner, settings, seed, kappa)
    parallel = joblib.Parallel(n_jobs=min(jobs, repeats))
    rows = parallel(joblib.delayed(run)(repeat) for repeat in range(repeats))
    return Observers(*(np.stack(column) for column in zip(*rows, strict=True)))


def _run_observer(
    experiment: LiftExperiment, learner: Learner, settings: Settings, seed: int, kappa: float | None, repeat: int
) -> tuple[NDArray[np.intp], Array, Array, NDArray[np.bool_]]:
    lifts = list(experiment.draw_lifts(np.random.default_rng([seed, repeat, Stream.LIFT_ORDER])))
    memory = start_memory(learner, (seed, repeat, Stream.KINDS), kappa)
    lifter = StaticLifter(experiment.tools, settings)
    record = lifter.run(lifts, memory, (seed, repeat, Stream.LIFT))
    return np.array([lift.tool for lift in lifts]), record.force, record.weight, _find_founded(record)


def _find_founded(record: LiftRecord) -> NDArray[np.bool_]:
    counts = [len(memory.kinds.colours) if isinstance(memory, KindMemory) else 0 for memory in record.memories]
    return np.diff(counts) > 0
