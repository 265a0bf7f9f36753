"""Likelihood of one person's pushes, from a particle filter over a learner's states.

Two things are unobserved: what a person felt in a lift and, for learners that draw, which hypothesis was adopted.
Particles draw both. Before each lift they are weighted by the probability density of the push (bootstrap filter), and
resampled if the effective number is below half. Rows of the learner's arrays are D values of the parameters times P
particles. All values share one stream of random numbers, so that differences in likelihood are caused by the values
alone as far as possible.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from affordance.arrays import Array
from affordance.belief.density_belief import DENSITY_FLOOR
from affordance.belief.learner import Learner, Seen
from affordance.belief.rows import take_rows
from affordance.extensions.people.free_parameters import FreeParameter, set_values
from affordance.extensions.people.lift_settings import with_participant
from affordance.extensions.people.participant import Participant
from affordance.extensions.people.push import Pushes, take
from affordance.extensions.people.pushes import Person
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.objects.tool import Tool
from affordance.settings import Settings


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
