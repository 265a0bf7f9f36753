"""Likelihood of one person's pushes, from a particle filter over a learner's states, and its free parameters.

Two things are unobserved: what a person felt in a lift and, for learners that draw, which hypothesis was adopted.
Particles draw both. Before each lift they are weighted by the probability density of the push (bootstrap filter), and
resampled if the effective number is below half. Rows of the learner's arrays are D values of the parameters times P
particles. All values share one stream of random numbers, so that differences in likelihood are caused by the values
alone as far as possible.
"""

import math
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit, logsumexp

from affordance.arrays import Array
from affordance.belief.density_belief import DENSITY_FLOOR
from affordance.belief.learner import Learner, Seen
from affordance.belief.rows import take_rows
from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.people.participant import Participant, Pushes, take, with_participant
from affordance.extensions.people.pushes import Person
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.files.constraints import Within, list_field_types
from affordance.objects.tool import Tool
from affordance.settings import Settings

# Parameters of participants that can be fitted.
OF_PARTICIPANTS = ("push_error", "gain", "lapse")
_MOST_FREE = 8


@dataclass(frozen=True)
class FreeParameter:
    """Free parameter whose prior is normal in its logarithm, or in its logit if it is a fraction."""

    name: str
    median: float
    sd: float  # SD of the logarithm or logit
    is_share: bool
    low: float
    high: float

    def convert(self, normal: Array) -> Array:
        """Converts standard normal numbers to values of the parameter, clipped to its bounds."""
        moved = self.sd * normal
        value = expit(logit(self.median) + moved) if self.is_share else self.median * np.exp(moved)
        clipped: Array = np.clip(value, self.low, self.high)
        return clipped


# Median, and SD of logarithm or logit, of parameters whose usual value is not an estimate for people. All other
# parameters have their usual value as median and an SD of 1.
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
        participant: Participant, whose parameters are fixed unless named.
        names: Names of the free parameters; None for the error of the push and the learner's ``fitted`` parameters.

    Raises:
        BadValueError: A name is unknown or repeated, there are too many, or the error of the push is 0 and not free.
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


def set_values(
    learner: Learner, participant: Participant, free: Sequence[FreeParameter], values: Array
) -> tuple[Learner, Participant]:
    """Returns learner and participant with the free parameters set to ``values``, (observers, parameters)."""
    by_name = {each.name: tuple(values[:, column].tolist()) for column, each in enumerate(free)}
    own = {name: value for name, value in by_name.items() if name not in OF_PARTICIPANTS}
    pushed = {name: value for name, value in by_name.items() if name in OF_PARTICIPANTS}
    fixed = {name: getattr(participant, name) for name in OF_PARTICIPANTS}
    return learner.change(**own) if own else learner, Participant(**{**fixed, **pushed})


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
        problem = f"cannot have {name}, whose usual value is {median:g}: a prior needs one above 0"
        raise BadValueError("--free", "", f"{problem}{' and below 1' if is_share else ''}")
    return FreeParameter(name, median, sd, is_share, max(bound.low, 1e-12 * median), bound.high)


class _SharedDraws:
    """Random numbers for P particles of each of D parameter values, equal for all values."""

    def __init__(self, rng: np.random.Generator, values: int, particles: int) -> None:
        self._rng, self._values, self._particles = rng, values, particles

    def random(self, size: tuple[int, ...], /) -> Array:
        """Draws uniform numbers; the first dimension is that of rows."""
        return self._repeat(self._rng.random((self._particles, *size[1:])))

    def standard_normal(self, size: tuple[int, ...], /) -> Array:
        """Draws standard normal numbers; the first dimension is that of rows."""
        return self._repeat(self._rng.standard_normal((self._particles, *size[1:])))

    def _repeat(self, drawn: Array) -> Array:
        return np.tile(drawn, (self._values, *[1] * (drawn.ndim - 1)))


def compute_log_likelihoods(
    person: Person,
    tools: Sequence[Tool],
    learner: Learner,
    settings: Settings,
    free: Sequence[FreeParameter],
    values: Array,
    *,
    particles: int,
    seed: tuple[int, ...],
) -> Array:
    """Computes the log probability density of each push given those before it, (D, N); 0 for an unknown push.

    Args:
        person: Lifts of the person.
        tools: Objects that were lifted.
        learner: Learner; its parameters that are not free keep their values.
        settings: Settings; their participant has the values that are not free.
        free: Free parameters, F of them.
        values: Values of the free parameters, (D, F).
        particles: Number of particles P for each value.
        seed: Seed of the stream of random numbers.
    """
    D, P = len(values), particles
    rng = np.random.default_rng(seed)
    draws = _SharedDraws(rng, D, P)
    learner, participant = set_values(
        learner, with_participant(settings).participant, free, np.repeat(values, P, axis=0)
    )
    pushes = _get_pushes(participant, D * P)
    lifter = StaticLifter(tools, settings)
    state = learner.start(draws, learner.parameters, settings.prior, len(lifter.colours), D * P)
    lifter = lifter.of_learner(learner)
    order = np.full((1, len(tools)), np.inf)
    log_weights, last = np.full((D, P), -np.log(P)), np.full(D * P, np.nan)
    found = np.zeros((D, len(person.objects)))
    for number, (lifted, push, teaches) in enumerate(zip(person.objects, person.pushes, person.teaches, strict=True)):
        thing = lifter.identify(np.array([lifted]), order)
        if teaches:
            order[0, thing] = np.minimum(order[0, thing], number)
        colours, rows = lifter.list_colours(int(thing[0])), np.full(D * P, lifted)
        seen, Phi = Seen(colours, np.repeat(thing, D * P)), lifter.gather(rows, colours)
        believed = np.vecdot(Phi[:, 0], learner.expect(state, seen).compute_mode(DENSITY_FLOOR)) * lifter.gravity
        if np.isfinite(push):
            weighted = log_weights + pushes.compute_log_density(push, believed, last).reshape(D, P)
            found[:, number] = logsumexp(weighted, axis=1)
            log_weights = weighted - found[:, number, None]
        if teaches:
            # Errors of this lift are drawn for each index of a particle, whichever particle occupies it then.
            drawn, log_weights = _draw_anew(log_weights, float(rng.random()))
            if drawn is not None:
                state, believed = take_rows(state, drawn), believed[drawn]
            errors = draws.standard_normal((D * P, 2, lifter.num_joints)) * lifter.error_sds[:, None]
            state = lifter.feel(state, seen, np.full(D * P, lifted), Phi, errors, draws).state
        last = believed
    return found


def _get_pushes(participant: Participant, size: int) -> Pushes:
    error, gain, lapse = (take(participant, name, range(size)) for name in ("push_error", "gain", "lapse"))
    return Pushes(error, gain, lapse)


def _draw_anew(log_weights: Array, uniform: float) -> tuple[NDArray[np.intp] | None, Array]:
    """Resamples particles (systematically) for values with few effective ones; returns None if there are none."""
    D, P = log_weights.shape
    weights = np.exp(log_weights)
    few = 1.0 / (weights**2).sum(axis=1) < 0.5 * P
    if not few.any():
        return None, log_weights
    cumulative = np.cumsum(weights, axis=1)
    cumulative /= cumulative[:, -1:]
    places = (uniform + np.arange(P)) / P
    chosen = np.tile(np.arange(P), (D, 1))
    for row in np.flatnonzero(few):
        chosen[row] = np.searchsorted(cumulative[row], places)
    log_weights = np.where(few[:, None], -np.log(P), log_weights)
    return (chosen + P * np.arange(D)[:, None]).ravel(), log_weights
