"""The visual system of the paper's figure 2: features in, belief about the object's inertia out."""

from pydrake.systems.framework import Context

from affordance.belief import Prior
from affordance.memory import MaterialMemory
from affordance.object_belief import ObjectBelief
from affordance.systems.sampled_system import SampledSystem, Source
from affordance.visual_prior import ComponentFeatures, predict_object


class VisualPrior(SampledSystem):
    """Predicts the object's inertia from its looks and the memory of materials.

    Input ports:
        features: What the eye says of each component, tuple of ComponentFeatures.
        materials: MaterialMemory.

    Output ports:
        prior: p(lambda | v), ObjectBelief.
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
