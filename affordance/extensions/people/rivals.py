"""Alternative learners with other kinds of memory, for comparison with human lifts.

The first learner forgets every lift. The second learns the density of each object, without generalising to objects
that look alike. The third learns a density for each appearance and the deviation of each object from it, using two
delta rules.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, override

import numpy as np

from affordance.arrays import Array
from affordance.belief.holds import Felt, Holds, add_hold, forget_things, start_holds
from affordance.belief.learner import Draws, Learner, Lesson, Seen, State, describe_start
from affordance.belief.learners import LEARNERS
from affordance.belief.normals import Normals
from affordance.belief.prior import Prior
from affordance.belief.rows import make_room, pad
from affordance.files.constraints import Setting, Within

_SHARE = Within(0.0, 1.0)
_CERTAIN_SD = 1.0  # [kg/m^3]


class OwnMemory(Learner):
    """Learner with a separate density for each object.

    The belief about an object is the prior combined with a Laplace approximation to the likelihood of all its holds.
    """

    @property
    @override
    def name(self) -> str:
        return "own_memory"

    @property
    @override
    def label(self) -> str:
        return "own memory of each object"

    @override
    def start(self, rng: Draws, parameters: Any, prior: Prior, num_colours: int, size: int) -> State:
        return {
            **describe_start(parameters, prior, size),
            **start_holds(size),
            "colours": np.zeros((size, num_colours)),
        }

    @override
    def believe(self, state: State) -> Normals:
        return _build_prior(state, state["colours"].shape[1])

    @override
    def expect(self, state: State, seen: Seen) -> Normals:
        prior, holds, N = _build_prior(state, len(seen.colours)), Holds.of(state), state["hold_count"].shape[1]
        if not N:
            return prior
        count = np.where(holds.thing == seen.things[:, None], holds.counts, 0.0)
        regressor = pad(holds.regressor, (N, holds.arm.shape[2], len(seen.colours)))[..., : len(seen.colours)]
        own = holds._replace(thing=np.zeros_like(holds.thing), counts=count, regressor=regressor)
        felt = Felt(own, np.zeros(len(count)), 0, np.zeros(len(count)))
        return prior.condition(felt.find_likelihood(prior))

    @override
    def learn(self, state: State, seen: Seen, felt: Felt, rng: Draws) -> Lesson:
        likelihood = felt.find_likelihood(self.expect(state, seen))
        state = add_hold(state, seen, felt)
        return Lesson(state, self.expect(state, seen), likelihood)

    @override
    def meet(self, state: State, probabilities: Array) -> tuple[State, int]:
        return _meet(state, probabilities, "colours", 0.0)

    @override
    def select(self, state: State, colours: Sequence[int], things: Sequence[int]) -> State:
        return {**forget_things(state, things), "colours": state["colours"][:, list(colours)]}


class NothingRemembered(OwnMemory):
    """Learner without memory: each lift starts from the prior."""

    @property
    @override
    def name(self) -> str:
        return "nothing_remembered"

    @property
    @override
    def label(self) -> str:
        return "nothing remembered"

    @override
    def learn(self, state: State, seen: Seen, felt: Felt, rng: Draws) -> Lesson:
        return super().learn(state, seen, felt, rng)._replace(state=state)


class OwnAndShared(Learner):
    """Learner with a shared density for each appearance, and a deviation from it for each object.

    The expected density of an object is their sum. After a lift, both are changed by a fraction of the error between
    felt and expected density.
    """

    @dataclass(frozen=True)
    class Parameters:
        """Learning rates of both delta rules.

        Attributes:
            own_rate: Learning rate of an object's deviation.
            shared_rate: Learning rate of the shared density of an appearance.
        """

        own_rate: Annotated[float, _SHARE, Setting("1", "a guess, to be fitted to persons")] = 0.3
        shared_rate: Annotated[float, _SHARE, Setting("1", "a guess, to be fitted to persons")] = 0.1

    @property
    @override
    def name(self) -> str:
        return "own_and_shared"

    @property
    @override
    def label(self) -> str:
        return "own and shared memory, delta rules"

    @override
    def start(self, rng: Draws, parameters: Any, prior: Prior, num_colours: int, size: int) -> State:
        shared = np.full((size, num_colours), prior.mode)
        return {**describe_start(parameters, prior, size), "shared": shared, "own": np.zeros((size, 0, 0))}

    @override
    def believe(self, state: State) -> Normals:
        """Returns the shared densities with negligible uncertainty, because delta rules do not represent it."""
        mean = state["shared"]
        return Normals(mean, np.tile(_CERTAIN_SD**2 * np.eye(mean.shape[1]), (len(mean), 1, 1)))

    @override
    def expect(self, state: State, seen: Seen) -> Normals:
        state, thing = make_room(state, ("own",), seen), (np.arange(len(seen.things)), seen.things)
        return _surround(state, state["shared"][:, list(seen.colours)] + state["own"][thing][:, : len(seen.colours)])

    @override
    def learn(self, state: State, seen: Seen, felt: Felt, rng: Draws) -> Lesson:
        state, thing = make_room(state, ("own",), seen), (np.arange(len(seen.things)), seen.things)
        expected = self.expect(state, seen)
        likelihood = felt.find_likelihood(expected)
        known = expected.condition(likelihood)
        error = known.mean - expected.mean
        own, shared = state["own"].copy(), state["shared"].copy()
        own[*thing, : len(seen.colours)] += state["own_rate"][:, None] * error
        shared[:, list(seen.colours)] += state["shared_rate"][:, None] * error
        return Lesson({**state, "own": own, "shared": shared}, known, likelihood)

    @override
    def meet(self, state: State, probabilities: Array) -> tuple[State, int]:
        return _meet(state, probabilities, "shared", state["prior_mode"])

    @override
    def select(self, state: State, colours: Sequence[int], things: Sequence[int]) -> State:
        return {**state, "shared": state["shared"][:, list(colours)], "own": state["own"][:, list(things)]}


def _build_prior(state: State, count: int) -> Normals:
    """Returns the prior of ``count`` densities."""
    return _surround(state, np.tile(state["prior_mode"][:, None], (1, count)))


def _surround(state: State, mean: Array) -> Normals:
    """Returns normal distributions about densities, (B, M), with the SD of the prior.

    This SD is large enough not to bias the estimate from a measurement.
    """
    return Normals(mean, state["prior_sd"][:, None, None] ** 2 * np.eye(mean.shape[1]))


def _meet(state: State, probabilities: Array, name: str, value: Any) -> tuple[State, int]:
    """Adds a colour to an array, (B, M), unless a known colour is most probable."""
    best, count = int(probabilities.argmax()), len(probabilities) - 1
    if best < count:
        return state, best
    array = pad(state[name], (count + 1,)).copy()
    array[:, count] = value
    return {**state, name: array}, count


NOTHING_REMEMBERED, OWN_MEMORY, OWN_AND_SHARED = NothingRemembered(), OwnMemory(), OwnAndShared()
# Learners for comparison with human lifts, by name. They are not simulated by default.
RIVALS: Mapping[str, Learner] = {each.name: each for each in (NOTHING_REMEMBERED, OWN_MEMORY, OWN_AND_SHARED)}


def label_learner(name: str) -> str:
    """Returns the label of a learner for figures, given its name."""
    known = {**LEARNERS, **RIVALS}.get(name)
    return known.label if known is not None else name
