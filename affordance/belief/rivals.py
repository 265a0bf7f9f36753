"""Learners that are compared with those of the program: nothing remembered, own memory, own and shared memory.

No working arm uses them. The first forgets every lift; the second has a density for each object and none for a look;
the third has a density for each look and a deviation from it for each object, both moved by a share of each error
(delta rules).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, override

import numpy as np

from affordance.arrays import Array
from affordance.belief.learner import Draws, FindLikelihood, Learner, Lesson, Seen, State, describe_start
from affordance.belief.normals import Normals
from affordance.belief.prior import Prior
from affordance.belief.rows import FELT_INFORMATION, FELT_PRECISION, get_felt, make_room, pad, set_felt, start_felt
from affordance.files.constraints import Setting, Within

_SHARE = Within(0.0, 1.0)
_CERTAIN_SD = 1.0  # [kg/m^3]


class OwnMemory(Learner):
    """Learner with a density for each object: it expects any object never lifted to have the density of the prior."""

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
            **start_felt(size),
            "colours": np.zeros((size, num_colours)),
        }

    @override
    def believe(self, state: State) -> Normals:
        return _build_prior(state, state["colours"].shape[1])

    @override
    def expect(self, state: State, seen: Seen) -> Normals:
        return _build_prior(state, len(seen.colours)).condition(get_felt(state, seen))

    @override
    def learn(self, state: State, seen: Seen, find_likelihood: FindLikelihood, rng: Draws) -> Lesson:
        expected = self.expect(state, seen)
        likelihood = find_likelihood(expected)
        felt = get_felt(state, seen)
        return Lesson(set_felt(state, seen, likelihood.add(felt)), expected.condition(likelihood), likelihood)

    @override
    def meet(self, state: State, probabilities: Array) -> tuple[State, int]:
        return _meet(state, probabilities, "colours", 0.0)

    @override
    def select(self, state: State, colours: Sequence[int], things: Sequence[int]) -> State:
        felt = {name: state[name][:, list(things)] for name in (FELT_PRECISION, FELT_INFORMATION)}
        return {**state, **felt, "colours": state["colours"][:, list(colours)]}


class NothingRemembered(OwnMemory):
    """Learner that forgets: each lift begins at the prior, and what is felt counts within that lift only."""

    @property
    @override
    def name(self) -> str:
        return "nothing_remembered"

    @property
    @override
    def label(self) -> str:
        return "nothing remembered"

    @override
    def learn(self, state: State, seen: Seen, find_likelihood: FindLikelihood, rng: Draws) -> Lesson:
        return super().learn(state, seen, find_likelihood, rng)._replace(state=state)

    @override
    def select(self, state: State, colours: Sequence[int], things: Sequence[int]) -> State:
        return {**state, "colours": state["colours"][:, list(colours)]}  # nothing is kept of things


class OwnAndShared(Learner):
    """Learner with a shared density for each look, and a deviation from it for each object.

    An object is expected to have the sum of both. After a lift both move by a share of the difference between the
    density that was felt and this sum.
    """

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of both delta rules.

        Attributes:
            own_rate: Share of an error by which the deviation of an object moves.
            shared_rate: Share of an error by which the density of its look moves.
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
        """Returns the shared densities, as good as certain: a delta rule knows no uncertainty."""
        mean = state["shared"]
        return Normals(mean, np.tile(_CERTAIN_SD**2 * np.eye(mean.shape[1]), (len(mean), 1, 1)))

    @override
    def expect(self, state: State, seen: Seen) -> Normals:
        state, thing = make_room(state, ("own",), seen), (np.arange(len(seen.things)), seen.things)
        return _surround(state, state["shared"][:, list(seen.colours)] + state["own"][thing][:, : len(seen.colours)])

    @override
    def learn(self, state: State, seen: Seen, find_likelihood: FindLikelihood, rng: Draws) -> Lesson:
        state, thing = make_room(state, ("own",), seen), (np.arange(len(seen.things)), seen.things)
        expected = self.expect(state, seen)
        likelihood = find_likelihood(expected)
        felt = expected.condition(likelihood)
        error = felt.mean - expected.mean
        own, shared = state["own"].copy(), state["shared"].copy()
        own[*thing, : len(seen.colours)] += state["own_rate"][:, None] * error
        shared[:, list(seen.colours)] += state["shared_rate"][:, None] * error
        return Lesson({**state, "own": own, "shared": shared}, felt, likelihood)

    @override
    def meet(self, state: State, probabilities: Array) -> tuple[State, int]:
        return _meet(state, probabilities, "shared", state["prior_mode"])

    @override
    def select(self, state: State, colours: Sequence[int], things: Sequence[int]) -> State:
        return {**state, "shared": state["shared"][:, list(colours)], "own": state["own"][:, list(things)]}


def _build_prior(state: State, count: int) -> Normals:
    """Builds the prior of several densities."""
    return _surround(state, np.tile(state["prior_mode"][:, None], (1, count)))


def _surround(state: State, mean: Array) -> Normals:
    """Surrounds densities, (B, M), by the SD of the prior, so that what is felt is hardly drawn towards them."""
    return Normals(mean, state["prior_sd"][:, None, None] ** 2 * np.eye(mean.shape[1]))


def _meet(state: State, probabilities: Array, name: str, value: Any) -> tuple[State, int]:
    """Adds a colour with a value to an array of colours, (B, M), unless a known colour is the most probable one."""
    best, count = int(probabilities.argmax()), len(probabilities) - 1
    if best < count:
        return state, best
    array = pad(state[name], (count + 1,)).copy()
    array[:, count] = value
    return {**state, name: array}, count
