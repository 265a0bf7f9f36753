"""Check with a single weighed load: gains from one half of a run, the mass from the other."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.identification.evidence.evidence import Evidence
from affordance.identification.posterior.calibration import calibrate_gains
from affordance.identification.posterior.inference import infer
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.settings import IdentificationSettings


class HalfCheck(NamedTuple):
    """Masses of both halves, each with gains of the other half, shape (2,) each, the first half first.

    Attributes:
        mass: Means of the mass, [kg].
        sd: Standard deviations of the mass, [kg].
        error: Relative errors of the mass.
        inside: 1 where the 90 % interval contains the reference mass, else 0.
        centre_of_mass: Means of the centre of mass, shape (2, 3), [m].
    """

    mass: Array
    sd: Array
    error: Array
    inside: Array
    centre_of_mass: Array


def check_calibration(belief: PayloadBelief, settings: IdentificationSettings) -> HalfCheck | None:
    """Checks the gains that were found along with a belief; None if they were not found with a weighed load."""
    if belief.calibration is None or belief.reference_mass is None:
        return None
    return check_halves(belief.fit.evidence, belief.reference_mass, settings)


def check_halves(evidence: Evidence, reference_mass: float, settings: IdentificationSettings) -> HalfCheck:
    """Identifies the mass of each half of a run with gains found in the other.

    Args:
        evidence: Evidence of a run with a weighed load.
        reference_mass: Mass of the load, [kg].
        settings: Identification settings.
    """
    middle = len(evidence.times) // 2
    halves = evidence.select(slice(0, middle)), evidence.select(slice(middle, len(evidence.times)))
    beliefs = []
    for half, other in (halves, halves[::-1]):
        gains = calibrate_gains(other, reference_mass, settings).with_drift(settings)
        beliefs.append(infer(half, gains, settings=settings))
    mass = np.array([belief.mass for belief in beliefs])
    intervals = [belief.mass_interval90 for belief in beliefs]
    return HalfCheck(
        mass,
        np.array([belief.mass_sd for belief in beliefs]),
        mass / reference_mass - 1.0,
        np.array([float(low <= reference_mass <= high) for low, high in intervals]),
        np.array([belief.centre_of_mass for belief in beliefs]),
    )
