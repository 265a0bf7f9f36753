"""Drake systems for vision (paper, figure 2): features of an object, memory of materials, and visual prior.

The visual prior p(lambda | v) is the belief about an object's inertia given its visual features, before it is held.
A component's colour selects its material, and so the belief about its density. Sizes and poses determine Phi, which
maps densities to inertial parameters, and their errors determine its uncertainty to first order. Frames: T the tool,
E a component.
"""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import scipy
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import ObjectParameter, SampledSystem, Source
from affordance.objects.colour import Colour
from affordance.objects.inertia import NUM_PARAMETERS, Geometry, build_inertia_map, parameters_from_pseudo_inertia
from affordance.vision.features import ComponentFeatures

# Step of the central differences of Phi: relative for sizes, in metres for positions, in radians for rotations.
_STEP = 1e-5


class FeatureSensor(SampledSystem):
    """Outputs the measured features of the presented object, which are a parameter of the Context.

    Output ports:
        features: Features of each component, tuple of ComponentFeatures.
    """

    def __init__(self) -> None:
        super().__init__()
        self.features: ObjectParameter[tuple[ComponentFeatures, ...]] = self.declare_object_parameter()
        self.declare_object_output("features", self.features.get, {self.features.ticket})


class VisualPrior(SampledSystem):
    """Predicts an object's inertial parameters from its features and the memory of materials.

    Input ports:
        features: Features of each component, tuple of ComponentFeatures.
        materials: Memory of materials, MaterialMemory.

    Output ports:
        prior: Prior p(lambda | v), ObjectBelief.
    """

    def __init__(self, prior: Prior) -> None:
        super().__init__()
        self._prior = prior
        self._features: Source[tuple[ComponentFeatures, ...]] = self.declare_object_input("features")
        self._materials: Source[MaterialMemory] = self.declare_object_input("materials")
        inputs = {self.input_ticket("features"), self.input_ticket("materials")}
        self.declare_object_output("prior", self._calc_prior, inputs)

    def _calc_prior(self, context: Context) -> ObjectBelief:
        return predict_object(self._features.Eval(context), self._materials.Eval(context), self._prior)


class MaterialMemorySystem(SampledSystem):
    """Remembers the belief about materials, and updates it at the end of a presentation (the teaching signal).

    At the end of each presentation the posterior becomes the belief, unless the measurements were too improbable to
    learn from. The colours that are remembered after a presentation are a parameter of the Context.

    Input ports:
        posterior: Belief given the measurements, ObjectBelief.
        p_value: Probability of measurements at least as extreme as these, (1,).

    Output ports:
        materials: Memory of materials, MaterialMemory.
    """

    def __init__(self, memory: MaterialMemory, *, duration: float, least_p_value: float) -> None:
        """Declares ports and the update at the end of a presentation.

        Args:
            memory: Initial memory.
            duration: Duration of a presentation, [s].
            least_p_value: Smallest p-value at which the memory learns.
        """
        super().__init__()
        self._least_p_value = least_p_value
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        self._p_value: Source[Array] = self.declare_vector_input("p_value", 1)
        index = self.DeclareAbstractState(AbstractValue.Make(memory))
        self._memory = int(index)
        self.remembered: ObjectParameter[tuple[Colour, ...]] = self.declare_object_parameter(
            ()
        )  # empty for all colours
        self.DeclareStateOutputPort("materials", index)
        self.DeclarePeriodicUnrestrictedUpdateEvent(duration, duration, self._learn)

    def set_memory(self, context: Context, memory: MaterialMemory) -> None:
        """Sets the memory before a presentation."""
        context.SetAbstractState(self._memory, memory)

    def get_memory(self, context: Context) -> MaterialMemory:
        """Returns the current memory."""
        value: Any = context.get_abstract_state(self._memory)
        return cast(MaterialMemory, value.get_value())

    def _learn(self, context: Context, state: State) -> None:
        memory = self.get_memory(context)
        if self._p_value.Eval(context)[0] >= self._least_p_value:
            memory = self._posterior.Eval(context).memory
        if remembered := self.remembered.get(context):
            memory = memory.restrict_to(remembered)
        mutable: Any = state.get_mutable_abstract_state(self._memory)
        mutable.set_value(memory)


def predict_object(features: Sequence[ComponentFeatures], memory: MaterialMemory, prior: Prior) -> ObjectBelief:
    """Predicts an object's inertia from its visual features, a memory, and a prior for unknown materials.

    The memory in the returned belief contains every colour of the object.
    """
    recollection = memory.recall([part.appearance for part in features], prior)
    return ObjectBelief(
        recollection.memory,
        recollection.densities,
        measure_geometry(features, recollection.columns, recollection.densities.size),
        recollection.colours,
    )


def measure_geometry(
    features: Sequence[ComponentFeatures], material_indices: Sequence[int], num_materials: int
) -> Geometry:
    """Computes Phi, (10, num_materials), and its errors; ``material_indices`` has each component's column."""
    Phi = build_inertia_map(
        [part.shape for part in features], [part.X_TE for part in features], material_indices, num_materials
    )
    changes: list[tuple[int, Array]] = []  # change of one column of Phi by one standard deviation of one error
    for part, index in zip(features, material_indices, strict=True):
        sds = [part.size_sd] * len(part.shape.sizes) + [part.position_sd] * 3 + [part.rotation_sd] * 3
        for measurement, sd in enumerate(sds):
            if sd > 0.0:
                displaced = (_displace(part, measurement, step) for step in (_STEP, -_STEP))
                plus, minus = (build_inertia_map([each.shape], [each.X_TE], [0], 1)[:, 0] for each in displaced)
                changes.append((index, sd * (plus - minus) / (2.0 * _STEP)))
        J = part.X_TE @ part.shape.unit_pseudo_inertia() @ part.X_TE.T
        for deformation in part.deformations:
            # First-order change of det(D) D J D^T at D = I + deformation; the factor det(D) changes the mass of a
            # solid of given density with its volume.
            change = deformation @ J + J @ deformation.T + np.trace(deformation) * J
            changes.append((index, parameters_from_pseudo_inertia(change)))
    errors = np.zeros((len(changes), NUM_PARAMETERS, num_materials))
    for error, (index, column) in zip(errors, changes, strict=True):
        error[:, index] = column
    return Geometry(Phi, errors)


def _displace(part: ComponentFeatures, measurement: int, step: float) -> ComponentFeatures:
    """Returns the features with one measurement changed by a step: relative for sizes, absolute otherwise."""
    sizes = part.shape.sizes
    X_TE = np.array(part.X_TE)
    if measurement < len(sizes):
        sizes[measurement] *= 1.0 + step
    elif measurement < len(sizes) + 3:
        X_TE[measurement - len(sizes), 3] += step
    else:
        rotation = np.zeros(3)
        rotation[measurement - len(sizes) - 3] = step
        X_TE[:3, :3] = scipy.spatial.transform.Rotation.from_rotvec(rotation).as_matrix() @ X_TE[:3, :3]
    return ComponentFeatures(part.colour, part.shape.with_sizes(sizes), X_TE)
