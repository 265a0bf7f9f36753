"""Linear+ and Linear++ (Cesanek, Zhang, Ingram, Wolpert and Flanagan 2021, eLife 10:e71627).

Cylinders of one look, whose weight is in proportion to their size, are lifted until they are familiar; then one more
comes, of a size between theirs, that weighs a third (Linear+) or two thirds (Linear++) more than its size predicts.
Before each lift the hand is clamped and pushes upward to match the weight. A learner with one density for each
material predicts that people go by the family for ever; one with a belief for each object, that they learn what
this one weighs in both groups; people do it in Linear++ only.
"""

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from affordance.experiments.people.lift_experiment import LiftedObjects, LiftExperiment, Measure
from affordance.experiments.people.published import PublishedTable, load_published
from affordance.files.model_folder import MODELS
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Component, Material, Tool
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
    test_volume = _build_solid(_TEST_HEIGHT).volume
    tools = [
        _build_tool(f"training_{1000 * height:.0f}mm", height, _FAMILY_MASS_PER_HEIGHT * height)
        for height in _TRAINING_HEIGHTS
    ]
    test = _build_tool("test", _TEST_HEIGHT, group.test_mass)
    volumes = np.array([tool.components[0].shape.volume for tool in tools])
    family = functools.partial(predict_from_family, volumes=volumes, test_volume=test_volume)
    measures = {
        "first_N": Measure("force, first lift of the test object", "N", measure_first),
        "end_N": Measure(f"force, test object, last {NUM_LAST_CYCLES} cycles", "N", measure_end),
        "family_N": Measure("force that the training objects predict for the test object's size then", "N", family),
        "f": Measure("learned fraction", "1", functools.partial(measure_fraction, family=family)),
        "training_correlation": Measure("correlation of force and weight, training", "1", correlate_training),
    }
    return LiftExperiment(group.name, (*tools, test), _TRAINING, draw_lifts, measures)


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
    return LiftedObjects(*(column[lifted.tool == _TEST] for column in lifted))


def measure_first(lifted: LiftedObjects) -> float:
    """Force in the first lift of the test object, [N]."""
    return float(select_test(lifted).force[0])


def measure_end(lifted: LiftedObjects) -> float:
    """Mean force of the test object at the end, [N]."""
    return float(select_test(lifted).force[-NUM_LAST_CYCLES:].mean())


def predict_from_family(lifted: LiftedObjects, *, volumes: np.ndarray, test_volume: float) -> float:
    """Force for the test object's size by linear regression over the training objects' forces at the end, [N].

    Args:
        lifted: The lifts.
        volumes: Of the training objects, [m^3].
        test_volume: Of the test object, [m^3].
    """
    last = len(lifted.tool) - NUM_LAST_CYCLES * (_TEST + 1)
    is_training = (lifted.tool != _TEST) & (np.arange(len(lifted.tool)) >= last)
    slope, intercept = np.polyfit(volumes[lifted.tool[is_training]], lifted.force[is_training], 1)
    return float(intercept + slope * test_volume)


def measure_fraction(lifted: LiftedObjects, *, family: "functools.partial[float]") -> float:
    """Learned fraction: 0 if the test object is lifted by what its family predicts, 1 by what it weighs."""
    predicted, weight = family(lifted), float(select_test(lifted).weight[0])
    return (measure_end(lifted) - predicted) / (weight - predicted)


def correlate_training(lifted: LiftedObjects) -> float:
    """Correlation of force and weight over the lifts before the test object comes."""
    until = NUM_TRAINING_CYCLES * _TEST
    return float(np.corrcoef(lifted.force[:until], lifted.weight[:until])[0, 1])


def _build_solid(height: float) -> Ellipsoid:
    """The ellipsoid with the radius and volume of a cylinder: held at its middle and at rest, the two are alike."""
    return Ellipsoid((_RADIUS, _RADIUS, 0.75 * height))


def _build_tool(name: str, height: float, mass: float) -> Tool:
    solid = _build_solid(height)
    material = Material(name, _COLOUR, mass / solid.volume, 0.0, "Cesanek et al. 2021, eLife 10:e71627")
    return Tool(name, (Component(solid, np.eye(4), material, material),))
