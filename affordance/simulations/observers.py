"""Observers of an experiment in parallel processes, as one labelled dataset; finished observers are kept."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from affordance.arrays import Arrays
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.exceptions import BadValueError
from affordance.files.model_files import list_arm_files
from affordance.files.model_folder import MODELS
from affordance.memory.same_colours import SameColours
from affordance.runs.random_streams import Stream
from affordance.runs.repeats import compute_key, run_repeats
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.trial_record import TrialRecord
from affordance.simulations.lasting_memory import LastingMemory, recall_lasting

# Observer of which figures, motions and the replay show every detail.
OBSERVER_SHOWN = 0
# Name of the array that labels the others of an observer: dimensions and attributes.
_LABELS = "labels of variables"


@dataclass(frozen=True)
class Setup:
    """What a user asks of an experiment.

    Attributes:
        observers: Number of simulated observers.
        seed: Root of every random draw.
        jobs: Number of processes.
        models: Folder with arm, materials, tools, paths and tasks.
        out: Folder of the results of all experiments.
        settings: Settings of all simulations.
        lasting: Memory in a file with which the one observer begins, and to which what it feels is added; see
            ``remember_in``.
    """

    observers: int = 200
    seed: int = 0
    jobs: int = 1
    models: Path = MODELS
    out: Path = Path("results")
    settings: Settings = DEFAULT_SETTINGS
    lasting: LastingMemory | None = None

    def change(self, **settings: Any) -> "Setup":
        """Returns the setup with other settings: ``setup.change(learner="kinds_map")``."""
        return replace(self, settings=replace(self.settings, **settings))

    def start_memory(self, observer: int) -> MaterialMemory:
        """Returns the memory with which an observer begins."""
        if self.lasting is not None:
            return self.lasting.recall()
        return start_memory(self.settings.learner.of_observers([observer]), (self.seed, observer, Stream.KINDS))

    def remember(self, record: TrialRecord) -> None:
        """Adds what was felt in a trial to the lasting memory, if there is one."""
        if self.lasting is not None:
            self.lasting.append(record)

    def remember_in(self, place: Path | str, same_colours: SameColours = ()) -> "Setup":
        """Returns the setup of one observer who begins with a lasting memory, and adds to it what it feels.

        The number of remembered trials is added to the seed, so that no error of measurement is drawn again. Settings
        must not be changed afterwards, as the learner's belief depends on them. Arguments and errors are those of
        ``recall_lasting``; a BadValueError is also raised for several observers.
        """
        if self.observers != 1:
            problem = f"is {self.observers}, must be 1 with a memory, which is of one observer"
            raise BadValueError("--repeats", "", problem)
        lasting = recall_lasting(str(place), self.settings, self.seed, same_colours)
        return replace(self, lasting=lasting, seed=self.seed + lasting.trials)


def run_observers(
    name: str,
    setup: Setup,
    observe: Callable[..., xr.Dataset],
    *inputs: Any,
    follows_from: Any = None,
    unit: str = "observer",
    count: int | None = None,
) -> xr.Dataset:
    """Runs ``observe(setup, *inputs, observer)`` for each observer, and joins the datasets along ``observer``.

    An observer that is finished is kept, and not run again, under a key of seed, settings, inputs, arm, libraries,
    this program, and the sources and values of the module of ``observe`` and of all that it imports.

    Args:
        name: Name of the experiment, and of its folder in that of the results.
        setup: Setup of the experiment.
        observe: Function that runs one observer; variables, dimensions and coordinates are the same for all.
        inputs: Further arguments, the same for all observers.
        follows_from: Value that determines the inputs, where they are large; None for the inputs themselves.
        unit: Noun for an observer in the progress bar.
        count: Number of observers; None for that of the setup.
    """
    given = [setup.seed, setup.settings, setup.lasting, inputs if follows_from is None else follows_from]
    functions = [observe, *(each for each in inputs if callable(each))]
    key = compute_key(given, list_arm_files(setup.settings.arm), functions=functions)
    arrays = run_repeats(
        setup.out / name / "repeats" / key,
        partial(_observe, observe, setup, inputs),
        repeats=setup.observers if count is None else count,
        jobs=setup.jobs,
        description=name,
        unit=unit,
    )
    return _join(arrays)


def about(units: str, long_name: str) -> dict[str, str]:
    """Returns the attributes of a variable: its unit ("1" for a number without one) and its meaning."""
    return {"units": units, "long_name": long_name}


def _observe(observe: Callable[..., xr.Dataset], setup: Setup, inputs: tuple[Any, ...], observer: int) -> Arrays:
    """Runs an observer; returns its arrays by variable, and dimensions and attributes of all variables as JSON."""
    found = observe(setup, *inputs, observer).reset_coords()
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
