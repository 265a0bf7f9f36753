"""Linear+ and Linear++ (Cesanek, Zhang, Ingram, Wolpert and Flanagan 2021, eLife 10:e71627), for the fit of kappa.

Objects, lifts and measures are those of the protocols linear_plus and linear_plus_plus, which also give people's
results. A learner with one density for each material predicts that people rely on the family for ever; one with a
belief for each object, that they learn this object's weight in both groups; people do so in Linear++ only.
"""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from affordance.arrays import Array
from affordance.experiments.people.lift_experiment import LiftedObjects, LiftExperiment, Measure, Observers
from affordance.experiments.shared.lift_drawings import predict_between
from affordance.files.model_folder import MODELS
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.measured import MeasuredObservers, compute_of_observers
from affordance.protocols.number_entries import Measure as Quantity
from affordance.protocols.number_entries import NumberEntry
from affordance.protocols.object_entries import ProtocolObjects, build_objects
from affordance.protocols.presentations import draw_presentations
from affordance.protocols.protocol import find_protocol, load_protocol
from affordance.protocols.published import PublishedTable, load_published
from affordance.simulation.static_lifts import Lift

# Number of cycles that make up the end of the experiment.
NUM_LAST_CYCLES = 16
# Numbers of the protocols that are measured here, and their units.
_UNITS = {"first_N": "N", "end_N": "N", "family_N": "N", "f": "1", "training_correlation": "1"}
_TRAINING, _TEST = "training", "test"


@dataclass(frozen=True)
class Group:
    """Group of people, with the mass of its test object, which deviates from the family.

    Attributes:
        name: Name in files, and of the protocol.
        title: Name in words.
        test_mass: Mass of the test object, [kg]; its size predicts 0.9 kg.
    """

    name: str
    title: str
    test_mass: float

    def load_people(self, models: Path = MODELS) -> PublishedTable:
        """Loads people's results.

        Raises:
            BadValueError: The file is wrong.
        """
        return load_published(models / "people" / f"{self.name}.csv")


GROUPS = (Group("linear_plus", "Linear+", 1.2), Group("linear_plus_plus", "Linear++", 1.5))


def build_experiment(group: Group, models: Path = MODELS) -> LiftExperiment:
    """Builds the experiment of a group from its protocol.

    Raises:
        BadValueError: The protocol is wrong.
    """
    path = find_protocol(group.name, models)
    protocol = load_protocol(path)
    objects = build_objects(protocol.objects, path, models)
    measures = {
        name: Measure(
            protocol.numbers[name].meaning, unit, functools.partial(_compute, protocol.numbers, objects, name)
        )
        for name, unit in _UNITS.items()
    }
    draw = functools.partial(draw_lifts, protocol.blocks, objects)
    return LiftExperiment(group.name, objects.tools, tuple(objects.groups[_TRAINING]), draw, measures)


def draw_lifts(blocks: Sequence[BlockEntry], objects: ProtocolObjects, rng: np.random.Generator) -> list[Lift]:
    """Draws the lifts of an observer, block by block."""
    return [
        Lift(presentation.tool)
        for index, block in enumerate(blocks)
        for presentation in draw_presentations(block, index, objects, rng, 0)
    ]


def select_test(experiment: LiftExperiment, lifted: LiftedObjects) -> LiftedObjects:
    """Selects the lifts of the test object, one per cycle: the object that deviates from its family."""
    return lifted.select(~np.isin(lifted.tool, experiment.honest))


def list_test_cycles(experiment: LiftExperiment, observers: Observers) -> tuple[Array, Array]:
    """Returns the force for the test object and its prediction by the family in each cycle, (R, C) each, [N]."""
    drawn = [index for index in range(len(experiment.tools)) if index not in experiment.honest]
    lifted = observers.list_observers()
    forces = [select_test(experiment, each).force for each in lifted]
    predictions = [
        predict_between(
            each.tool, each.force, drawn=drawn, others=experiment.honest, tools_there_are=experiment.tools
        )
        for each in lifted
    ]
    return np.array(forces), np.array(predictions)


def _compute(entries: Mapping[str, NumberEntry], objects: ProtocolObjects, name: str, lifted: LiftedObjects) -> float:
    """Computes one number of the protocol for one observer."""
    arrays = {Quantity.FORCE: lifted.force[None], Quantity.WEIGHT: lifted.weight[None]}
    measured = MeasuredObservers(objects, lifted.tool[None], lambda quantity, quantile: arrays[quantity])
    return float(compute_of_observers(entries, measured)[name][0])
