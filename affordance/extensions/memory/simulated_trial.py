"""Builds evidence from simulated trials."""

from affordance.extensions.memory.trial_evidence import FELT_MODELS, TrialEvidence
from affordance.plant.arm import name_robot
from affordance.plant.chain_plant import recognise_arm
from affordance.plant.load import load_arm
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.prediction import measure_geometry


def describe_trial(record: TrialRecord) -> TrialEvidence | None:
    """Builds the evidence of a trial for a lasting memory.

    It is None if nothing was felt, or if the noise model is the user's own.
    """
    percept = record.percept
    if percept is None or type(percept.noise) not in FELT_MODELS.values():
        return None
    num_parts = len(percept.features)
    return TrialEvidence(
        object_name=percept.object_name,
        parts=tuple(part.appearance for part in percept.features),
        geometry=measure_geometry(percept.features, range(num_parts), num_parts),
        model=percept.noise,
        features=percept.statistics.features,
        num_samples=percept.statistics.num_samples,
        num_joints=percept.num_joints,
        robot=name_robot(percept.arm),
        fingerprint=recognise_arm(load_arm(percept.arm)),
        log_evidence=record.log_evidence,
        p_value=record.p_value,
        source="simulated",
    )
