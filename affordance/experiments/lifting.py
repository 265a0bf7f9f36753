"""Protocols of many lifts in closed form: forces against a clamp before release, for each learner, beside people's.

Linear+ and Linear++ (Cesanek and others 2021) are two of them, models/protocols/linear_plus.yaml and
linear_plus_plus.yaml.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from affordance.belief.kinds_summary import count_kinds
from affordance.belief.learner import Learner
from affordance.belief.learners import KAPPA, start_memory
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.exceptions import BadValueError, describe_choice
from affordance.experiments.definition import Arrays, Outputs
from affordance.experiments.shared.checks import check_tools_can_be_held
from affordance.experiments.shared.experience import Experience
from affordance.experiments.shared.observers import apply_observers, list_told
from affordance.files.netcdf import LabelledArray, Trajectories
from affordance.named_settings import NO_CHANGES, Changes
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.measured import (
    OF_OBJECTS,
    MeasuredObservers,
    compute_numbers,
    compute_of_observers,
    compute_volume,
    select_presentations,
)
from affordance.protocols.number_entries import FigureEntry, Measure, NumberEntry
from affordance.protocols.object_entries import ProtocolObjects, build_objects, find_file
from affordance.protocols.people import describe_people, list_people
from affordance.protocols.presentations import Presentation, draw_presentations, weigh
from affordance.protocols.protocol import Protocol
from affordance.protocols.published import PublishedTable, load_published
from affordance.random_streams import Stream
from affordance.reporting.lift_figures import LiftCurve, PeopleMark, draw_lifts
from affordance.settings import Settings
from affordance.simulation.static_lifts import Lift, StaticLifter, check_closed_form
from affordance.vision.features import FeatureSource

LABELS = {
    Learner.DENSITY: "one density for each colour",
    Learner.KINDS_MAP: "kinds, most probable",
    Learner.KINDS_DRAWN: "kinds, drawn",
}
# Measures that are kept of every lift.
_KEPT = {Measure.FORCE: "force", Measure.WEIGHT: "weight", Measure.FOUNDS_KIND: "founds_kind"}


@dataclass(frozen=True)
class LiftExperiment:
    """A protocol of lifts in closed form.

    Attributes:
        name: Of the protocol.
        section: The protocol's file.
        objects: Those that are lifted.
        blocks: Presentations, in order.
        learners: What observers learn by; each is simulated.
        told: Materials whose densities observers know, by colour, [kg/m^3].
        seed: Root of every random draw.
        settings: What all simulations share.
        believes: Quantiles of the belief that are kept of every lift; none if no number asks for one.
        kappa: Breadth of a category over its mean; None for the fitted one.
        numbers: What is reported.
        figures: What is drawn.
        people: What people did; None if nobody has done it.
    """

    name: str
    section: Path
    objects: ProtocolObjects
    blocks: tuple[BlockEntry, ...]
    learners: tuple[Learner, ...]
    told: tuple[tuple[Colour, float], ...]
    seed: int
    settings: Settings
    believes: tuple[float, ...]
    kappa: float | None
    numbers: Mapping[str, NumberEntry] = field(metadata={"reports": True})
    figures: Mapping[str, FigureEntry] = field(metadata={"reports": True})
    people: PublishedTable | None = field(metadata={"reports": True})

    unit = "observer"
    tools_observed = ()
    files_read = ()

    @property
    def tools(self) -> tuple[Tool, ...]:
        """All objects."""
        return self.objects.tools

    def with_settings(self, settings: Settings) -> "LiftExperiment":
        """Returns the experiment with other settings."""
        return replace(self, settings=settings)

    def count_repeats(self, observers: int) -> int:
        """One repeat an observer."""
        return observers

    def plan(self, jobs: int) -> None:
        """Nothing is shared."""

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> None:
        """All that is learned is learned in the lifts."""

    def select_shared(self, plan: None) -> None:
        """Nothing is shared."""

    def draw_presentations(self, repeat: int) -> list[Presentation]:
        """Draws an observer's lifts, the same for each learner."""
        rng = np.random.default_rng([self.seed, repeat, Stream.LIFT_ORDER])
        return [
            presentation
            for index, block in enumerate(self.blocks)
            for presentation in draw_presentations(block, index, self.objects, rng, repeat)
        ]

    def run_observer(self, shared: None, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one observer with each learner, who is given the same lifts and errors of feeling.

        Returns: ``presented`` (K,), which object was lifted, and by the name of each learner over the K lifts
            ``force`` and ``weight``, [N], ``founds_kind``, and ``belief`` (K + 1, Q), if it is asked for.
        """
        drawn = self.draw_presentations(repeat)
        tools = list(self.tools)
        lifts = []
        for presentation in drawn:
            place = presentation.tool
            if presentation.mass is not None:
                place = len(tools)
                tools.append(weigh(self.tools[presentation.tool], presentation.mass))
            block = self.blocks[presentation.block]
            lifts.append(Lift(place, block.teaches and block.do.look is None))
        lifter = StaticLifter(tools, self.settings)
        measured = np.array([self.blocks[each.block].measured for each in drawn])
        arrays: dict[str, Any] = {"presented": np.array([each.tool for each in drawn], dtype=np.intp)[measured]}
        for learner in self.learners:
            record = lifter.run(lifts, self._start(learner, repeat), (self.seed, repeat, Stream.LIFT))
            kinds = np.array([count_kinds(memory) for memory in record.memories])
            arrays[f"{learner.value}: force"] = record.force[measured]
            arrays[f"{learner.value}: weight"] = record.weight[measured]
            arrays[f"{learner.value}: founds_kind"] = np.diff(kinds)[measured] > 0
            if self.believes:
                chosen = [0, *(1 + np.flatnonzero(measured))]
                beliefs = [record.memories[each].belief.compute_percentiles(self.believes)[:, 0] for each in chosen]
                arrays[f"{learner.value}: belief"] = np.array(beliefs)
        return arrays

    def measure(self, arrays: Arrays, learner: Learner) -> MeasuredObservers:
        """What was measured of the observers of a learner."""
        return MeasuredObservers(self.objects, arrays["presented"], partial(self._get, arrays, learner))

    def compute_metrics(self, plan: None, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes ``learners``, ``people`` and ``kappa``, and on top the numbers of the first learner."""
        learners = {
            learner.value: compute_numbers(self.numbers, self.measure(arrays, learner)) for learner in self.learners
        }
        kappa = {learner.value: KAPPA[learner.pick] for learner in self.learners if learner.pick is not None}
        people = {} if self.people is None else describe_people(list_people(self.numbers, self.people))
        return {**learners[self.learners[0].value], "learners": learners, "people": people, "kappa": kappa}

    def compute_of_observers(self, arrays: Arrays) -> dict[Learner, dict[str, Any]]:
        """The numbers of each observer, by learner."""
        return {
            learner: compute_of_observers(self.numbers, self.measure(arrays, learner)) for learner in self.learners
        }

    def list_facts(self, plan: None, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Names of objects and learners."""
        return {
            "names": [tool.name for tool in self.tools],
            "rows": {
                **{LABELS[each]: numbers["learners"][each.value] for each in self.learners},
                **({"people": numbers["people"]} if numbers["people"] else {}),
            },
        }

    def show(self, plan: None, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]) -> Outputs:
        """A figure of lifts for each that the protocol asks for, and all forces."""
        axes = ("observer", "lift")
        variables = {"tool": LabelledArray(axes, arrays["presented"], "1", "place of the object among the names")}
        for learner in self.learners:
            meaning = f"upward force before release, {LABELS[learner]}"
            variables[f"force_{learner.value}"] = LabelledArray(axes, arrays[f"{learner.value}: force"], "N", meaning)
        variables["weight"] = LabelledArray(axes, arrays[f"{self.learners[0].value}: weight"], "N", "true weight")
        return Outputs(
            figures={
                name: partial(self._draw, entry, arrays)
                for name, entry in self.figures.items()
                if entry.draw == "lifts"
            },
            trajectories=Trajectories(variables, {"object": [tool.name for tool in self.tools]}),
        )

    def _start(self, learner: Learner, repeat: int) -> Memory:
        if self.told:
            return MaterialMemory.from_densities(dict(self.told))
        return start_memory(learner, (self.seed, repeat, Stream.KINDS), self.kappa)

    def _get(self, arrays: Arrays, learner: Learner, measure: Measure, quantile: float) -> Any:
        """A measure of all observers of a learner; see ``MeasuredObservers``."""
        if measure is Measure.DENSITY:
            return arrays[f"{learner.value}: belief"][..., self.believes.index(quantile)]
        return arrays[f"{learner.value}: {_KEPT[measure]}"]

    def _draw(self, entry: FigureEntry, arrays: Arrays) -> Any:
        """Draws the lifts of a group, a panel a learner."""
        group = self.objects.groups[entry.of]
        curves = []
        for learner in self.learners:
            forces = select_presentations(arrays[f"{learner.value}: force"], arrays["presented"], group)
            predicted = None
            if entry.predicted_from is not None:
                predicted = self._predict(entry, arrays, learner)
            curves.append(LiftCurve(LABELS[learner], forces, predicted))
        weights = select_presentations(arrays[f"{self.learners[0].value}: weight"], arrays["presented"], group)
        return draw_lifts(curves, weights=weights[0], people=self._mark(entry, weights.shape[1]), title=entry.title)

    def _predict(self, entry: FigureEntry, arrays: Arrays, learner: Learner) -> Any:
        """What the forces of another group since the last lift drawn predict for the next, (R, C)."""
        drawn = self.objects.groups[entry.of]
        others = self.objects.groups[entry.predicted_from or entry.of]
        rows = []
        for tools, forces in zip(arrays["presented"], arrays[f"{learner.value}: force"], strict=True):
            rows.append(predict_between(tools, forces, drawn=drawn, others=others, tools_there_are=self.tools))
        return np.array(rows)

    def _mark(self, entry: FigureEntry, count: int) -> list[PeopleMark]:
        """Where people's forces lie among so many lifts: those of numbers of the group that is drawn."""
        if self.people is None:
            return []
        found = list_people(self.numbers, self.people)
        marks = []
        for name, number in self.numbers.items():
            if name not in found or number.measure is not Measure.FORCE:
                continue
            if number.of == entry.of:
                first, last = (1, number.first or count) if number.last is None else (count - number.last + 1, count)
                marks.append(PeopleMark(number.meaning or name, found[name], first, last))
            elif number.predicted_for == entry.of:
                marks.append(PeopleMark(number.meaning or name, found[name], count + 1, count + 1))
        return marks


def predict_between(
    presented: Any, forces: Any, *, drawn: Sequence[int], others: Sequence[int], tools_there_are: Sequence[Tool]
) -> list[float]:
    """What a line through forces and volumes of other objects says for those drawn, after each lift of theirs.

    Args:
        presented: Which object was lifted, (K,).
        forces: (K,), [N].
        drawn: Objects that are predicted for.
        others: Objects that predict, in the lifts from one of the drawn to the next.
        tools_there_are: All objects.
    """
    volumes = np.array([compute_volume(tool) for tool in tools_there_are])
    places = np.flatnonzero(np.isin(presented, drawn))
    predicted = []
    for start, end in zip(places, [*places[1:], len(presented)], strict=True):
        between = np.arange(start, end)
        chosen = between[np.isin(presented[between], others)]
        if len(np.unique(presented[chosen])) < 2:
            predicted.append(np.nan)
            continue
        slope, intercept = np.polyfit(volumes[presented[chosen]], forces[chosen], 1)
        predicted.append(float(intercept + slope * volumes[presented[start]]))
    return predicted


def build_lift_experiment(
    protocol: Protocol, path: Path, models: Path, seed: int, settings: Settings, changes: Changes = NO_CHANGES
) -> LiftExperiment:
    """Builds the experiment of a protocol of lifts in closed form.

    Raises:
        BadValueError: A file is wrong, or something is asked for that the closed form does not know.
        ModelFileError: The arm cannot be loaded or is not fit.
    """
    settings, learners = apply_observers(protocol, path, models, settings, changes)
    check_closed_form(settings)
    settings = replace(settings, feature_source=FeatureSource.FEATURES)  # sizes are exact
    if protocol.observers.vision == FeatureSource.PIXELS.value:
        raise BadValueError(path, "observers.vision", "is 'pixels', must be 'features' of lifts in closed form")
    known = [*_KEPT, Measure.DENSITY, *OF_OBJECTS]
    for name, entry in protocol.numbers.items():
        if entry.measure is not None and entry.measure not in known:
            problem = describe_choice(entry.measure.value, [each.value for each in known])
            raise BadValueError(path, f"numbers.{name}.measure", f"of lifts in closed form {problem}")
    objects = build_objects(protocol.objects, path, models)
    check_tools_can_be_held(objects.path, objects.tools, settings)
    asked = {entry.quantile for entry in protocol.numbers.values() if entry.measure is Measure.DENSITY}
    table = None if protocol.published is None else load_published(find_file(protocol.published, path, models))
    return LiftExperiment(
        name=protocol.name,
        section=path,
        objects=objects,
        blocks=tuple(protocol.blocks),
        learners=learners,
        told=list_told(protocol, path, objects, learners),
        seed=seed,
        settings=settings,
        believes=tuple(sorted(asked)),
        kappa=None,
        numbers=protocol.numbers,
        figures=protocol.figures,
        people=table,
    )
