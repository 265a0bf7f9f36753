"""Identifies a UR10e's weighed load from motor currents with unknown gains."""

from typing import Any

from affordance.extensions.payload.evidence.paired_runs import pair_runs
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.posterior.calibration import calibrate_gains, check_halves
from affordance.extensions.payload.settings import IdentificationSettings
from studies.payload.clones import UR10E_LOAD, Ur10eData

# Joints whose load friction is reported, numbered from 1.
_LOADED_JOINTS = (2, 3)


def study_ur10e(data: Ur10eData, settings: IdentificationSettings) -> dict[str, Any]:
    """Identifies the load in three ways, with decreasing prior knowledge.

    Returns:
        ``half_mass_kg``, ``half_sd_kg``, ``half_error`` (relative) and ``half_inside`` (1 if the 90 % interval
            contains the weighed mass): for each half of the run, with gains from the other half.
        ``unpaired_mass_kg``, ``unpaired_mass_sd_kg``: with an arm fitted to the empty run, and gains from the pair.
        ``by_arm_weight_mass_kg``, ``by_arm_weight_mass_sd_kg``, ``by_arm_weight_interval90_kg``: with gains from the
            arm's weight according to its file.
        ``load_friction``: fraction of the load lost to friction at joints 2 and 3.
    """
    evidence = pair_runs(data.robot, data.empty, data.loaded, settings)
    gains = calibrate_gains(evidence, UR10E_LOAD, settings)
    halves = check_halves(evidence, UR10E_LOAD, settings)
    runs = Runs(data.loaded, (data.empty,))
    unpaired = identify(data.robot, runs, paired=False, gains=gains, settings=settings)
    by_weight = identify(data.robot, runs, settings=settings)
    return {
        "half_mass_kg": halves.mass,
        "half_sd_kg": halves.sd,
        "half_error": halves.error,
        "half_inside": halves.inside,
        "unpaired_mass_kg": unpaired.mass,
        "unpaired_mass_sd_kg": unpaired.mass_sd,
        "by_arm_weight_mass_kg": by_weight.mass,
        "by_arm_weight_mass_sd_kg": by_weight.mass_sd,
        "by_arm_weight_interval90_kg": by_weight.mass_interval90,
        "load_friction": [gains.load_friction[joint - 1] for joint in _LOADED_JOINTS],
    }
