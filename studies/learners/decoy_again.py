"""Simulation I with each learner, and the decoy lifted again: the effect of one odd object on the belief about brass.

After the other objects the decoy is held six times, and then the first object once more. Up to the first decoy a
learner with one density for each colour does exactly what Simulation I does.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.belief.kind_memory import KindMemory, count_kinds, start_memory
from affordance.belief.learner import Learner
from affordance.belief.object_belief import Memory
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.files.model_files import list_arm_files
from affordance.objects.tool import Tool
from affordance.reporting.figures import FONT_SIZE, LINE_STYLES, OBJECT_COLOURS, tidy
from affordance.reporting.statistics import compute_excursion, estimate_mean
from affordance.runs.random_streams import Stream
from affordance.simulation.trial import Observer, get_runner
from affordance.simulation.trial_record import TrialRecord
from studies.learners.kinds_figure import draw_kinds, summarise_kinds
from studies.study import run_kept

NUM_DECOYS = 6
# Distance of learners in the figure, of that of holds.
_OFFSET = 0.14


@dataclass(frozen=True)
class DecoyConfig:
    """Configuration of the study."""

    weight: PresentationExperiment  # experiment of Simulation I
    learner: Learner  # learner of the observers

    @property
    def tools(self) -> tuple[Tool, ...]:
        """Objects that are held, in order."""
        *honest, decoy = self.weight.tools
        return (*honest, *[decoy] * NUM_DECOYS, honest[0])


def run_observer(config: DecoyConfig, repeat: int) -> tuple[list[Memory], list[TrialRecord]]:
    """Runs one observer; returns its memories before the first and after each hold, and the records."""
    weight, seed = config.weight, config.weight.seed
    memory = start_memory(config.learner, (seed, repeat, Stream.KINDS)).add_colours(
        weight.colours, weight.settings.prior
    )
    observer = Observer(get_runner(weight.settings), memory, duration=weight.duration)
    memories, records = [memory], []
    for trial, tool in enumerate(config.tools):
        records.append(observer.hold(tool, (seed, repeat, trial)))
        memories.append(observer.memory)
    return memories, records


def run_repeat(config: DecoyConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Runs one observer, and returns the results as arrays.

    Returns: ``excursion`` (K,), the height of largest magnitude of each object's centre, [m]; ``density_median`` (K +
        1,), the believed density of the material before the first and after each of K holds, [kg/m^3]; and
        ``num_kinds`` (K + 1,), zero for a learner without kinds.
    """
    memories, records = run_observer(config, repeat)
    return {
        "excursion": compute_excursion(np.array([record.height_centre for record in records])),
        "density_median": np.array([memory.belief.compute_percentiles([0.5])[0, 0] for memory in memories]),
        "num_kinds": np.array([count_kinds(memory) for memory in memories]),
    }


def run(
    weight: PresentationExperiment, folder: Path, *, repeats: int, jobs: int
) -> tuple[dict[Learner, dict[str, NDArray[Any]]], dict[str, Any]]:
    """Runs all observers of all learners; those that the folder holds are not run again.

    Returns: Arrays of all observers by learner, and the numbers of ``compute_metrics``.
    """
    arrays = {}
    for learner in Learner:
        config, files, name = DecoyConfig(weight, learner), list_arm_files(weight.settings.arm), learner.value
        arrays[learner] = run_kept(
            config, run_repeat, folder, files, repeats=repeats, jobs=jobs, description=f"decoy, {name}"
        )
    return arrays, compute_metrics(weight, arrays)


def draw_memory(weight: PresentationExperiment, repeat: int) -> Figure:
    """Draws the final memory of an observer who takes the most probable hypothesis."""
    memories, _ = run_observer(DecoyConfig(weight, Learner.KINDS_MAP), repeat)
    memory = memories[-1]
    assert isinstance(memory, KindMemory)  # memory of such an observer from the start
    title = f"What one observer remembers after Simulation I and {NUM_DECOYS} lifts of the decoy"
    return draw_kinds(summarise_kinds(memory), title=title)


def compute_metrics(
    weight: PresentationExperiment, arrays: Mapping[Learner, Mapping[str, NDArray[Any]]]
) -> dict[str, Any]:
    """Computes the effect of the decoy on the density of brass, excursions, and the share of needless kinds.

    Returns: ``brass_after_decoy``, by learner the median density believed of the material after one decoy and after
        six, [kg/m^3]; ``excursion_m`` with ``_ci95``, by learner the mean excursion in each hold, and
        ``deviation_m``, that of its magnitude; and ``needless_kinds``, by learner the share of first lifts that
        created a kind, of the objects other than the decoy and the first.
    """
    num_honest = len(weight.tools) - 1
    numbers: dict[str, dict[str, Any]] = {}
    for learner, found in arrays.items():
        before, after, last = np.median(found["density_median"], axis=0)[num_honest + np.array([0, 1, NUM_DECOYS])]
        estimate = estimate_mean(found["excursion"])
        founded = np.diff(found["num_kinds"][:, 1 : num_honest + 1], axis=1) > 0
        of_learner = {
            "brass_after_decoy": [float(after), float(last)],
            "brass_before_decoy": float(before),
            "excursion_m": estimate.mean,
            "excursion_m_ci95": estimate.ci95,
            "deviation_m": np.abs(found["excursion"]).mean(axis=0),
            "needless_kinds": float(founded.mean()),
        }
        for name, number in of_learner.items():
            numbers.setdefault(name, {})[learner.value] = number
    return numbers


def draw(
    weight: PresentationExperiment, arrays: Mapping[Learner, Mapping[str, NDArray[Any]]], labels: Sequence[str]
) -> Figure:
    """Draws the excursion of objects and the believed density of their material, hold by hold; labels of learners."""
    figure = Figure(figsize=(11.0, 4.2))
    left, right = figure.subplots(1, 2)
    held = DecoyConfig(weight, Learner.DENSITY).tools
    positions = np.arange(1, len(held) + 1)
    for k, (found, label, colour) in enumerate(zip(arrays.values(), labels, OBJECT_COLOURS, strict=False)):
        height = estimate_mean(found["excursion"])
        error = 100.0 * np.array([height.mean - height.low, height.high - height.mean])
        shifted = positions + _OFFSET * (k - 0.5 * (len(arrays) - 1))
        left.errorbar(shifted, 100.0 * height.mean, error, fmt="o", color=colour, capsize=2.5, label=label)
        style = f"o{LINE_STYLES[k % len(LINE_STYLES)]}"
        medians = np.median(found["density_median"], axis=0)
        right.plot([0, *positions], medians, style, color=colour, markersize=4.0, label=label)
    left.axhline(0.0, color="#000000", linewidth=0.8, linestyle=":")
    true = weight.tools[0].components[0].material.density
    right.axhline(true, color="#000000", linewidth=1.0, linestyle=":", label="true")
    names = [f"{trial}. {tool.name.replace('_', ' ')}" for trial, tool in enumerate(held, start=1)]
    for axes in (left, right):
        axes.set_xticks(positions, names, rotation=40, ha="right")
    left.set_ylabel("farthest height of the object (cm)")
    left.set_title("Mean over observers, 95 % interval", fontsize=FONT_SIZE)
    right.set_ylabel("density believed of the material (kg/m³)")
    right.set_title("After each hold, median over observers", fontsize=FONT_SIZE)
    right.set_ylim(bottom=0.0)
    right.legend(frameon=False)
    tidy(left, right)
    return figure
