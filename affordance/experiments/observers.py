"""Observers of an experiment in parallel processes, as one labelled dataset; finished observers are kept."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr

from affordance.arguments import JOBS, REPEATS
from affordance.arrays import Arrays
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.belief.memory_file import parse_memory
from affordance.files.constraints import SEEDS, check_fields
from affordance.files.model_files import list_arm_files
from affordance.files.model_folder import MODELS
from affordance.runs.random_streams import Stream
from affordance.runs.repeats import compute_key, run_batches
from affordance.settings import DEFAULT_SETTINGS, Settings

# Observer of which figures, motions and the replay show every detail.
OBSERVER_SHOWN = 0
# Name of the array that labels the others of an observer: dimensions and attributes.
_LABELS = "labels of variables"


def remember_nothing(record: Any) -> None:
    """Remembers nothing."""


@dataclass(frozen=True)
class Setup:
    """Number of observers, seed, folders and settings of a run.

    Attributes:
        observers: Number of simulated observers.
        seed: Root of every random draw.
        jobs: Number of processes.
        models: Folder with arm, materials, tools, paths and tasks.
        out: Folder of the results of all experiments.
        settings: Settings of all simulations.
        known: What a lasting memory knows, with which the one observer begins, as JSON text; empty for nothing.
        remember: Function that is given the record of each hold, and adds it to a lasting memory
            (``lasting_memory.remember_in``).

    Example:
        >>> from affordance import Setup
        >>> setup = Setup(observers=20, jobs=2, out="my_results")
        >>> setup.observers, str(setup.out)
        (20, 'my_results')
    """

    observers: Annotated[int, REPEATS] = 200
    seed: Annotated[int, SEEDS] = 0
    jobs: Annotated[int, JOBS] = 1
    models: Path = MODELS
    out: Path = Path("results")
    settings: Settings = DEFAULT_SETTINGS
    known: str = ""
    remember: Callable[[Any], None] = field(default=remember_nothing, metadata={"reports": True})

    def __post_init__(self) -> None:
        """Checks the fields, and makes paths of texts; a wrong one raises a BadArgumentError."""
        check_fields(self)

    def change(self, **settings: Any) -> "Setup":
        """Returns the setup with other settings: ``setup.change(learner="kinds_map")``."""
        return replace(self, settings=replace(self.settings, **settings))

    def start_memory(self, observer: int) -> MaterialMemory:
        """Returns the memory with which an observer begins."""
        learner = self.settings.learner.of_observers([observer])
        if self.known:
            return parse_memory(self.known, learner)
        return start_memory(learner, (self.seed, observer, Stream.KINDS))


def run_observers(
    name: str,
    setup: Setup,
    observe: Callable[..., Any],
    *inputs: Any,
    follows_from: Any = None,
    unit: str = "observer",
    count: int | None = None,
    at_once: int | None = None,
) -> xr.Dataset:
    """Runs ``observe(setup, *inputs, observer)`` for each observer, and joins the datasets along ``observer``.

    An observer that is finished is kept, and not run again, under a key of seed, settings, inputs, arm, libraries,
    this program, and whatever else ``observe`` reaches, in whichever files and of whatever type (``describe_run``).

    Args:
        name: Name of the experiment, and of its folder in that of the results.
        setup: Setup of the experiment.
        observe: Function that runs one observer; variables, dimensions and coordinates are the same for all.
        inputs: Further arguments, the same for all observers.
        follows_from: Values from which the inputs follow, and functions that make them, where inputs are large or
            are those of each observer; None for the inputs themselves.
        unit: Noun for an observer in the progress bar.
        count: Number of observers; None for that of the setup.
        at_once: Most observers that ``observe`` runs at once: it is then given a list of their numbers, and returns
            a list of datasets, each of which must depend on no other observer. None if it runs one.
    """
    given = [
        setup.seed,
        setup.settings,
        setup.known,
        setup.remember,
        inputs if follows_from is None else follows_from,
    ]
    given += [each for each in inputs if callable(each)]
    key = compute_key("", list_arm_files(setup.settings.arm), function=observe, given=given)
    each = partial(observe, setup, *inputs)
    arrays = run_batches(
        setup.out / name / "repeats" / key,
        partial(_observe, each if at_once else partial(_observe_each, each)),
        repeats=setup.observers if count is None else count,
        jobs=setup.jobs,
        description=name,
        unit=unit,
        at_once=at_once or 1,
    )
    return _join(arrays)


def _observe_each(observe: Callable[[int], xr.Dataset], observers: Sequence[int]) -> list[xr.Dataset]:
    return [observe(observer) for observer in observers]


def _observe(observe: Callable[[Sequence[int]], Sequence[xr.Dataset]], observers: Sequence[int]) -> list[Arrays]:
    """Runs observers; returns their arrays by variable, and dimensions and attributes of all variables as JSON."""
    return [_list_arrays(found.reset_coords()) for found in observe(observers)]


def _list_arrays(found: xr.Dataset) -> Arrays:
    variables = {str(name): each.variable for name, each in {**found.data_vars, **found.coords}.items()}
    labels = {name: {"dims": each.dims, "attrs": each.attrs} for name, each in variables.items()}
    return {_LABELS: np.array(json.dumps(labels)), **{name: each.values for name, each in variables.items()}}


def _join(arrays: Arrays) -> xr.Dataset:
    """Joins the arrays of all observers; coordinates, each along its own dimension, are those of the first."""
    labels = json.loads(str(arrays[_LABELS][0]))
    data: dict[str, Any] = {}
    coords: dict[str, Any] = {}
    for name, label in labels.items():
        dims, stacked = label["dims"], np.asarray(arrays[name])
        if dims == [name]:
            coords[name] = (dims, stacked[0], label["attrs"])
        else:
            data[name] = (("observer", *dims), stacked, label["attrs"])
    return xr.Dataset(data, coords)


def find_excursion(height: xr.DataArray) -> xr.DataArray:
    """Finds the height of largest magnitude over time, with its sign."""
    return height.isel(time=abs(height).argmax("time"))
