"""Example of a learner: a Kalman filter for densities that change, so that old lifts count less.

    affordance run linear_plus_plus --learner examples/forgetting.py:Forgetting --repeats 20
    affordance run weight --learner examples/forgetting.py:Forgetting --set learner.drift=50

docs/howto/own_learner.md explains the example.
"""

from dataclasses import dataclass
from typing import Annotated, override

import numpy as np

from affordance.belief.holds import Felt
from affordance.belief.learner import Draws, Lesson, Seen, State
from affordance.belief.normals import Normals
from affordance.belief.one_density import OneDensity
from affordance.files.constraints import Setting, Within


class Forgetting(OneDensity):
    """Kalman filter in which the mean density of each colour drifts."""

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of the filter.

        Attributes:
            drift: Standard deviation of the change of a mean density between two lifts.
        """

        drift: Annotated[float, Within(0.0, 1e4), Setting("kg/m^3", "an example, fitted to nothing")] = 100.0

    @override
    def learn(self, state: State, seen: Seen, felt: Felt, rng: Draws) -> Lesson:
        expected, believed = self.expect(state, seen), self.believe(state)
        likelihood = felt.find_likelihood(expected)
        own = expected.condition(likelihood)
        # The object's densities are the mean densities of its colours plus independent deviations.
        gain = believed.covariance[:, :, list(seen.colours)] @ expected.precision
        mean = believed.mean + np.matvec(gain, own.mean - expected.mean)
        change = gain @ (own.covariance - expected.covariance) @ np.swapaxes(gain, 1, 2)
        drifted = Normals(mean, believed.covariance + change).widen(state["drift"][:, None])
        return Lesson(self.set_prior(state, drifted.precision, drifted.information_vector), own, likelihood)
