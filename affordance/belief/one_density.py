"""Learner with one mean density per material, updated by Bayes' rule (paper).

The densities of an object deviate from the mean densities of its materials; the deviations are equal in all lifts of
the object. The state stores all holds, from which ``exact`` computes the posterior.
"""

from collections.abc import Sequence
from typing import Any, override

import numpy as np

from affordance.arrays import Array
from affordance.belief.colour_recognition import CERTAIN
from affordance.belief.density_belief import Prior
from affordance.belief.exact import Experience, Posterior, compute_posterior
from affordance.belief.holds import Felt, Holds, add_hold, add_holds, forget_things, start_holds
from affordance.belief.learner import Draws, Learner, Lesson, Seen, State, describe_start
from affordance.belief.normals import Normals
from affordance.belief.rows import make_room, pad


class OneDensity(Learner):
    """Learner with one density per colour.

    Its state contains all holds (``holds``) and the following arrays for M colours and T objects with at most C
    colours: precision, (B, M, M), and information vector, (B, M), of the prior; mean, (B, M), and covariance,
    (B, M, M), of the belief; the colours of each object, (B, T, C), with a mask of used places.
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
    def is_exact(self) -> bool:
        return type(self).learn is OneDensity.learn

    @override
    def start(self, rng: Draws, parameters: Any, prior: Prior, num_colours: int, size: int) -> State:
        precision = np.tile(prior.sd**-2 * np.eye(num_colours), (size, 1, 1))
        information = np.full((size, num_colours), prior.mode / prior.sd**2)
        state = {**describe_start(parameters, prior, size), **start_holds(size)}
        things = {
            "thing_kind": np.zeros((size, 0, 0), dtype=np.intp),
            "has_colour": np.zeros((size, 0, 0), dtype=bool),
        }
        return self.set_prior({**state, **things}, precision, information)

    def set_prior(self, state: State, precision: Array, information: Array) -> State:
        """Replaces the prior of the mean densities, and updates the belief.

        Args:
            state: State of B observers.
            precision: Precision of the prior, (B, M, M).
            information: Information vector of the prior, (B, M).
        """
        return self.infer({**state, "precision": precision, "information": information})[0]

    @override
    def believe(self, state: State) -> Normals:
        return Normals(state["mean"], state["covariance"])

    @override
    def expect(self, state: State, seen: Seen) -> Normals:
        return self.believe(state).select(seen.colours).vary(state["deviation"])

    @override
    def learn(self, state: State, seen: Seen, felt: Felt, rng: Draws) -> Lesson:
        """Adds a lift, and computes the posterior given all holds."""
        likelihood = felt.find_likelihood(self.expect(state, seen))
        state, posterior = self.infer(self.add(state, seen, felt), seen)
        assert posterior.own is not None
        return Lesson(state, posterior.own.select(range(len(seen.colours))), likelihood)

    def add(self, state: State, seen: Seen, felt: Felt) -> State:
        """Adds a hold to the state without updating the belief."""
        return add_hold(_know(state, seen), seen, felt)

    def add_many(self, state: State, lifts: Sequence[tuple[Seen, Felt]]) -> State:
        """Adds many holds to the state of a single observer without updating the belief."""
        numbers = [int(seen.things[0]) for seen, _ in lifts]
        for seen, _ in dict(zip(numbers, lifts, strict=True)).values():
            state = _know(state, seen)
        return add_holds(state, numbers, [felt for _, felt in lifts])

    def leave_out(self, state: State, things: Sequence[int]) -> State:
        """Removes objects and their holds from the state without updating the belief."""
        kept = [thing for thing in range(state["thing_kind"].shape[1]) if thing not in things]
        of_things = {name: state[name][:, kept] for name in ("thing_kind", "has_colour")}
        return {**forget_things(state, kept), **of_things}

    def infer(self, state: State, seen: Seen | None = None) -> tuple[State, Posterior]:
        """Computes the belief from all holds.

        Returns:
            State with this belief, and posterior, with the densities of the object ``seen`` if it is given.
        """
        prior = Normals.from_information(state["precision"], state["information"])
        of_things = state["thing_kind"], state["has_colour"], state["deviation"]
        wanted = None if seen is None else seen.things
        posterior = compute_posterior(Experience(prior, Holds.of(state), *of_things, wanted))
        return {**state, "mean": posterior.means.mean, "covariance": posterior.means.covariance}, posterior

    @override
    def meet(self, state: State, probabilities: Array) -> tuple[State, int]:
        """Adds a material, unless the colour is almost certainly a known colour.

        The prior of the new material is a mixture over all materials to which the colour may belong, approximated by
        a normal distribution with the mixture's mean and covariances. Later lifts of the new material therefore also
        update these materials, in proportion to their probabilities (docs/decisions/0015-vision-from-pixels.md).
        """
        known, new = probabilities[:-1], probabilities[-1]
        best = int(probabilities.argmax())
        if probabilities[best] >= CERTAIN and best < len(known):
            return state, best
        state = self.infer(state)[0] if known.any() else state  # the belief may not include the latest holds
        believed, mode, sd = self.believe(state), state["prior_mode"], state["prior_sd"]
        variances = np.diagonal(believed.covariance, axis1=1, axis2=2)
        mean = believed.mean @ known + new * mode
        squares = (variances + (believed.mean - mean[:, None]) ** 2) @ known + new * (sd**2 + (mode - mean) ** 2)
        # The density is the average of known densities weighted by probability, plus an independent normal variable.
        rest = squares - np.matvec(believed.covariance, known) @ known
        M = len(known)
        precision, information = pad(state["precision"], (M + 1, M + 1)).copy(), pad(state["information"], (M + 1,))
        weights = np.append(-known, 1.0)
        precision += weights[:, None] * weights / rest[:, None, None]
        information = information + weights * (new * mode / rest)[:, None]
        return self.set_prior(state, precision, information), M

    @override
    def select(self, state: State, colours: Sequence[int], things: Sequence[int]) -> State:
        """Selects colours and objects.

        The prior of the selected colours absorbs the evidence from removed objects.
        """
        kept, believed = list(things), self.believe(state).select(colours)
        prior = Normals.from_information(state["precision"], state["information"]).select(colours)
        numbers = np.zeros(max([*colours, -1]) + 1, dtype=np.intp)
        numbers[list(colours)] = np.arange(len(colours))
        has_colour = state["has_colour"][:, kept]
        kinds = np.where(has_colour, numbers[np.where(has_colour, state["thing_kind"][:, kept], colours[0])], 0)
        others = state["has_colour"].any(axis=2).sum() > has_colour.any(axis=2).sum()
        state = {**forget_things(state, things), "thing_kind": kinds, "has_colour": has_colour}
        state = self.set_prior(state, prior.precision, prior.information_vector)
        if not others:
            return state
        told = self.believe(state)
        precision = prior.precision + believed.precision - told.precision
        information = prior.information_vector + believed.information_vector - told.information_vector
        return self.set_prior(state, precision, information)


def _know(state: State, seen: Seen) -> State:
    """Stores the colours of an object in the state."""
    state = make_room(state, ("thing_kind", "has_colour"), seen)
    there = np.arange(len(seen.things)), seen.things
    for name, value in (("thing_kind", seen.colours), ("has_colour", True)):
        state[name] = state[name].copy()
        state[name][*there, : len(seen.colours)] = value
    return state
