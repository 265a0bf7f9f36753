"""Drake systems for vision (paper, figure 2): the visual prior and the memory of materials."""

from typing import Any, cast

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, State

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import ObjectParameter, SampledSystem, Source
from affordance.objects.colour import Colour
from affordance.vision.features import ComponentFeatures
from affordance.vision.prediction import predict_object


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
    """Stores the belief about materials, and updates it after each presentation (the teaching signal).

    A forced event ends a presentation: the posterior becomes the belief, unless the measurements were too improbable
    to learn from. The colours that remain in memory after a presentation are a parameter of the Context.

    Input ports:
        posterior: Belief given the measurements, ObjectBelief.
        p_value: Probability of measurements at least as extreme as these, (1,).

    Output ports:
        materials: Memory of materials, MaterialMemory.
    """

    def __init__(self, memory: MaterialMemory, least_p_value: float) -> None:
        """Declares ports and the event.

        Args:
            memory: Initial memory.
            least_p_value: Smallest p-value at which the system learns from measurements.
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
        self.DeclareForcedUnrestrictedUpdateEvent(self._keep_posterior)

    def set_memory(self, context: Context, memory: MaterialMemory) -> None:
        """Sets the memory before a presentation."""
        context.SetAbstractState(self._memory, memory)

    def get_memory(self, context: Context) -> MaterialMemory:
        """Returns the current memory."""
        value: Any = context.get_abstract_state(self._memory)
        return cast(MaterialMemory, value.get_value())

    def _keep_posterior(self, context: Context, state: State) -> None:
        memory = self.get_memory(context)
        if self._p_value.Eval(context)[0] >= self._least_p_value:
            memory = self._posterior.Eval(context).memory
        if remembered := self.remembered.get(context):
            memory = memory.restrict_to(remembered)
        mutable: Any = state.get_mutable_abstract_state(self._memory)
        mutable.set_value(memory)
