"""Participant parameters: random errors, gain and lapses of pushes, and differences between participants.

A simulated arm pushes with exactly the believed weight before the object is released. The push of a human participant
also has a random error, a gain and lapses, which do not affect learning. All effects are disabled by default.
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
    """Builds a check for a number, or for a sequence with one number per observer, which becomes a tuple."""

    def check(name: str, value: Any) -> Any:
        if isinstance(value, np.ndarray | list | tuple):
            return tuple(float(run_check(name, bound.check, each)) for each in value)
        return run_check(name, bound.check, value)

    return Checked(check)


@dataclass(frozen=True)
class Participant(CheckedFields):
    """Parameters of pushes and heaviness judgements, and their variability between participants.

    Push error, gain and lapse can be sequences with one number per observer.

    Attributes:
        push_error: Coefficient of variation of pushes; it does not affect learning.
        gain: Mean push divided by the believed weight.
        gain_spread: Standard deviation of the logarithm of the gain between participants.
        lapse: Probability that a push matches the believed weight of the previous lift; zero in the first lift.
        kappa_spread: Standard deviation of the logarithm of kappa between participants, for learners with kappa.
        heaviness_exponent: Exponent e of judged heaviness, felt (felt / predicted)^e, where felt is the felt weight
            and predicted is the weight expected from the appearance.
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
    """Settings for closed-form lifts.

    Attributes:
        participant: Push parameters of simulated participants, and their variability.
    """

    participant: Participant = Participant()


def with_participant(settings: Settings) -> LiftSettings:
    """Returns lift settings, with an error-free participant if there is none."""
    if isinstance(settings, LiftSettings):
        return settings
    return LiftSettings(**{each.name: getattr(settings, each.name) for each in fields(settings)})


class Pushes(NamedTuple):
    """Push parameters of B observers, (B,) each."""

    error: Array  # coefficient of variation
    gain: Array
    lapse: Array

    def take(self, rows: NDArray[np.intp]) -> "Pushes":
        """Selects the parameters of some observers."""
        return Pushes(self.error[rows], self.gain[rows], self.lapse[rows])

    def draw(self, believed: Array, before: Array, rng: Draws) -> Array:
        """Draws a push of each observer, (B,), [N].

        Without errors and lapses, no random numbers are drawn.

        Args:
            believed: Believed weight of each observer, (B,), [N].
            before: Believed weight in the previous lift, (B,), [N]; NaN in the first lift.
            rng: Random generator.
        """
        if not (self.error.any() or self.lapse.any()):
            return self.gain * believed
        uniform, normal = rng.random((len(believed),)), rng.standard_normal((len(believed),))
        lapses = (uniform < self.lapse) & np.isfinite(before)
        mean = self.gain * np.where(lapses, before, believed)
        return mean * (1.0 + self.error * normal)

    def compute_mean(self, believed: Array, before: Array) -> Array:
        """Computes mean pushes, [N], from the believed weights in this and the previous lift, (B,), [N]."""
        meant: Array = np.where(np.isfinite(before), (1.0 - self.lapse) * believed + self.lapse * before, believed)
        return self.gain * meant

    def compute_log_density(self, push: float, believed: Array, before: Array) -> Array:
        """Computes the log density of a push, [N], given the believed weights in this and the previous lift, (B,)."""
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
    """Draws push parameters and learner parameters of B observers.

    Without variability between participants, no random numbers are drawn.
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
    """Returns the value of a participant's field for each observer, (B,).

    Raises:
        BadArgumentError: The field is a sequence with too few values.
    """
    value = getattr(participant, name)
    if not isinstance(value, tuple):
        return np.full(len(observers), float(value))
    if max(observers) >= len(value):
        problem = f"has {len(value)} values, must have at least {max(observers) + 1}, one for each observer"
        raise BadArgumentError("participant", name, problem)
    return np.array([value[each] for each in observers])


def list_own_values(pushes: Pushes, learner: Learner) -> dict[str, Array]:
    """Lists the parameters of pushes and learner by name of the setting, (B,) each."""
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
