"""Outcomes of identification when a user makes a mistake in a good pair of runs.

An answer is right if, within errors, its mass is the true one and its centre of mass is that of the good pair. If the
load was weighed, gains are compared instead of the mass, unless the mistake concerns the sensors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from affordance.exceptions import AffordanceError
from affordance.identification.evidence.gains import Gains
from affordance.identification.identify import Runs, identify
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings
from affordance.plant.serial_chain import SerialChain

# Limits beyond which an answer counts as different from that of the good pair: relative error, number of SDs, [m].
_RELATIVE, _SDS, _PLACE = 0.1, 3.0, 0.02
_VERDICTS = ("refused", "not_trusted", "right", "wrong_silent")


@dataclass(frozen=True)
class Case:
    """Input of an identification."""

    robot: SerialChain  # model of the arm
    empty: Run  # run with an empty hand
    loaded: Run  # run of the same motion with the load
    mass: float  # true mass of the load, [kg]
    gains: Gains | None = None  # gains from an earlier run; None if the load was weighed, or if signals are torques
    reference_mass: float | None = None  # mass of the load measured with a scale, [kg]; None if it was not weighed

    def identify(self, settings: IdentificationSettings) -> PayloadBelief:
        """Identifies the payload."""
        return identify(
            self.robot,
            Runs(self.loaded, (self.empty,)),
            gains=self.gains,
            reference_mass=self.reference_mass,
            settings=settings,
        )


class Mistake(NamedTuple):
    """Mistake that a user can make."""

    name: str  # description of the mistake
    make: Callable[[Case], Case]  # function that makes the mistake in a good case
    can_be_seen: bool = True  # false if nothing in the data can show it
    # True if the mistake concerns the sensors and is the same in both runs, so that gains from a weighed load include
    # it.
    of_sensors: bool = False


class Outcome(NamedTuple):
    """Outcome of an identification with a mistake."""

    name: str  # description of the mistake
    verdict: str  # one of _VERDICTS
    reason: str  # first reason given; empty if none was given


def try_mistakes(case: Case, mistakes: Sequence[Mistake], settings: IdentificationSettings) -> list[Outcome]:
    """Makes each mistake in a good case, and compares the answer with that of the good case."""
    good = case.identify(settings)
    return [_try(case, mistake, good, settings) for mistake in mistakes]


def count_outcomes(outcomes: Sequence[Outcome]) -> dict[str, int]:
    """Counts the verdicts; the keys are as in metrics.json."""
    verdicts = [outcome.verdict for outcome in outcomes]
    return {"tried": len(outcomes)} | {name: verdicts.count(name) for name in _VERDICTS}


def _try(case: Case, mistake: Mistake, good: PayloadBelief, settings: IdentificationSettings) -> Outcome:
    try:
        belief = mistake.make(case).identify(settings)
    except AffordanceError as error:
        return Outcome(mistake.name, "refused", str(error))
    if belief.doubts:
        return Outcome(mistake.name, "not_trusted", belief.doubts[0])
    is_right = _finds_centre(belief, good) and _finds_mass(belief, good, case.mass, mistake.of_sensors)
    return Outcome(mistake.name, "right" if is_right else "wrong_silent", "")


def _finds_mass(belief: PayloadBelief, good: PayloadBelief, mass: float, of_sensors: bool) -> bool:
    """Returns True if the mass, or for a weighed load the gains, agrees with the good case."""
    if belief.calibration is None or good.calibration is None:
        error = abs(belief.mass - mass)
        return bool(error <= _RELATIVE * mass or error <= _SDS * belief.mass_sd)
    if of_sensors:
        return True
    found, true = belief.calibration, good.calibration
    sd = np.sqrt(found.covariance[:, 0, 0] + true.covariance[:, 0, 0])
    apart = np.abs(found.mean[:, 0] - true.mean[:, 0])
    return bool(((apart <= _RELATIVE * np.abs(true.mean[:, 0])) | (apart <= _SDS * sd)).all())


def _finds_centre(belief: PayloadBelief, good: PayloadBelief) -> bool:
    sd = np.hypot(belief.marginals.sd[1:4], good.marginals.sd[1:4])
    apart = np.abs(belief.centre_of_mass - good.centre_of_mass)
    return bool(((apart <= _PLACE) | (apart <= _SDS * sd)).all())
