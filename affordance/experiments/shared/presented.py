"""Experiments in which objects are presented; the means, simulated or in closed form, are handed in."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from matplotlib.figure import Figure

from affordance.arrays import Array, Arrays
from affordance.belief.kind_memory import KAPPA, count_kinds, start_memory
from affordance.belief.learner import Learner
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.exceptions import BadValueError
from affordance.experiments.definition import Experiment, Outputs
from affordance.experiments.shared.experience import Experience, ExperienceConfig, build_experience
from affordance.experiments.shared.hold_measures import ROW, get_measure
from affordance.experiments.shared.presentation_rows import (
    Presented,
    describe_experience,
    describe_presentation,
    stack_rows,
    write_rows,
)
from affordance.experiments.shared.recall import recall, recall_all
from affordance.experiments.shared.trajectories import stack_presentations
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, list_colours
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.measured import MeasuredObservers, compute_numbers, compute_of_observers
from affordance.protocols.number_entries import FigureEntry, NumberEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.protocols.people import People, describe_people, list_people
from affordance.protocols.presentations import (
    Layout,
    Presentation,
    count_presentations,
    draw_presentations,
    lay_out,
    weigh,
)
from affordance.reporting.section import PlainReport
from affordance.runs.random_streams import Stream
from affordance.settings import Settings

# Quantiles of the belief that are always stored.
QUARTILES = (0.25, 0.5, 0.75)
# Most presentations of all observers of a run: the numbers of one take 120 bytes, several times.
_MOST_PRESENTATIONS = 2_000_000

# Function that returns a function for each of the figures of all observers, from their arrays.
type DrawFigures = Callable[[PresentationExperiment, Arrays], Mapping[str, Callable[[], Figure]]]


class Means(ABC):
    """Means by which objects are presented to an observer of one learner, and the figures that can be drawn of it."""

    is_closed_form: ClassVar[bool]
    drawn: ClassVar[tuple[str, ...]]

    @abstractmethod
    def seed_orders(self, seed: int, repeat: int, count: int) -> Sequence[np.random.Generator]:
        """Returns the random generator of the order of each block."""

    def gain_experience(
        self, config: ExperienceConfig, folder: Path, *, repeats: int, jobs: int
    ) -> Experience | None:
        """Lets observers gain experience that is cached; None where it is as cheap to gain again."""
        return None

    @abstractmethod
    def present(
        self, experiment: "PresentationExperiment", memory: Memory, drawn: Sequence[Presentation], repeat: int
    ) -> list[Presented]:
        """Presents objects to an observer with a memory, one after another."""

    @abstractmethod
    def describe_beliefs(self, experiment: "PresentationExperiment", memories: Sequence[Memory]) -> dict[str, Array]:
        """Returns ``density_mode`` (K + 1,), and quantiles, of the density of the first material at each moment."""

    @abstractmethod
    def list_facts(self, experiment: "PresentationExperiment", numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns facts that the section file names; those that need numbers are left out while there are none."""

    @abstractmethod
    def show(self, experiment: "PresentationExperiment", experience: Experience | None, arrays: Arrays) -> Outputs:
        """Returns the outputs other than the numbers, lifts.csv and the figures of all observers."""


@dataclass(frozen=True)
class PresentationExperiment(Experiment):
    """Experiment of a protocol in which objects are presented.

    Simulations I and II of the paper (IV-A, IV-B), Linear+ and Linear++ (Cesanek and others 2021) are some of them.
    Each learner is simulated, and figures of simulated presentations show the first. Densities that observers are
    told are by colour, [kg/m^3]; quantiles are those of beliefs that are stored; kappa is the breadth of a category
    relative to its mean, None for the fitted value.
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
    means: Means
    report: PlainReport = field(metadata={"reports": True})
    numbers: Mapping[str, NumberEntry] = field(metadata={"reports": True})
    figures: Mapping[str, FigureEntry] = field(metadata={"reports": True})
    people: People = field(metadata={"reports": True})
    draw: DrawFigures = field(metadata={"reports": True})
    kappa: float | None = None

    @property
    def tools(self) -> tuple[Tool, ...]:
        """Objects of the protocol."""
        return self.objects.tools

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """All objects, as the camera sees each of them; none in closed form."""
        return () if self.means.is_closed_form else self.tools

    @property
    def duration(self) -> float:
        """Duration of a hold in the last block with holds, [s]; 0 without any."""
        return next((block.do.duration for block in self.blocks[::-1] if block.do.duration), 0.0)

    @property
    def experience(self) -> ExperienceConfig | None:
        """Experience gained in an unmeasured first block, which protocols share; None without such a block."""
        return build_experience(self.blocks[0], self.objects, self.learners, self.told, self.seed, self.settings)

    @property
    def colours(self) -> tuple[Colour, ...]:
        """Colours of all objects, in the order of their components."""
        return list_colours(self.tools)

    @property
    def layout(self) -> Layout:
        """Layout of the presentations that are measured."""
        return lay_out(self.blocks, self.objects.groups, is_closed_form=self.means.is_closed_form)

    def with_learners(self, learners: Sequence[Learner]) -> "PresentationExperiment":
        """Returns the experiment with other learners."""
        return replace(self, learners=tuple(learners), settings=replace(self.settings, learner=learners[0]))

    def split(self) -> list[tuple[str, "PresentationExperiment"]]:
        """Returns one experiment per learner, with the prefix of the names of its arrays; see ``select``."""
        return [
            (f"{learner.value}: " if place else "", self.with_learners([learner]))
            for place, learner in enumerate(self.learners)
        ]

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> Experience | None:
        """Lets observers learn in a first block that is not measured; returns None without such a block."""
        config = self.experience
        return None if config is None else self.means.gain_experience(config, folder, repeats=repeats, jobs=jobs)

    def check_repeats(self, repeats: int) -> None:
        """Raises a BadValueError for more observers than memory holds the presentations of."""
        count = len(self.learners) * sum(count_presentations(each, self.objects.groups) for each in self.blocks)
        if repeats * count > _MOST_PRESENTATIONS:
            problem = f"is {repeats}, must be at most {_MOST_PRESENTATIONS // count} with {count} presentations each"
            raise BadValueError("--repeats", "", problem)

    def draw_measured(self, repeat: int) -> list[Presentation]:
        """Draws the measured presentations of an observer."""
        return [each for each in self.draw_presentations(repeat) if self.blocks[each.block].measured]

    def draw_presentations(self, repeat: int) -> list[Presentation]:
        """Draws the presentations of an observer, block by block, the same for each learner."""
        rngs = self.means.seed_orders(self.seed, repeat, len(self.blocks))
        return [
            presentation
            for index, (block, rng) in enumerate(zip(self.blocks, rngs, strict=True))
            for presentation in draw_presentations(block, index, self.objects, rng, repeat)
        ]

    def present(self, experience: Experience | None, repeat: int) -> list[Presented]:
        """Presents the objects, measured or not, to an observer; those of the first block only if not yet learned."""
        drawn = self.draw_presentations(repeat)
        if experience is not None:
            drawn = [each for each in drawn if each.block]
            memory = recall(experience, repeat, experience.num_trials)  # which has the colours of its objects only
            return self.means.present(self, self._add_colours(memory), drawn, repeat)
        memory = start_memory(self.learners[0], (self.seed, repeat, Stream.KINDS), self.kappa)
        if self.told:
            memory = MaterialMemory.from_densities(dict(self.told))
        if not self.means.is_closed_form:  # which reports the densities of all colours
            memory = self._add_colours(memory)
        return self.means.present(self, memory, drawn, repeat)

    def _add_colours(self, memory: Memory) -> Memory:
        """Returns a memory with the colours of all objects, and no others."""
        return memory.add_colours(self.colours, self.settings.prior).restrict_to(self.colours)

    def run_learner(self, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one observer with the first learner.

        Returns: Arrays over the K measured presentations: if simulated ``times`` (N,), heights (K, N) and counts;
            measures and ``presented``, the index of the object, (K,); over the K + 1 moments between them
            ``density_mode`` (K + 1,) and ``density_quantiles`` (K + 1, Q) of the first material; and rows of all
            presentations, whose names begin with ROW.
        """
        presented = self.present(experience, repeat)
        rows = [describe_presentation(each, self.settings.prior) for each in presented]
        if experience is not None:
            config = self.experience
            assert config is not None  # or there would be none
            places = self.objects.groups[self.blocks[0].objects]
            rows = [*describe_experience(config, experience, recall_all(experience, repeat), places, repeat), *rows]
        measured = [each for each in presented if self.blocks[each.presentation.block].measured]
        founds = [count_kinds(after) > count_kinds(before) for before, after in (each.memories for each in measured)]
        numbers = [{**each.numbers, "founds_a_kind": founded} for each, founded in zip(measured, founds, strict=True)]
        moments = [presented[0].memories[0], *(each.memories[1] for each in measured)]
        return {
            **stack_presentations([each.record for each in measured], numbers),
            "presented": np.array([each.presentation.tool for each in measured], dtype=np.intp),
            **self.means.describe_beliefs(self, moments),
            **stack_rows(rows),
        }

    def run_observer(self, shared: None, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one observer with each learner; all are given the same presentations and errors of measurement.

        Names of the arrays of every learner but the first begin with the learner's name.
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
        """Assembles the numbers of metrics.json from those of each learner; in closed form all keys are given."""
        every = self.means.is_closed_form
        people = describe_people(list_people(self.numbers, self.people, self.objects, self.blocks))
        kappa = {learner.value: KAPPA[learner.pick] for learner in self.learners if learner.pick is not None}
        return {
            **learners[self.learners[0].value],
            **({"learners": dict(learners)} if every or len(learners) > 1 else {}),
            **({"people": people} if every or people else {}),
            **({"kappa": kappa} if every else {}),
        }

    def compute_of_observers(self, arrays: Arrays) -> dict[Learner, dict[str, Array]]:
        """Computes the numbers of each observer, by learner."""
        return {
            learner: compute_of_observers(self.numbers, self.measure(self.select(arrays, learner)))
            for learner in self.learners
        }

    def select(self, arrays: Arrays, learner: Learner) -> Arrays:
        """Selects the arrays of one learner; see ``split``."""
        if learner is self.learners[0]:
            return {name: array for name, array in arrays.items() if ": " not in name}
        prefix = f"{learner.value}: "
        return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}

    def measure(self, arrays: Arrays) -> MeasuredObservers:
        """Returns the measures of all observers of one learner, from their arrays; rows of measured presentations."""
        rows = [name for name in arrays if name.startswith(ROW)]
        if rows:
            measured = np.array([self.blocks[index].measured for index in arrays[f"{ROW}block"][0]])
            arrays = {**arrays, **{name: arrays[name][:, measured] for name in rows}}
        get = partial(get_measure, arrays, self.quantiles)
        return MeasuredObservers(self.objects, arrays["presented"], get, self.layout.find_measured)

    def list_facts(self, plan: None, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the names of the objects, and further facts of the means."""
        return {"names": [tool.name for tool in self.tools], **self.means.list_facts(self, numbers)}

    def show(self, plan: None, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]) -> Outputs:
        """Returns figures, trajectories, Diagram and replay, as the means have them, and lifts.csv."""
        shown = self.means.show(self, experience, arrays)
        figures = {**self.draw(self, arrays), **shown.figures}
        lifts = {"lifts": partial(self.write_presentations, arrays)}
        return replace(shown, figures=figures, writers={**lifts, **shown.writers})

    def write_presentations(self, arrays: Arrays, folder: Path) -> None:
        """Writes lifts.csv, one row per presentation."""
        learners = {learner.value: self.select(arrays, learner) for learner in self.learners}
        write_rows(folder / "lifts.csv", learners, self.tools, [block.name for block in self.blocks])

    def weigh(self, presentation: Presentation) -> Tool:
        """Returns the object of a presentation with its mass in that presentation."""
        tool = self.tools[presentation.tool]
        return tool if presentation.mass is None else weigh(tool, presentation.mass)
