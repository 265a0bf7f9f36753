"""Simulation I (paper, IV-A): the weight of rods, after Mounoud & Bower (1974).

Four objects of one material, presented from short to long, then a decoy that looks like the last and weighs far less.
Each is put into the outstretched hand and held; what is felt updates the belief about the material before the next
is seen.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance import metrics
from affordance.exceptions import BadValueError
from affordance.memory import MaterialMemory
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.tools import MODELS, Colour, Tool, load_materials, load_tools
from affordance.trial import TrialRecord, get_runner

NAME = "weight"
QUARTILES = (0.25, 0.5, 0.75)


@dataclass(frozen=True)
class WeightConfig:
    """What is run.

    Attributes:
        tools: The honest objects in order of presentation, then the decoy.
        seed: Root of every random draw.
        settings: What all simulations share.
        duration: How long each object is held, [s].
    """

    tools: tuple[Tool, ...]
    seed: int = 0
    settings: Settings = DEFAULT_SETTINGS
    duration: float = 3.0

    @property
    def colour(self) -> Colour:
        """What all the objects look like."""
        return self.tools[0].components[0].looks_like.colour


def load_config(models: Path = MODELS, seed: int = 0) -> WeightConfig:
    """Reads the objects from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
    """
    path = models / "tools" / "weight.yaml"
    tools = load_tools(path, load_materials(models / "materials.yaml"))
    if len(tools) < 2:
        raise BadValueError(path, "tools", f"has {len(tools)} entry, must have at least 2: objects, then the decoy")
    looks = {component.looks_like for tool in tools for component in tool.components}
    if len(looks) > 1:
        names = ", ".join(sorted(look.name for look in looks))
        raise BadValueError(path, "tools", f"look like {names}, must all look like one material")
    honest = {component.material for tool in tools[:-1] for component in tool.components}
    if honest != looks:
        names = ", ".join(sorted(material.name for material in honest))
        raise BadValueError(path, "tools", f"before the decoy are made of {names}, must be of the one they look like")
    return WeightConfig(tools, seed, Settings(arm=models / "arm.dmd.yaml"))


def run_observer(config: WeightConfig, repeat: int) -> tuple[list[TrialRecord], NDArray[np.float64]]:
    """Runs one simulated observer through all trials.

    Args:
        config: What is run.
        repeat: Number of the observer; with the seed it determines every random draw.

    Returns: The K trials' records, and the quartiles of the believed density before the first and after each trial,
        shape (K + 1, 3), [kg/m^3].
    """
    runner = get_runner(config.settings)
    memory = MaterialMemory().meet([config.colour], config.settings.prior)
    quartiles = [memory.belief.compute_percentiles(QUARTILES)[:, 0]]
    records = []
    for trial, tool in enumerate(config.tools):
        record = runner.run_hold(tool, memory, duration=config.duration, seed=(config.seed, repeat, trial))
        memory = record.memory
        records.append(record)
        quartiles.append(memory.belief.compute_percentiles(QUARTILES)[:, 0])
    return records, np.stack(quartiles)


def run_repeat(config: WeightConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Runs one observer and keeps what is needed of it.

    Returns: Arrays over the K trials: ``times`` (N,), ``height_centre``, ``height_grip``, ``height_com`` (K, N),
        ``density_quartiles`` (K + 1, 3), ``log_evidence``, ``ticks_limited`` and ``ticks_failed`` (K,).
    """
    records, quartiles = run_observer(config, repeat)
    heights = ("height_centre", "height_grip", "height_com")
    return {
        "times": records[0].times,
        **{name: np.stack([getattr(record, name) for record in records]) for name in heights},
        "density_quartiles": quartiles,
        "log_evidence": np.array([record.log_evidence for record in records]),
        "ticks_limited": np.array([record.counts.limited for record in records]),
        "ticks_failed": np.array([record.counts.failed for record in records]),
    }
