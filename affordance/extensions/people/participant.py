"""Participants: their pushes before release, their differences, and lift settings.

A simulated arm pushes with exactly the believed weight. A person's push also has a random error, a gain and lapses,
none of which affects learning. By default no parameter has an effect.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.learner import Draws, Learner
from affordance.exceptions import BadArgumentError
from affordance.files.constraints import Checked, CheckedFields, Setting, Within, run_check
from affordance.settings import Settings

_AFTER = "proposed after groups that are now held out had been seen"


def _of_each(bound: Within) -> Checked:
    """Builds a check for a number, or for a number per observer. A sequence of numbers becomes a tuple."""

    def check(name: str, value: Any) -> Any:
        if isinstance(value, np.ndarray | list | tuple):
            return tuple(float(run_check(name, bound.check, each)) for each in value)
        return run_check(name, bound.check, value)

    return Checked(check)


@dataclass(frozen=True)
class Participant(CheckedFields):
    """Parameters of a participant's pushes, heaviness judgements and differences.

    Push error, gain and lapse are numbers, or sequences with one number per observer. Zero errors, lapses and spreads
    and a gain of 1 have no effect.

    Attributes:
        push_error: Standard deviation of a push divided by its mean; it affects only the push, not learning.
        gain: Push divided by the believed weight.
        gain_spread: Standard deviation of the logarithm of the gain between participants.
        lapse: Probability that a push is meant for the weight of the previous lift; zero in the first lift.
        kappa_spread: Standard deviation of the logarithm of kappa between participants, for learners that have it.
        heaviness_exponent: Exponent e of judged heaviness, felt (felt / predicted)^e, where felt is the felt weight
            and predicted the weight expected from the appearance.
    """

    push_error: Annotated[
        float,
        _of_each(Within(0.0, 1.0)),
        Setting(
            "1",
            "none by default. Proportionality to force: studies of isometric force (Schmidt and others 1979; Jones, "
            "Hamilton and Wolpert 2002). No source found for its size between pushes: .04 (Baweja and others 2009) "
            "is the variation within a push; .2 follows from people's training correlation in Linear+ and Linear++",
        ),
    ] = 0.0
    gain: Annotated[float, _of_each(Within(0.1, 10.0)), Setting("1", "1: the push equals the believed weight")] = 1.0
    gain_spread: Annotated[float, Within(0.0, 2.0), Setting("1", "none by default; no source for another value")] = (
        0.0
    )
    lapse: Annotated[
        float, _of_each(Within(0.0, 1.0)), Setting("1", "none by default; no source for another value")
    ] = 0.0
    kappa_spread: Annotated[
        float, Within(0.0, 2.0), Setting("1", f"none by default; .3 is a guess, {_AFTER}, to be fitted to persons")
    ] = 0.0
    heaviness_exponent: Annotated[
        float, Within(0.0, 1.0), Setting("1", "fitted to nothing here (docs/heaviness.md)")
    ] = 0.1


@dataclass(frozen=True)
class LiftSettings(Settings):
    """Settings of lifts in closed form.

    Attributes:
        participant: How simulated people push, and how they differ, in lifts that are computed in closed form.
    """

    participant: Participant = Participant()


def with_participant(settings: Settings) -> LiftSettings:
    """Returns the settings with a participant, by default without errors."""
    if isinstance(settings, LiftSettings):
        return settings
    return LiftSettings(**{each.name: getattr(settings, each.name) for each in fields(settings)})


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

    def compute_mean(self, believed: Array, before: Array) -> Array:
        """Computes the mean push, [N], from believed weights now and before, (B,)."""
        meant: Array = np.where(np.isfinite(before), (1.0 - self.lapse) * believed + self.lapse * before, believed)
        return self.gain * meant

    def compute_log_density(self, push: float, believed: Array, before: Array) -> Array:
        """Computes the log density of a push, [N].

        The density depends on the believed weights now and before, (B,).
        """
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
    """Draws push parameters of B observers, and their learner's parameters.

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
    """Lists the parameters of participants and learner by setting, (B,) each."""
    size = len(pushes.gain)
    of_learner = {each.name: getattr(learner.parameters, each.name) for each in fields(learner.parameters)}
    own = {
        f"learner.{name}": np.broadcast_to(np.asarray(value, dtype=float), size) for name, value in of_learner.items()
    }
    pushed = {"push_error": pushes.error, "gain": pushes.gain, "lapse": pushes.lapse}
    return {**{f"participant.{name}": value for name, value in pushed.items()}, **own}


def compute_heaviness(felt: Array, expected: Array, exponent: float) -> Array:
    """Computes judged heaviness from felt and expected weights, [N] (docs/heaviness.md)."""
    heaviness: Array = felt * (felt / expected) ** exponent
    return heaviness


def _log_normal(push: float, mean: Array, share: Array) -> Array:
    sd = share * mean
    log_density: Array = -0.5 * ((push - mean) / sd) ** 2 - np.log(sd) - 0.5 * np.log(2.0 * np.pi)
    return log_density
