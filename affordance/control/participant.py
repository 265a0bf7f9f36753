"""How a participant pushes before release, and how participants differ.

An arm pushes with the weight that it believes in. People's pushes have an error of their own, a gain, and lapses;
none of them enters what is learned. Every number is without effect by default.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from affordance.files.constraints import Checked, CheckedFields, Setting, Within, run_check

_AFTER = "proposed after groups that are now held out had been seen"


def _of_each(bound: Within) -> Checked:
    """Checks a number, or a sequence with one for each observer, which becomes a tuple."""

    def check(name: str, value: Any) -> Any:
        if isinstance(value, np.ndarray | list | tuple):
            return tuple(float(run_check(name, bound.check, each)) for each in value)
        return run_check(name, bound.check, value)

    return Checked(check)


@dataclass(frozen=True)
class Participant(CheckedFields):
    """How a participant pushes, and how participants differ; 0, and a gain of 1, for none of it.

    A value is a number, or a sequence with one for each observer.

    Attributes:
        push_error: Standard deviation of a push over its mean (push error); output only, nothing is learned from it.
        gain: Push over the weight that is believed in.
        gain_spread: Standard deviation of the logarithm of the gain between participants.
        lapse: Probability that a push repeats that of the lift before, whatever is seen; not at the first lift.
        kappa_spread: Standard deviation of the logarithm of kappa between participants, for learners that have it.
        heaviness_exponent: Power of the felt weight over what the look predicts by which judged heaviness exceeds the
            felt weight.
    """

    push_error: Annotated[
        float,
        _of_each(Within(0.0, 1.0)),
        Setting(
            "1",
            "none by default. That it is in proportion to the force: studies of isometric force (Schmidt and others "
            "1979; Jones, Hamilton and Wolpert 2002). Its size from push to push: no source found among them, as .04 "
            "(Baweja and others 2009) is within one push; .2 follows from people's training correlation in Linear+ "
            "and Linear++",
        ),
    ] = 0.0
    gain: Annotated[
        float, _of_each(Within(0.1, 10.0)), Setting("1", "1: the push is the weight that is believed in")
    ] = 1.0
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
