"""Simulates observers in parallel, stores their results, and joins them in a dataset."""

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
from affordance.runs.repeats import compute_key, run_batches, stack_repeats
from affordance.settings import DEFAULT_SETTINGS, Settings

# Number of the observer in figures, motions and the replay.
OBSERVER_SHOWN = 0
# Name of the array with dimensions and attributes of all other arrays.
_LABELS = "labels of variables"


def remember_nothing(record: Any) -> None:
    """Ignores a record, in runs without a lasting memory."""


@dataclass(frozen=True)
class Setup:
    """Setup of a run: number of observers, seed, folders and settings.

    Attributes:
        observers: Number of simulated observers.
        seed: Seed of the run, from which all other seeds are derived.
        jobs: Number of processes.
        models: Folder with arm, materials, tools, paths and tasks.
        out: Folder of the results of all experiments.
        settings: Settings of all simulations.
        known: Initial memory of the single observer, as JSON text; empty for a memory without experience.
        remember: Function that adds the record of a hold to a lasting memory
            (``simulated_trial.remember_in``).

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
        """Checks the fields, and converts texts to paths.

        Raises:
            BadArgumentError: A value is invalid.
        """
        check_fields(self)

    def change(self, **settings: Any) -> "Setup":
        """Returns a copy with changed settings, for example ``setup.change(learner="kinds_map")``."""
        return replace(self, settings=replace(self.settings, **settings))

    def start_memory(self, observer: int) -> MaterialMemory:
        """Returns the initial memory of an observer."""
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
    """Calls ``observe(setup, *inputs, observer)`` for each observer, and joins the datasets.

    The results of each observer are stored. They are computed again only after a change of seed, settings, inputs,
    arm, libraries, this program, or Python files in the folders of ``observe`` and its inputs.

    Args:
        name: Name of the experiment, and of its folder within the folder of results.
        setup: Setup of the experiment.
        observe: Function that simulates one observer. All datasets must have the same variables, dimensions and
            coordinates.
        inputs: Further arguments of ``observe``, the same for all observers.
        follows_from: Values from which large inputs are computed, and functions that compute them. Changes are
            detected in these instead of the inputs. None to detect changes in the inputs.
        unit: Noun for an observer in the progress bar.
        count: Number of observers; None for the number in the setup.
        at_once: Largest number of observers per call of ``observe``, which then has a list of their numbers as
            argument and returns a list of datasets. Datasets must not depend on other observers in the list. None if
            ``observe`` simulates one observer per call.

    Returns:
        Variables of all observers, with the additional dimension ``observer``.
    """
    given = (setup.seed, setup.settings, setup.known, inputs if follows_from is None else follows_from)
    programs = (observe, setup.settings.learner, setup.settings.noise, setup.settings.eye, setup.remember)
    programs += tuple(each for each in inputs if callable(each))
    key = compute_key(given, list_arm_files(setup.settings.arm), *filter(None, programs))
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
    return _join(stack_repeats(arrays))


def _observe_each(observe: Callable[[int], xr.Dataset], observers: Sequence[int]) -> list[xr.Dataset]:
    return [observe(observer) for observer in observers]


def _observe(observe: Callable[[Sequence[int]], Sequence[xr.Dataset]], observers: Sequence[int]) -> list[Arrays]:
    """Simulates observers, and returns the arrays of each observer by name."""
    return [_list_arrays(found.reset_coords()) for found in observe(observers)]


def _list_arrays(found: xr.Dataset) -> Arrays:
    variables = {str(name): each.variable for name, each in {**found.data_vars, **found.coords}.items()}
    labels = {name: {"dims": each.dims, "attrs": each.attrs} for name, each in variables.items()}
    return {_LABELS: np.array(json.dumps(labels)), **{name: each.values for name, each in variables.items()}}


def _join(arrays: Arrays) -> xr.Dataset:
    """Joins the arrays of all observers, with the coordinates of the first observer."""
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
    """Returns the height with the largest absolute value over time, with its sign, [m]."""
    return height.isel(time=abs(height).argmax("time"))
