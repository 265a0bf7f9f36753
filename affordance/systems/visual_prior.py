"""The visual system of the paper's figure 2: features in, belief about the object's inertia out."""

from pydrake.common.value import Value
from pydrake.systems.framework import Context

from affordance.belief import Prior
from affordance.systems.sampled_system import SampledSystem
from affordance.visual_prior import predict_object


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
        self._features = self.DeclareAbstractInputPort("features", Value[object]())
        self._materials = self.DeclareAbstractInputPort("materials", Value[object]())
        self.DeclareAbstractOutputPort(
            "prior",
            lambda: Value[object](),
            self._calc_prior,
            prerequisites_of_calc={
                self.input_port_ticket(self._features.get_index()),
                self.input_port_ticket(self._materials.get_index()),
            },
        )

    def _calc_prior(self, context: Context, output: Value) -> None:
        output.set_value(predict_object(self._features.Eval(context), self._materials.Eval(context), self._prior))
