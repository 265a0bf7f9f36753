"""What an experiment is: one runner serves all, and an experiment says what differs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from matplotlib.figure import Figure
from numpy.typing import NDArray
from pydrake.systems.framework import Diagram

from affordance.experiments.shared.experience import Experience
from affordance.files.netcdf import Trajectories
from affordance.objects.tool import Tool
from affordance.reporting.plain_report import PlainReport
from affordance.settings import Settings

# The observer of which figures, trajectories and replay show every detail.
OBSERVER_SHOWN = 0

type Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Outputs:
    """What an experiment writes beside its numbers; what is drawn is drawn when it is written.

    Attributes:
        figures: By their names, without suffix.
        trajectories: None for none.
        diagram: The Diagram that was run; None for none.
        replay: Writes the arm in motion to a path; None for none.
        writers: What writes other files to the experiment's folder, by what they are called in the progress bar.
    """

    figures: Mapping[str, Callable[[], Figure]]
    trajectories: Trajectories | None = None
    diagram: Callable[[], Diagram] | None = None
    replay: Callable[[Path], None] | None = None
    writers: Mapping[str, Callable[[Path], None]] = field(default_factory=dict)


class Experiment(Protocol):
    """An experiment with its configuration, a frozen dataclass that can be pickled.

    A run goes through ``plan``, ``run_observer`` for every observer, ``compute_metrics``, and ``show``.
    """

    @property
    def name(self) -> str:
        """Of its folder and on the command line."""

    @property
    def unit(self) -> str:
        """What a repeat is, for progress bars."""

    @property
    def section(self) -> Path:
        """Its section file, or the protocol's file."""

    @property
    def report(self) -> PlainReport | None:
        """What a protocol says of its report; None of what has a section file of the program."""

    @property
    def seed(self) -> int:
        """Root of every random draw."""

    @property
    def settings(self) -> Settings:
        """What all simulations share."""

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """Objects that the camera sees, for the report."""

    @property
    def files_read(self) -> tuple[Path, ...]:
        """Files that are read while it runs, besides the arm's: what they hold is not in the configuration."""

    def with_settings(self, settings: Settings) -> "Experiment":
        """Returns the experiment with other settings."""

    def split(self) -> "Sequence[tuple[str, Experiment]]":
        """Experiments of which repeats are run and kept each by itself, by what the names of their arrays begin with.

        Each of observers of one learner, so that what one command simulated serves others; most are one themselves.
        """

    def count_repeats(self, observers: int) -> int:
        """How many repeats a number of observers takes."""

    def plan(self, jobs: int) -> Any:
        """Plans and simulates what all observers share, in processes.

        Raises:
            BadValueError: A file asks for what cannot be planned or carried out; nothing was written.
        """

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> Experience | None:
        """Lets observers hold objects before they are tested; None if they hold nothing.

        Args:
            folder: Keeps what they learn, for all experiments that share it.
            repeats: Number of observers.
            jobs: Processes.
        """

    def select_shared(self, plan: Any) -> Any:
        """What of the plan observers need; it goes to every process."""

    def run_observer(self, shared: Any, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one repeat; with the seed its number determines every random draw.

        Returns: Named arrays of a shape that is the same for all repeats.
        """

    def compute_metrics(self, plan: Any, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json.

        Args:
            plan: What all observers share.
            experience: What they held.
            arrays: Of all repeats, stacked along the first axis.
        """

    def list_facts(self, plan: Any, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """What the section file names beside the numbers."""

    def show(self, plan: Any, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]) -> Outputs:
        """What is written beside the numbers."""
