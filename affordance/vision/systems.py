"""The memory of materials, as a system."""

from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory import Memory
from affordance.belief.object_belief import ObjectBelief
from affordance.drake_system import ObjectParameter, SampledSystem, Source
from affordance.vision.features import ComponentFeatures
from affordance.vision.visual_prior import predict_object


class MaterialMemorySystem(SampledSystem):
    """Keeps what is believed of all materials from trial to trial.

    Its state changes once a trial: ``learn``, called at the end, takes over the posterior (the teaching signal).

    Input ports:
        posterior: Belief after what was felt, ObjectBelief.

    Output ports:
        materials: Memory.
    """

    def __init__(self) -> None:
        super().__init__()
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        index = self.DeclareAbstractState(AbstractValue.Make(MaterialMemory()))
        self._memory = int(index)
        self.DeclareStateOutputPort("materials", index)

    def set_memory(self, context: Context, memory: Memory) -> None:
        """Sets what is believed when a trial begins."""
        context.SetAbstractState(self._memory, memory)

    def get_memory(self, context: Context) -> Memory:
        """Returns what is believed now."""
        value: Any = context.get_abstract_state(self._memory)
        memory: Memory = value.get_value()
        return memory

    def learn(self, context: Context) -> None:
        """Ends a trial: the posterior becomes what is believed.

        Whatever is to be read off the trial's beliefs must be read before, for the prior changes with the memory.
        """
        self.set_memory(context, self._posterior.Eval(context).memory)


class Vision(SampledSystem):
    """Shows what the eye measured of the object presented; the measurement is a parameter of the Context.

    Output ports:
        features: What the eye says of each component, tuple of ComponentFeatures.
    """

    def __init__(self) -> None:
        super().__init__()
        self._features: ObjectParameter[tuple[ComponentFeatures, ...]] = self.declare_object_parameter()
        self.declare_object_output("features", self._features.get, {self._features.ticket})

    def set_features(self, context: Context, features: tuple[ComponentFeatures, ...]) -> None:
        """Sets what the eye measured."""
        self._features.set(context, features)


class VisualPrior(SampledSystem):
    """Predicts the object's inertia from its looks and the memory of materials.

    Input ports:
        features: What the eye says of each component, tuple of ComponentFeatures.
        materials: Memory.

    Output ports:
        prior: p(lambda | v), ObjectBelief.
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
