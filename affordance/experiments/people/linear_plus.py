"""Linear+ and Linear++ (Cesanek, Zhang, Ingram, Wolpert and Flanagan 2021, eLife 10:e71627).

Cylinders of one look, whose weight is in proportion to their size, are lifted until they are familiar; then one more
comes, of a size between theirs, that weighs a third (Linear+) or two thirds (Linear++) more than its size predicts.
Before each lift the hand is clamped and pushes upward to match the weight. A learner with one density for each
material predicts that people go by the family for ever; one with a belief for each object, that they learn what
this one weighs in both groups; people do it in Linear++ only.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from affordance.arrays import Array
from affordance.experiments.people.lift_experiment import LiftedObjects, LiftExperiment, Measure, Observers
from affordance.files.model_folder import MODELS
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Component, Material, Tool
from affordance.protocols.published import PublishedTable, load_published
from affordance.simulation.static_lifts import Lift

# All of the experiment, from its report.
_RADIUS = 0.0461  # [m]
_TRAINING_HEIGHTS = (0.06, 0.075, 0.105, 0.12)  # [m]
_TEST_HEIGHT = 0.09  # [m]
# By which the training objects weigh 0.6 to 1.2 kg and the family predicts 0.9 kg for the test object, [kg/m].
_FAMILY_MASS_PER_HEIGHT = 10.0
NUM_TRAINING_CYCLES, NUM_TEST_CYCLES = 30, 40
# The end of the experiment: so many cycles.
NUM_LAST_CYCLES = 16
_TEST = len(_TRAINING_HEIGHTS)
_TRAINING = tuple(range(_TEST))
# The colour of all; which one it is does not matter.
_COLOUR = (0.55, 0.55, 0.55)


@dataclass(frozen=True)
class Group:
    """A group of people, and how their test object differs from its family.

    Attributes:
        name: In files.
        title: In words.
        test_mass: Of the test object, [kg]; its size predicts 0.9 kg.
    """

    name: str
    title: str
    test_mass: float

    def load_people(self, models: Path = MODELS) -> PublishedTable:
        """Reads what people did.

        Raises:
            BadValueError: The file is wrong.
        """
        return load_published(models / "people" / f"{self.name}.csv")


GROUPS = (Group("linear_plus", "Linear+", 1.2), Group("linear_plus_plus", "Linear++", 1.5))


def build_experiment(group: Group) -> LiftExperiment:
    """Builds the experiment of a group."""
    training = (
        _build_tool(f"training_{1000 * height:.0f}mm", height, _FAMILY_MASS_PER_HEIGHT * height)
        for height in _TRAINING_HEIGHTS
    )
    tools = (*training, _build_tool("test", _TEST_HEIGHT, group.test_mass))
    family = _build_family_prediction(tools)
    measures = {
        "first_N": Measure("force, first lift of the test object", "N", measure_first),
        "end_N": Measure(f"force, test object, last {NUM_LAST_CYCLES} cycles", "N", measure_end),
        "family_N": Measure("force that the training objects predict for the test object's size then", "N", family),
        "f": Measure("learned fraction", "1", functools.partial(measure_fraction, family=family)),
        "training_correlation": Measure("correlation of force and weight, training", "1", correlate_training),
    }
    return LiftExperiment(group.name, tools, _TRAINING, draw_lifts, measures)


def draw_lifts(rng: np.random.Generator) -> list[Lift]:
    """Draws 320 lifts: cycles of the training objects in random order, later with the test object before them."""
    lifts: list[Lift] = []
    for cycle in range(NUM_TRAINING_CYCLES + NUM_TEST_CYCLES):
        if cycle >= NUM_TRAINING_CYCLES:
            lifts.append(Lift(_TEST))
        lifts += [Lift(int(tool)) for tool in rng.permutation(_TEST)]
    return lifts


def select_test(lifted: LiftedObjects) -> LiftedObjects:
    """The lifts of the test object, one a cycle."""
    return lifted.select(lifted.tool == _TEST)


def measure_first(lifted: LiftedObjects) -> float:
    """Force in the first lift of the test object, [N]."""
    return float(select_test(lifted).force[0])


def measure_end(lifted: LiftedObjects) -> float:
    """Mean force of the test object at the end, [N]."""
    return float(select_test(lifted).force[-NUM_LAST_CYCLES:].mean())


def predict_from_family(
    lifted: LiftedObjects, *, volumes: Array, test_volume: float, num_cycles: int = NUM_LAST_CYCLES
) -> float:
    """Force for the test object's size by linear regression over the training objects' forces at the end, [N].

    Args:
        lifted: The lifts.
        volumes: Of the training objects, [m^3].
        test_volume: Of the test object, [m^3].
        num_cycles: How many cycles are the end.
    """
    last = lifted.select(slice(-num_cycles * (_TEST + 1), None))
    is_training = last.tool != _TEST
    slope, intercept = np.polyfit(volumes[last.tool[is_training]], last.force[is_training], 1)
    return float(intercept + slope * test_volume)


def list_test_cycles(experiment: LiftExperiment, observers: Observers) -> tuple[Array, Array]:
    """Force for the test object, and what its family predicts, in each cycle that it is in, (R, C) each, [N]."""
    predict = _build_family_prediction(experiment.tools)
    start = NUM_TRAINING_CYCLES * _TEST
    forces, predictions = [], []
    for lifted in observers.list_observers():
        forces.append(select_test(lifted).force)
        ends = range(start + _TEST + 1, len(lifted.tool) + 1, _TEST + 1)
        predictions.append([predict(lifted.select(slice(end)), num_cycles=1) for end in ends])
    return np.array(forces), np.array(predictions)


def measure_fraction(lifted: LiftedObjects, *, family: "functools.partial[float]") -> float:
    """Learned fraction: 0 if the test object is lifted by what its family predicts, 1 by what it weighs."""
    predicted, weight = family(lifted), float(select_test(lifted).weight[0])
    return (measure_end(lifted) - predicted) / (weight - predicted)


def correlate_training(lifted: LiftedObjects) -> float:
    """Correlation of force and weight over the lifts before the test object comes."""
    until = NUM_TRAINING_CYCLES * _TEST
    return float(np.corrcoef(lifted.force[:until], lifted.weight[:until])[0, 1])


def _build_family_prediction(tools: Sequence[Tool]) -> "functools.partial[float]":
    """The prediction from the family, by the volumes of the objects."""
    *volumes, test_volume = (tool.components[0].shape.volume for tool in tools)
    return functools.partial(predict_from_family, volumes=np.array(volumes), test_volume=test_volume)


def _build_solid(height: float) -> Ellipsoid:
    """The ellipsoid with the radius and volume of a cylinder: held at its middle and at rest, the two are alike."""
    return Ellipsoid((_RADIUS, _RADIUS, 0.75 * height))


def _build_tool(name: str, height: float, mass: float) -> Tool:
    solid = _build_solid(height)
    material = Material(name, _COLOUR, mass / solid.volume, 0.0, "Cesanek et al. 2021, eLife 10:e71627")
    return Tool(name, (Component(solid, np.eye(4), material, material),))
