"""The eye, as a system."""

from pydrake.common.value import Value
from pydrake.systems.framework import AbstractParameterIndex, Context

from affordance.systems.sampled_system import SampledSystem
from affordance.visual_prior import ComponentFeatures


class Vision(SampledSystem):
    """Shows what the eye measured of the object presented; the measurement is a parameter of the Context.

    Output ports:
        features: What the eye says of each component, tuple of ComponentFeatures.
    """

    def __init__(self) -> None:
        super().__init__()
        self._features = self.DeclareAbstractParameter(Value[object]())
        self.DeclareAbstractOutputPort(
            "features",
            lambda: Value[object](),
            self._calc_features,
            prerequisites_of_calc={self.abstract_parameter_ticket(AbstractParameterIndex(self._features))},
        )

    def set_features(self, context: Context, features: tuple[ComponentFeatures, ...]) -> None:
        """Sets what the eye measured."""
        context.get_mutable_abstract_parameter(self._features).set_value(features)

    def _calc_features(self, context: Context, output: Value) -> None:
        output.set_value(context.get_abstract_parameter(self._features).get_value())
