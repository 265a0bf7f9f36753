"""Base of all experiments: one runner serves all, and an experiment defines its own steps."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self

from matplotlib.figure import Figure
from pydrake.systems.framework import Diagram

from affordance.arrays import Arrays
from affordance.experiments.shared.experience import Experience
from affordance.files.netcdf import Trajectories
from affordance.objects.tool import Tool
from affordance.reporting.section import PlainReport
from affordance.settings import Settings

# Observer of which figures, trajectories and replay show every detail.
OBSERVER_SHOWN = 0


@dataclass(frozen=True)
class Outputs:
    """Files that an experiment writes in addition to its numbers; each is made only when it is written.

    Figures are by name, without suffix; writers are functions that write further files to the experiment's folder, by
    their label in the progress bar.
    """

    figures: Mapping[str, Callable[[], Figure]]
    trajectories: Trajectories | None = None
    diagram: Callable[[], Diagram] | None = None
    replay: Callable[[Path], None] | None = None
    writers: Mapping[str, Callable[[Path], None]] = field(default_factory=dict)


class Experiment(ABC):
    """Experiment with its configuration; derived classes are frozen dataclasses that can be pickled.

    A run calls ``plan``, ``run_observer`` for every observer, ``compute_metrics`` and ``show``. By default observers
    share nothing, learn nothing before they are tested, and are one repeat each.
    """

    unit: ClassVar[str] = "observer"  # noun for one repeat in progress bars
    name: str  # name on the command line and of the folder of results
    section: Path  # section file or, for a protocol, the protocol's file
    # Report that a protocol describes; None for an experiment with a section file of the program.
    report: PlainReport | None = None
    seed: int  # root of every random draw
    settings: Settings

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """Objects that the camera sees, for the report."""
        return ()

    @property
    def files_read(self) -> tuple[Path, ...]:
        """Files read during the run, other than the arm's, whose content is not part of the configuration."""
        return ()

    def split(self) -> Sequence[tuple[str, Self]]:
        """Splits the experiment into parts with repeats of their own, each with a prefix for the names of its arrays.

        Each part has the observers of one learner, so that commands share repeats; most experiments are a single
        part.
        """
        return [("", self)]

    def count_repeats(self, observers: int) -> int:
        """Returns the number of repeats for a number of observers."""
        return observers

    def check_repeats(self, repeats: int) -> None:
        """Raises a BadValueError for more observers than the results of can be held in memory."""
        return None

    def plan(self, jobs: int) -> Any:
        """Plans and simulates what all observers share; a file that cannot be carried out raises a BadValueError."""
        return None

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> Experience | None:
        """Lets observers hold objects before they are tested, cached in a folder; None if they hold nothing."""
        return None

    def select_shared(self, plan: Any) -> Any:
        """Selects the part of the plan that observers need; it is sent to every process."""
        return None

    @abstractmethod
    def run_observer(self, shared: Any, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one repeat, whose number and seed determine every random draw; shapes of arrays are those of all."""

    @abstractmethod
    def compute_metrics(self, plan: Any, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json from arrays of all repeats, stacked along the first axis."""

    @abstractmethod
    def list_facts(self, plan: Any, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the facts that the section file names in addition to the numbers."""

    @abstractmethod
    def show(self, plan: Any, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]) -> Outputs:
        """Returns the outputs other than the numbers."""
