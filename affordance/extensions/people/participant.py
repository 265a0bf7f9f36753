"""Parameters of a participant's pushes before release, and of differences between participants.

A simulated arm pushes with exactly the believed weight. A person's push also has a random error, a gain and lapses,
none of which affects learning. By default no parameter has an effect.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from affordance.files.constraints import Checked, CheckedFields, Setting, Within, run_check

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
    """Parameters of a participant's pushes and heaviness judgements, and of differences between participants.

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
