"""Resistance of the wood to a nail, as a system."""

import math

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from affordance.drake.sampled_system import SampledSystem
from affordance.plant.nail import Nail

# Rate of the nail below which it counts as at rest. Dry friction is a step there, which no integrator of smooth
# systems can handle; a tanh of this width replaces it, so that a nail at rest creeps by its own weight, 0.3 um per
# second, [m/s].
_REST = 1e-3


class NailResistance(SampledSystem):
    """Dry friction of the wood: opposes motion, without rebound, with a magnitude that depends on the nail's depth.

    Input ports:
        state: Distance that the nail was driven since it was set, and its rate, (2,), [m, m/s].

    Output ports:
        force: Force on the nail along the driving direction, and zeros for the plant's other velocities,
            (num_velocities,), [N, N m].
        resistance: Resistance against being driven in, (1,), [N].
    """

    def __init__(self, nail: Nail, *, num_velocities: int, index: int) -> None:
        super().__init__()
        self._nail = nail
        self._size = num_velocities
        self._index = index
        self._state = self.declare_vector_input("state", 2)
        self.DeclareVectorOutputPort("force", num_velocities, self._calc_force)
        self.DeclareVectorOutputPort("resistance", 1, self._calc_resistance)

    def _compute_resistance(self, context: Context) -> float:
        travel, rate = self._state.Eval(context)
        return self._nail.compute_resistance(self._nail.depth_set + travel) * math.tanh(rate / _REST)

    def _calc_force(self, context: Context, output: BasicVector) -> None:
        force = np.zeros(self._size)
        force[self._index] = -self._compute_resistance(context)
        output.SetFromVector(force)

    def _calc_resistance(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array([self._compute_resistance(context)]))
