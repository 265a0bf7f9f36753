"""Base of all experiments in which objects are presented: learners, numbers and files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.experiments.definition import Arrays
from affordance.experiments.shared.experience import Experience
from affordance.experiments.shared.hold_measures import get_measure, select_learner
from affordance.experiments.shared.presentation_rows import ROW, write_rows
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.layout import Layout, lay_out
from affordance.protocols.measured import MeasuredObservers, compute_numbers, compute_of_observers
from affordance.protocols.number_entries import FigureEntry, NumberEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.protocols.people import People, describe_people, list_people
from affordance.protocols.presentations import Presentation, weigh
from affordance.reporting.plain_report import PlainReport
from affordance.settings import Settings

# Quantiles of the belief that are always stored.
QUARTILES = (0.25, 0.5, 0.75)
LABELS = {
    Learner.DENSITY: "one density for each colour",
    Learner.KINDS_MAP: "kinds, most probable",
    Learner.KINDS_DRAWN: "kinds, drawn",
}


@dataclass(frozen=True)
class PresentedExperiment:
    """Experiment of a protocol in which objects are presented.

    Attributes:
        name: Name of the protocol.
        section: Path of the protocol's file.
        objects: Objects that are presented.
        blocks: Presentations, in order.
        learners: Learners that are simulated; figures of simulated presentations show the first.
        told: Materials whose densities observers know, by colour, [kg/m^3].
        models: Folder of models.
        seed: Root of every random draw.
        settings: Settings of all simulations.
        quantiles: Quantiles of beliefs that are stored.
        report: Report that the protocol describes.
        numbers: Numbers that are reported.
        figures: Figures that are drawn.
        people: Results of people.
    """

    name: str
    section: Path
    objects: ProtocolObjects
    blocks: tuple[BlockEntry, ...]
    learners: tuple[Learner, ...]
    told: tuple[tuple[Colour, float], ...]
    models: Path
    seed: int
    settings: Settings
    quantiles: tuple[float, ...]
    report: PlainReport = field(metadata={"reports": True})
    numbers: Mapping[str, NumberEntry] = field(metadata={"reports": True})
    figures: Mapping[str, FigureEntry] = field(metadata={"reports": True})
    people: People = field(metadata={"reports": True})

    unit = "observer"
    files_read = ()
    # True if nothing is simulated; and the names of the figures that can be drawn.
    is_closed_form: ClassVar[bool] = False
    drawn: ClassVar[tuple[str, ...]] = ()

    @property
    def tools(self) -> tuple[Tool, ...]:
        """Objects of the protocol."""
        return self.objects.tools

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """Objects that a camera sees."""
        return ()

    @property
    def colours(self) -> tuple[Colour, ...]:
        """Colours of all objects, in the order of their components."""
        return tuple(dict.fromkeys(part.looks_like.colour for tool in self.tools for part in tool.components))

    @property
    def layout(self) -> Layout:
        """Layout of the presentations that are measured."""
        return lay_out(self.blocks, self.objects.groups, is_closed_form=self.is_closed_form)

    def with_settings[E: "PresentedExperiment"](self: E, settings: Settings) -> E:
        """Returns the experiment with other settings."""
        return replace(self, settings=settings)

    def with_learners[E: "PresentedExperiment"](self: E, learners: Sequence[Learner]) -> E:
        """Returns the experiment with other learners."""
        return replace(self, learners=tuple(learners), settings=replace(self.settings, learner=learners[0]))

    def split[E: "PresentedExperiment"](self: E) -> list[tuple[str, E]]:
        """Returns one experiment per learner, with the prefix of the names of its arrays; see ``select_learner``."""
        return [
            (f"{learner.value}: " if place else "", self.with_learners([learner]))
            for place, learner in enumerate(self.learners)
        ]

    def count_repeats(self, observers: int) -> int:
        """Returns one repeat per observer."""
        return observers

    def plan(self, jobs: int) -> None:
        """Does nothing, as observers share nothing."""

    def select_shared(self, plan: None) -> None:
        """Returns None, as observers share nothing."""

    def draw_measured(self, repeat: int) -> list[Presentation]:
        """Draws the measured presentations of an observer."""
        return [each for each in self.draw_presentations(repeat) if self.blocks[each.block].measured]

    def draw_presentations(self, repeat: int) -> list[Presentation]:
        """Draws the presentations of an observer, the same for each learner."""
        raise NotImplementedError

    def run_learner(self, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one observer with the first learner; see ``run_observer``."""
        raise NotImplementedError

    def list_facts(self, plan: None, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns facts that the section file names in addition to the numbers."""
        raise NotImplementedError

    def run_observer(self, shared: None, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one observer with each learner; all are given the same presentations and errors of measurement.

        Returns: Arrays; the names of those of every learner but the first begin with the learner's name.
        """
        found: dict[str, Any] = {}
        for prefix, experiment in self.split():
            arrays = experiment.run_learner(experience, repeat)
            found |= {f"{prefix}{name}": array for name, array in arrays.items()}
        return found

    def compute_metrics(self, plan: None, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json; with several learners also those of each, and people's."""
        learners = {
            learner.value: compute_numbers(self.numbers, self.measure(self.select(arrays, learner)))
            for learner in self.learners
        }
        return self.assemble(learners)

    def assemble(self, learners: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
        """Assembles the numbers of metrics.json from those of each learner."""
        people = self.describe_people()
        return {
            **learners[self.learners[0].value],
            **({"learners": dict(learners)} if len(learners) > 1 else {}),
            **({"people": people} if people else {}),
        }

    def describe_people(self) -> dict[str, Any]:
        """Summarises people's results for the numbers of the protocol."""
        return describe_people(list_people(self.numbers, self.people, self.objects, self.blocks))

    def compute_of_observers(self, arrays: Arrays) -> dict[Learner, dict[str, Array]]:
        """Computes the numbers of each observer, by learner."""
        return {
            learner: compute_of_observers(self.numbers, self.measure(self.select(arrays, learner)))
            for learner in self.learners
        }

    def select(self, arrays: Arrays, learner: Learner) -> Arrays:
        """Selects the arrays of one learner."""
        return select_learner(arrays, learner, self.learners.index(learner))

    def measure(self, arrays: Arrays) -> MeasuredObservers:
        """Returns the measures of all observers of one learner, from their arrays."""
        layout = self.layout
        get = partial(get_measure, self.select_measured(arrays), self.quantiles)
        return MeasuredObservers(self.objects, arrays["presented"], get, layout.find_measured)

    def select_measured(self, arrays: Arrays) -> Arrays:
        """Selects the rows of the measured presentations; other arrays are left unchanged."""
        rows = {name for name in arrays if name.startswith(ROW)}
        if not rows:
            return arrays
        measured = np.array([self.blocks[index].measured for index in arrays[f"{ROW}block"][0]])
        return {name: array[:, measured] if name in rows else array for name, array in arrays.items()}

    def write_presentations(self, arrays: Arrays, folder: Path) -> None:
        """Writes lifts.csv, one row per presentation."""
        learners = {learner.value: self.select(arrays, learner) for learner in self.learners}
        write_rows(folder / "lifts.csv", learners, self.tools, [block.name for block in self.blocks])

    def weigh(self, presentation: Presentation) -> Tool:
        """Returns the object of a presentation with its mass in that presentation."""
        tool = self.tools[presentation.tool]
        return tool if presentation.mass is None else weigh(tool, presentation.mass)
