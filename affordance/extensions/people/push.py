"""Pushes before release, with differences between participants (``participant``)."""

from collections.abc import Sequence
from dataclasses import fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.learner import Draws, Learner
from affordance.exceptions import BadArgumentError
from affordance.extensions.people.participant import Participant


class Pushes(NamedTuple):
    """Push parameters of B observers, (B,) each."""

    error: Array  # SD of a push divided by its mean
    gain: Array
    lapse: Array

    def take(self, rows: NDArray[np.intp]) -> "Pushes":
        """Returns the parameters of some observers."""
        return Pushes(self.error[rows], self.gain[rows], self.lapse[rows])

    def draw(self, believed: Array, before: Array, rng: Draws) -> Array:
        """Draws the pushes of observers, (B,), [N].

        No random numbers are drawn if there are neither errors nor lapses.

        Args:
            believed: Weight that each observer believes in now, (B,), [N].
            before: Weight that each observer believed in at the previous lift, (B,), [N]; NaN in a first lift.
            rng: Random generator.
        """
        if not (self.error.any() or self.lapse.any()):
            return self.gain * believed
        uniform, normal = rng.random((len(believed),)), rng.standard_normal((len(believed),))
        lapses = (uniform < self.lapse) & np.isfinite(before)
        mean = self.gain * np.where(lapses, before, believed)
        return mean * (1.0 + self.error * normal)

    def compute_log_density(self, push: float, believed: Array, before: Array) -> Array:
        """Computes the log probability density of a push, [N], given the weights believed now and before, (B,)."""
        now = _log_normal(push, self.gain * believed, self.error)
        if not self.lapse.any() or not np.isfinite(before).all():
            return now
        then = _log_normal(push, self.gain * before, self.error)
        with np.errstate(divide="ignore"):
            both: Array = np.logaddexp(np.log1p(-self.lapse) + now, np.log(self.lapse) + then)
        return both


def draw_participants(
    participant: Participant, learner: Learner, observers: Sequence[int], rng: Draws
) -> tuple[Pushes, Learner]:
    """Draws the push parameters of B observers, and the parameters of their learner.

    No random numbers are drawn if there is no spread.
    """
    learner, size = learner.of_observers(observers), len(observers)
    values = {name: take(participant, name, observers) for name in ("push_error", "gain", "lapse")}
    normal = np.zeros((size, 2))
    if participant.gain_spread or participant.kappa_spread:
        normal = rng.standard_normal((size, 2))
    gain = values["gain"] * np.exp(participant.gain_spread * normal[:, 0])
    if participant.kappa_spread and hasattr(learner.parameters, "kappa"):
        kappa = np.broadcast_to(learner.parameters.kappa, size) * np.exp(participant.kappa_spread * normal[:, 1])
        learner = learner.change(kappa=kappa.tolist())
    return Pushes(values["push_error"], gain, values["lapse"]), learner


def take(participant: Participant, name: str, observers: Sequence[int]) -> Array:
    """Returns the values of a participant's field for some observers, (B,).

    Raises:
        BadArgumentError: If the field is a sequence with too few values.
    """
    value = getattr(participant, name)
    if not isinstance(value, tuple):
        return np.full(len(observers), float(value))
    if max(observers) >= len(value):
        problem = f"has {len(value)} values, must have at least {max(observers) + 1}, one for each observer"
        raise BadArgumentError("participant", name, problem)
    return np.array([value[each] for each in observers])


def list_own_values(pushes: Pushes, learner: Learner) -> dict[str, Array]:
    """Lists the parameters of participants and of their learner by the name of the setting, (B,) each."""
    size = len(pushes.gain)
    of_learner = {each.name: getattr(learner.parameters, each.name) for each in fields(learner.parameters)}
    own = {
        f"learner.{name}": np.broadcast_to(np.asarray(value, dtype=float), size) for name, value in of_learner.items()
    }
    pushed = {"push_error": pushes.error, "gain": pushes.gain, "lapse": pushes.lapse}
    return {**{f"participant.{name}": value for name, value in pushed.items()}, **own}


def compute_heaviness(felt: Array, expected: Array, exponent: float) -> Array:
    """Computes judged heaviness, [N], from felt and expected weights, [N] (docs/heaviness.md)."""
    heaviness: Array = felt * (felt / expected) ** exponent
    return heaviness


def _log_normal(push: float, mean: Array, share: Array) -> Array:
    sd = share * mean
    log_density: Array = -0.5 * ((push - mean) / sd) ** 2 - np.log(sd) - 0.5 * np.log(2.0 * np.pi)
    return log_density
