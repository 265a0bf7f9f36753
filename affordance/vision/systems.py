"""Visual system of the paper's figure 2: features of an object, memory of materials, and prior."""

from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory, ObjectBelief
from affordance.drake.sampled_system import ObjectParameter, SampledSystem, Source
from affordance.objects.colour import Colour
from affordance.vision.features import ComponentFeatures
from affordance.vision.visual_prior import predict_object


class FeatureSensor(SampledSystem):
    """Source of the measured features of the presented object, which are a parameter of the Context.

    Output ports:
        features: Features of each component, tuple of ComponentFeatures.
    """

    def __init__(self) -> None:
        super().__init__()
        self._features: ObjectParameter[tuple[ComponentFeatures, ...]] = self.declare_object_parameter()
        self.declare_object_output("features", self._features.get, {self._features.ticket})

    def get_features(self, context: Context) -> tuple[ComponentFeatures, ...]:
        """Returns the features of the presented object."""
        return self._features.get(context)

    def set_features(self, context: Context, features: tuple[ComponentFeatures, ...]) -> None:
        """Sets the features of the presented object."""
        self._features.set(context, features)


class VisualPrior(SampledSystem):
    """Prediction of an object's inertial parameters from its features and the memory of materials.

    Input ports:
        features: Features of each component, tuple of ComponentFeatures.
        materials: Memory of materials, Memory.

    Output ports:
        prior: Prior p(lambda | v), ObjectBelief.
    """

    def __init__(self, prior: Prior) -> None:
        super().__init__()
        self._prior = prior
        self._features: Source[tuple[ComponentFeatures, ...]] = self.declare_object_input("features")
        self._materials: Source[Memory] = self.declare_object_input("materials")
        inputs = {self.input_ticket("features"), self.input_ticket("materials")}
        self.declare_object_output("prior", self._calc_prior, inputs)

    def _calc_prior(self, context: Context) -> ObjectBelief:
        return predict_object(self._features.Eval(context), self._materials.Eval(context), self._prior)


class MaterialMemorySystem(SampledSystem):
    """Memory of the belief about materials, updated when a presentation ends (the teaching signal).

    The state changes by one event per presentation: at its end the posterior becomes the belief, unless the
    presentation was so improbable an outlier that nothing is to be learned from it. The colours that are remembered
    beyond a presentation are a parameter of the Context.

    Input ports:
        posterior: Belief given the measurements, ObjectBelief.
        p_value: Probability of measurements at least as improbable as these, (1,).

    Output ports:
        materials: Memory of materials, Memory.
    """

    def __init__(self, *, duration: float, least_p_value: float) -> None:
        """Declares ports and the update event.

        Args:
            duration: Duration of a presentation, [s].
            least_p_value: Smallest p-value of a presentation from which the memory learns.
        """
        super().__init__()
        self._least_p_value = least_p_value
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        self._p_value: Source[Array] = self.declare_vector_input("p_value", 1)
        index = self.DeclareAbstractState(AbstractValue.Make(MaterialMemory()))
        self._memory = int(index)
        self._remembered: ObjectParameter[tuple[Colour, ...]] = self.declare_object_parameter(())
        self.DeclareStateOutputPort("materials", index)
        self.DeclarePeriodicUnrestrictedUpdateEvent(duration, duration, self._learn)

    def set_memory(self, context: Context, memory: Memory) -> None:
        """Sets the memory before a presentation."""
        context.SetAbstractState(self._memory, memory)

    def get_memory(self, context: Context) -> Memory:
        """Returns the present memory."""
        value: Any = context.get_abstract_state(self._memory)
        memory: Memory = value.get_value()
        return memory

    def remember_only(self, context: Context, colours: tuple[Colour, ...]) -> None:
        """Sets the colours that are remembered beyond a presentation; all if empty."""
        self._remembered.set(context, colours)

    def _learn(self, context: Context, state: State) -> None:
        memory = self.get_memory(context)
        if self._p_value.Eval(context)[0] >= self._least_p_value:
            memory = self._posterior.Eval(context).memory
        if remembered := self._remembered.get(context):
            memory = memory.restrict_to(remembered)
        mutable: Any = state.get_mutable_abstract_state(self._memory)
        mutable.set_value(memory)
