"""The eye, as a system."""

from pydrake.systems.framework import Context

from affordance.systems.sampled_system import ObjectParameter, SampledSystem
from affordance.visual_prior import ComponentFeatures


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
