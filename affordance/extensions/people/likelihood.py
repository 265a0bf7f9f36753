"""Likelihood of a participant's pushes, estimated with a bootstrap particle filter over the states of a learner.

The measurement in each lift is unobserved and, for learners with random hypotheses, so is the chosen hypothesis.
Particles sample both. They are weighted by the probability density of each push, and resampled if their effective
number is below half. Learning does not depend on pushes. Particle trajectories are therefore simulated once for each
parameter vector of the learner, and reweighted for any parameter vector of the participant. Rows of the learner's
arrays are K parameter vectors times P particles. All parameter vectors use the same random numbers, so that
differences in likelihood are mostly due to the parameters.
"""

import math
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit, logsumexp, softmax

from affordance.arrays import Array
from affordance.belief.density_belief import DENSITY_FLOOR
from affordance.belief.learner import Learner, Seen
from affordance.belief.rows import take_rows
from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.people.participant import Participant, Pushes, take, with_participant
from affordance.extensions.people.pushes import Person
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.extensions.people.tempered_smc import draw_prior
from affordance.files.constraints import Within, list_field_types
from affordance.objects.tool import Tool
from affordance.settings import Settings

# Parameters of participants that can be fitted.
OF_PARTICIPANTS = ("push_error", "gain", "lapse")
_MOST_FREE = 8
# Number of prior draws of a participant's parameters for averaging the weights of particles.
_AVERAGED = 16


@dataclass(frozen=True)
class FreeParameter:
    """Free parameter whose logarithm, or logit for a fraction, has a normal prior."""

    name: str
    median: float
    sd: float  # SD of the logarithm or logit
    is_share: bool
    low: float
    high: float

    def convert(self, normal: Array) -> Array:
        """Converts standard normal numbers to values of the parameter within its bounds."""
        moved = self.sd * normal
        value = expit(logit(self.median) + moved) if self.is_share else self.median * np.exp(moved)
        clipped: Array = np.clip(value, self.low, self.high)
        return clipped


# Prior median, and SD of the logarithm or logit, of parameters whose default is no estimate for humans. For all other
# parameters the median is the default, and the SD is 1.
_PRIORS: Mapping[str, tuple[float, float]] = {
    "push_error": (0.2, 0.5),
    "gain": (1.0, 0.2),
    "lapse": (0.05, 1.0),
    "own_drift": (0.07, 0.5),
}
_KAPPA_SD = 0.5


def list_free(learner: Learner, participant: Participant, names: Sequence[str] | None = None) -> list[FreeParameter]:
    """Lists the free parameters of a fit.

    Args:
        learner: Learner.
        participant: Participant with the values of fixed parameters.
        names: Names of the free parameters; None for ``push_error`` and the ``fitted`` parameters of the learner.

    Raises:
        BadValueError: A name is unknown or repeated, there are too many, or ``push_error`` is 0 and not free.
    """
    known = [*OF_PARTICIPANTS, *_list_types(learner)]
    chosen = list(names) if names is not None else ["push_error", *learner.fitted]
    for name in chosen:
        if name not in known:
            raise BadValueError("--free", "", describe_choice(name, known))
        if chosen.count(name) > 1:
            raise BadValueError("--free", "", f"has {name} twice")
    if len(chosen) > _MOST_FREE:
        raise BadValueError("--free", "", f"has {len(chosen)} parameters, must have at most {_MOST_FREE}")
    if "push_error" not in chosen and not np.min(participant.push_error) > 0.0:
        problem = "is 0, must be above 0, such as .2 (no push is exactly what a learner predicts), or be in --free"
        raise BadValueError("--set", "participant.push_error", problem)
    return [_describe(name, learner, participant) for name in chosen]


def set_learner(learner: Learner, free: Sequence[FreeParameter], values: Array) -> Learner:
    """Returns a learner with free parameters set to ``values``, (observers, parameters)."""
    return learner.change(**_name_values(free, values)) if free else learner


def set_participant(participant: Participant, free: Sequence[FreeParameter], values: Array) -> Participant:
    """Returns a participant with free parameters set to ``values``, (observers, parameters), and zero spreads."""
    fixed = {name: getattr(participant, name) for name in OF_PARTICIPANTS}
    return Participant(**{**fixed, **_name_values(free, values)})


def _name_values(free: Sequence[FreeParameter], values: Array) -> dict[str, tuple[float, ...]]:
    return {each.name: tuple(column) for each, column in zip(free, values.T.tolist(), strict=True)}


def split_free(free: Sequence[FreeParameter]) -> tuple[list[int], list[int]]:
    """Lists the indices of the learner's and of the participant's free parameters."""
    is_pushed = [each.name in OF_PARTICIPANTS for each in free]
    return [i for i, it in enumerate(is_pushed) if not it], [i for i, it in enumerate(is_pushed) if it]


def _list_types(learner: Learner) -> Mapping[str, Any]:
    kind: Any = type(learner.parameters)
    return list_field_types(kind)


def _describe(name: str, learner: Learner, participant: Participant) -> FreeParameter:
    if name in OF_PARTICIPANTS:
        median, sd = _PRIORS[name]
        low, high = {"push_error": (1e-3, 1.0), "gain": (0.1, 10.0), "lapse": (0.0, 1.0)}[name]
        return FreeParameter(name, median, sd, name == "lapse", low, high)
    notes = typing.get_args(_list_types(learner)[name])[1:]
    bound = next((each for each in notes if isinstance(each, Within)), Within())
    usual = getattr(learner.usual.parameters, name)
    median, sd = _PRIORS.get(name, (usual, _KAPPA_SD if name == "kappa" else 1.0))
    is_share = (bound.low, bound.high) == (0.0, 1.0)
    if median <= 0.0 or not math.isfinite(median) or (is_share and median >= 1.0):
        problem = f"cannot have {name}, whose default is {median:g}: the prior needs a default above 0"
        raise BadValueError("--free", "", f"{problem}{' and below 1' if is_share else ''}")
    return FreeParameter(name, median, sd, is_share, max(bound.low, 1e-12 * median), bound.high)


class _SharedDraws:
    """Random numbers for K parameter vectors with P particles each; equal seeds produce equal numbers."""

    def __init__(self, seeds: Sequence[tuple[int, ...]], particles: int) -> None:
        self._streams = {seed: np.random.default_rng(seed) for seed in seeds}
        self._seeds, self._particles = seeds, particles

    def random(self, size: tuple[int, ...], /) -> Array:
        """Draws uniform numbers, with one row per particle."""
        return self._draw({seed: rng.random((self._particles, *size[1:])) for seed, rng in self._streams.items()})

    def standard_normal(self, size: tuple[int, ...], /) -> Array:
        """Draws standard normal numbers, with one row per particle."""
        shape = (self._particles, *size[1:])
        return self._draw({seed: rng.standard_normal(shape) for seed, rng in self._streams.items()})

    def draw_once(self) -> Array:
        """Draws one uniform number for each parameter vector, (K,)."""
        drawn = {seed: [rng.random()] for seed, rng in self._streams.items()}
        return self._draw(drawn)

    def _draw(self, drawn: Mapping[tuple[int, ...], Any]) -> Array:
        return np.concatenate([drawn[seed] for seed in self._seeds])


class Courses(NamedTuple):
    """Particle trajectories over a participant's N lifts, for K parameter vectors with P particles each.

    Attributes:
        believed: Weight of the object believed before each lift, (K, N, P), [N].
        last: Weight believed before the previous lift, (K, N, P), [N]; NaN in the first lift.
        ancestors: Index of each particle's ancestor after resampling, (K, N, P).
        log_changes: Change in the log weight of a particle due to resampling, (K, N, P).
    """

    believed: Array
    last: Array
    ancestors: NDArray[np.intp]
    log_changes: Array

    def take(self, values: NDArray[np.intp]) -> "Courses":
        """Selects the trajectories of some of the K parameter vectors."""
        return Courses(self.believed[values], self.last[values], self.ancestors[values], self.log_changes[values])


def draw_courses(
    person: Person,
    tools: Sequence[Tool],
    learner: Learner,
    settings: Settings,
    free: Sequence[FreeParameter],
    values: Array,
    *,
    particles: int,
    seeds: Sequence[tuple[int, ...]],
) -> Courses:
    """Simulates particle trajectories over a participant's lifts for K parameter vectors of the learner.

    Learning does not depend on pushes, so the trajectories are valid for all parameters of the participant. For
    resampling, weights of particles are averaged over the prior of these parameters.

    Args:
        person: Lifts of the participant.
        tools: Objects that were lifted.
        learner: Learner with the values of its fixed parameters.
        settings: Settings with the fixed parameters of the participant.
        free: All free parameters.
        values: Parameter vectors of the learner, (K, F).
        particles: Number of particles P per parameter vector.
        seeds: Seed of the random stream of each parameter vector, K seeds.
    """
    K, P, N = len(values), particles, len(person.objects)
    draws = _SharedDraws(seeds, P)
    of_learner, pushed = ([free[i] for i in places] for places in split_free(free))
    learner = set_learner(learner, of_learner, np.repeat(values, P, axis=0))
    normal = draw_prior(_AVERAGED, _MOST_FREE, 0)
    usual = np.array([each.convert(z) for each, z in zip(pushed, normal.T, strict=False)]).reshape(-1, _AVERAGED).T
    pushes = _get_pushes(with_participant(settings).participant, pushed, usual)
    lifter = StaticLifter(tools, settings)
    state = learner.start(draws, learner.parameters, settings.prior, len(lifter.colours), K * P)
    lifter = lifter.of_learner(learner)
    things = lifter.identify_all(person.objects, person.teaches)
    numbers = np.unique(things, return_inverse=True)[1]  # a table can have many objects that look the same
    found = Courses(
        np.empty((K, N, P)), np.full((K, N, P), np.nan), np.tile(np.arange(P), (K, N, 1)), np.zeros((K, N, P))
    )
    log_weights = np.zeros((K, _AVERAGED, P))
    lifts = zip(person.objects, things, numbers, person.pushes, person.teaches, strict=True)
    for number, (lifted, thing, known, push, teaches) in enumerate(lifts):
        colours, rows = lifter.list_colours(thing), np.full(K * P, lifted)
        seen, Phi = Seen(colours, np.full(K * P, known)), lifter.gather(rows, colours)
        expected = np.vecdot(Phi[:, 0], learner.expect(state, seen).compute_mode(DENSITY_FLOOR)) * lifter.gravity
        found.believed[:, number] = believed = expected.reshape(K, P)
        if np.isfinite(push):
            log_weights += pushes.compute_log_density(push, believed[:, None], found.last[:, number, None])
        if teaches:
            # Measurement errors belong to the index of a particle and are not resampled.
            ancestors, log_changes = _draw_anew(logsumexp(log_weights, axis=1), draws.draw_once())
            found.ancestors[:, number], found.log_changes[:, number] = ancestors, log_changes
            log_weights = np.take_along_axis(log_weights, ancestors[:, None], axis=2) + log_changes[:, None]
            believed = np.take_along_axis(believed, ancestors, axis=1)
            drawn = (ancestors + P * np.arange(K)[:, None]).ravel()
            state = state if (drawn == np.arange(K * P)).all() else take_rows(state, drawn)
            errors = draws.standard_normal((K * P, 2, lifter.num_joints)) * lifter.error_sds[:, None]
            state = lifter.feel(state, seen, np.full(K * P, lifted), Phi, errors, draws).state
        if number + 1 < N:
            found.last[:, number + 1] = believed
    return found


class Filtered(NamedTuple):
    """Predictive distributions of pushes given all previous pushes, (D, N) each."""

    log_density: Array  # 0 if the push is missing
    predicted: Array  # predictive mean, [N]


def filter_pushes(
    person: Person,
    courses: Courses,
    places: NDArray[np.intp],
    participant: Participant,
    free: Sequence[FreeParameter],
    values: Array,
) -> Filtered:
    """Computes the predictive log density and mean of each push given all previous pushes.

    Args:
        person: Lifts of the participant.
        courses: Particle trajectories over these lifts for K parameter vectors of the learner.
        places: Index of the learner's parameter vector for each of D draws, (D,).
        participant: Participant with the values of fixed parameters.
        free: Free parameters of the participant.
        values: Values of these parameters for each draw, (D, F).
    """
    D, P = len(places), courses.believed.shape[2]
    pushes = _get_pushes(participant, free, values)
    log_weights, total = np.full((D, P), -np.log(P)), np.zeros(D)
    found = Filtered(*np.zeros((2, D, len(person.pushes))))
    for number, push in enumerate(person.pushes):
        believed, last = courses.believed[places, number], courses.last[places, number]
        means = pushes.compute_mean(believed, last)
        found.predicted[:, number] = np.vecdot(softmax(log_weights, axis=1), means)
        if np.isfinite(push):
            log_weights = log_weights + pushes.compute_log_density(push, believed, last)
            before, total = total, logsumexp(log_weights, axis=1)
            found.log_density[:, number] = total - before
        if courses.log_changes[:, number].any():
            log_weights = np.take_along_axis(log_weights, courses.ancestors[places, number], axis=1)
            log_weights = log_weights + courses.log_changes[places, number]
    return found


def _get_pushes(participant: Participant, free: Sequence[FreeParameter], values: Array) -> Pushes:
    """Returns push parameters, (D, 1) each, for values of the free parameters, (D, F)."""
    own = set_participant(participant, free, values)
    return Pushes(*(take(own, name, range(len(values)))[:, None] for name in OF_PARTICIPANTS))


def _draw_anew(log_weights: Array, uniform: Array) -> tuple[NDArray[np.intp], Array]:
    """Resamples particles systematically if their effective number is below half.

    Args:
        log_weights: Log weights of the particles of each parameter vector, (K, P).
        uniform: Uniform random number for each parameter vector, (K,).

    Returns: Ancestor of each particle, (K, P), and change in its log weight, (K, P).
    """
    K, P = log_weights.shape
    log_shares = log_weights - logsumexp(log_weights, axis=1, keepdims=True)
    weights = np.exp(log_shares)
    few = 1.0 / (weights**2).sum(axis=1) < 0.5 * P
    chosen, log_changes = np.tile(np.arange(P), (K, 1)), np.zeros((K, P))
    cumulative = np.cumsum(weights, axis=1)
    cumulative /= cumulative[:, -1:]
    places = (uniform[:, None] + np.arange(P)) / P
    for row in np.flatnonzero(few):
        chosen[row] = np.searchsorted(cumulative[row], places[row])
        log_changes[row] = -np.log(P) - log_shares[row, chosen[row]]
    return chosen, log_changes
