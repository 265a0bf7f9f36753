"""Study of a UR10e with a weighed load, identified from motor currents with unknown gains."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.gains import Gains
from affordance.identification.evidence.paired_runs import pair_runs
from affordance.identification.identify import Runs, identify
from affordance.identification.posterior.calibration import calibrate_gains, check_halves
from affordance.identification.posterior.payload_belief import HalfCheck, PayloadBelief
from affordance.identification.settings import IdentificationSettings
from studies.recorded.clones import UR10E_LOAD, Ur10eData
from studies.recorded.empty_hand import weigh_empty_hand

# Joints whose load friction is reported, numbered from 1.
_LOADED_JOINTS = (2, 3)
_WINDOW = 6.0  # duration of the windows in which gains are estimated again to measure their drift, [s]


class Ur10eResult(NamedTuple):
    """Results of the study on the UR10e."""

    numbers: dict[str, Any]  # numbers for metrics.json
    details: dict[str, Any]  # further numbers, for details.json
    evidence: Evidence  # evidence from the pair of runs
    gains: Gains  # gains from the whole run
    halves: HalfCheck  # check in which one half gives the gains and the other half the mass
    belief: PayloadBelief  # posterior of the load given the pair and these gains, for figures


def study_ur10e(data: Ur10eData, settings: IdentificationSettings) -> Ur10eResult:
    """Identifies the load of the UR10e, and checks gains, drift and the empty hand."""
    robot = data.robot
    evidence = pair_runs(robot, data.empty, data.loaded, settings)
    gains = calibrate_gains(evidence, UR10E_LOAD, settings)
    halves = check_halves(evidence, UR10E_LOAD, settings)
    empty = weigh_empty_hand(robot, data.empty, gains.with_drift(settings), settings)
    runs = Runs(data.loaded, (data.empty,))
    fitted = identify(robot, runs, paired=False, gains=gains, settings=settings)
    by_file = identify(robot, runs, settings=settings)
    weighed = identify(robot, runs, reference_mass=UR10E_LOAD, settings=settings)
    numbers = {
        "half_error": halves.error,
        "half_inside": halves.inside,
        "half_sd_kg": halves.sd,
        "load_friction": [gains.load_friction[joint - 1] for joint in _LOADED_JOINTS],
        "empty_as_load_kg": empty.parameters[0],
        "empty_as_load_sd_kg": empty.mass_sd,
    }
    details = {
        "half_mass_kg": halves.mass,
        "half_com_m": halves.centre_of_mass,
        "newton_metres_per_ampere": 1.0 / gains.mean[:, 0],
        "gain_sd_relative": np.sqrt(gains.covariance[:, 0, 0]) / gains.mean[:, 0],
        "load_friction_all": gains.load_friction,
        "gain_scatter_in_windows": _measure_drift(evidence, weighed.parameters, settings),
        "unpaired_mass_kg": fitted.mass,
        "unpaired_mass_sd_kg": fitted.mass_sd,
        "gains_by_arm_weight_mass_kg": by_file.mass,
        "gains_by_arm_weight_mass_sd_kg": by_file.mass_sd,
        "gains_by_arm_weight_interval90": by_file.mass_interval90,
    }
    belief = identify(robot, runs, gains=gains, settings=settings)
    return Ur10eResult(numbers, details, evidence, gains, halves, belief)


def _measure_drift(evidence: Evidence, pi: Array, settings: IdentificationSettings) -> Array:
    """Measures the relative scatter of each joint's gain between windows, including estimation error."""
    samples = evidence.samples
    known = replace(
        evidence,
        samples=samples._replace(Y=np.zeros_like(samples.Y), tau_arm=samples.Y @ pi),
        is_difference=False,
    )
    gains = [calibrate_gains(window, None, settings).mean[:, 0] for window in known.split(_WINDOW)]
    scatter: Array = np.std(gains, axis=0, ddof=1) / np.mean(gains, axis=0)
    return scatter
