"""Learner with one density for each colour (paper): Bayes' rule on the mean density of each material.

Torques depend on an object's own densities, which deviate from the means of its materials. An object has the same
deviation in all its lifts, so the likelihoods of all its lifts are summed before the deviation is marginalised.
"""

from collections.abc import Sequence
from typing import Any, override

import numpy as np

from affordance.arrays import Array
from affordance.belief.colour_recognition import CERTAIN
from affordance.belief.density_belief import Prior
from affordance.belief.learner import Draws, FindLikelihood, Learner, Lesson, Seen, State, describe_start
from affordance.belief.likelihood import Likelihood
from affordance.belief.normals import Normals
from affordance.belief.rows import FELT_INFORMATION, FELT_PRECISION, get_felt, pad, set_felt, start_felt


class OneDensity(Learner):
    """Learner with one density for each colour.

    Its state holds the prior, what was felt of each thing, and the precision, (B, M, M), and information vector, (B,
    M), of the mean densities of M colours.
    """

    @property
    @override
    def name(self) -> str:
        return "density" if type(self) is OneDensity else super().name

    @property
    @override
    def label(self) -> str:
        return "one density for each colour" if type(self) is OneDensity else super().label

    @property
    @override
    def sums_evidence(self) -> bool:
        return type(self).learn is OneDensity.learn

    @override
    def start(self, rng: Draws, parameters: Any, prior: Prior, num_colours: int, size: int) -> State:
        precision = np.tile(prior.sd**-2 * np.eye(num_colours), (size, 1, 1))
        information = np.full((size, num_colours), prior.mode / prior.sd**2)
        start = describe_start(parameters, prior, size)
        return {**start, "precision": precision, "information": information, **start_felt(size)}

    @override
    def believe(self, state: State) -> Normals:
        return Normals.from_information(state["precision"], state["information"])

    @override
    def expect(self, state: State, seen: Seen) -> Normals:
        return self.believe(state).select(seen.colours).vary(state["deviation"])

    @override
    def learn(self, state: State, seen: Seen, find_likelihood: FindLikelihood, rng: Draws) -> Lesson:
        """Applies Bayes' rule with the object's own deviation marginalised; costs O(M^3) for M colours."""
        expected = self.expect(state, seen)
        likelihood = find_likelihood(expected)
        felt = get_felt(state, seen)
        added = likelihood.marginalise_deviation(state["deviation"], felt)
        added = added.embed(seen.colours, state["precision"].shape[1])
        state = set_felt(state, seen, likelihood.add(felt))
        state["precision"] = state["precision"] + added.precision
        state["information"] = state["information"] + added.information_vector
        return Lesson(state, expected.condition(likelihood), likelihood)

    @override
    def meet(self, state: State, probabilities: Array) -> tuple[State, int]:
        """Adds a material, unless the colour is almost certainly a known one.

        A colour that may belong to several materials becomes a new material with the mean and covariances of their
        mixture, so that later measurements of it update each of them in proportion to its probability. A normal
        distribution approximates the mixture (docs/decisions/0015-vision-from-pixels.md).
        """
        known, new = probabilities[:-1], probabilities[-1]
        best = int(probabilities.argmax())
        if probabilities[best] >= CERTAIN and best < len(known):
            return state, best
        believed, mode, sd = self.believe(state), state["prior_mode"], state["prior_sd"]
        variances = np.diagonal(believed.covariance, axis1=1, axis2=2)
        mean = believed.mean @ known + new * mode
        squares = (variances + (believed.mean - mean[:, None]) ** 2) @ known + new * (sd**2 + (mode - mean) ** 2)
        # The density is the known densities weighted by their probabilities, plus an independent normal variable.
        rest = squares - np.matvec(believed.covariance, known) @ known
        M = len(known)
        precision, information = pad(state["precision"], (M + 1, M + 1)).copy(), pad(state["information"], (M + 1,))
        weights = np.append(-known, 1.0)
        precision += weights[:, None] * weights / rest[:, None, None]
        information = information + weights * (new * mode / rest)[:, None]
        return {**state, "precision": precision, "information": information}, M

    @override
    def select(self, state: State, colours: Sequence[int], things: Sequence[int]) -> State:
        believed = self.believe(state).select(colours)
        felt = {name: state[name][:, list(things)] for name in (FELT_PRECISION, FELT_INFORMATION)}
        return {**state, **felt, "precision": believed.precision, "information": believed.information_vector}

    @override
    def get_felt(self, state: State, seen: Seen) -> Likelihood | None:
        felt = get_felt(state, seen)
        return felt if felt.precision.any() else None
