"""A learner of one's own: a Kalman filter of densities that may change, so that old lifts count less and less.

    affordance run linear_plus_plus --learner examples/forgetting.py:Forgetting --repeats 20
    affordance run weight --learner examples/forgetting.py:Forgetting --set learner.drift=50

The page docs/howto/own_learner.md explains it.
"""

from dataclasses import dataclass
from typing import Annotated, override

from affordance.belief.learner import Draws, FindLikelihood, Lesson, Seen, State
from affordance.belief.one_density import OneDensity
from affordance.files.constraints import Setting, Within


class Forgetting(OneDensity):
    """Kalman filter whose densities drift: those of a colour, as with one density for each colour."""

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of the filter.

        Attributes:
            drift: Standard deviation of the change of a mean density from one lift to the next.
        """

        drift: Annotated[float, Within(0.0, 1e4), Setting("kg/m^3", "an example, fitted to nothing")] = 100.0

    @override
    def learn(self, state: State, seen: Seen, find_likelihood: FindLikelihood, rng: Draws) -> Lesson:
        expected = self.expect(state, seen)
        likelihood = find_likelihood(expected)
        of_means = likelihood.marginalise_deviation(state["deviation"])
        updated = self.believe(state).condition(of_means.embed(seen.colours, state["precision"].shape[1]))
        drifted = updated.widen(state["drift"][:, None])
        state = {**state, "precision": drifted.precision, "information": drifted.information_vector}
        return Lesson(state, expected.condition(likelihood), likelihood)
