"""Free parameters of a fit: their choice, their priors, and their values from standard normal numbers."""

import math
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import expit, logit

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.people.participant import Participant
from affordance.files.constraints import Within, list_field_types

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
