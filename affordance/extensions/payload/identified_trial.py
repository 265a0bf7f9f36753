"""Converts the identified payload of a seen object into evidence for a material memory."""

from pathlib import Path

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import BadArgumentError, show_text
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.memory.trial_evidence import PayloadQuadratic, TrialEvidence, pack
from affordance.extensions.payload.posterior.part_posterior import SeenObject, add_unseen
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief
from affordance.extensions.payload.recording.run import Run
from affordance.objects.inertia import build_transform_map
from affordance.plant.arm import name_robot
from affordance.plant.serial_chain import SerialChain
from affordance.vision.prediction import measure_geometry


def build_identified_trial(
    belief: PayloadBelief, seen: SeenObject, robot: SerialChain, run: Run, object_name: str, unseen_share: float
) -> TrialEvidence:
    """Builds the evidence that a run gives about a seen object, in the object's frame.

    ``unseen_share`` is the standard deviation of the unseen mass as a fraction of the total mass.

    Raises:
        BadArgumentError: The payload was identified without a seen object.
    """
    if belief.felt is None:
        raise BadArgumentError("belief", "", "was identified without a seen object, must be identified with one")
    geometry = measure_geometry(seen.parts, range(len(seen.parts)), len(seen.parts))
    felt = belief.felt.change_frame(build_transform_map(run.description.object_pose))
    return TrialEvidence(
        object_name=object_name,
        parts=tuple(part.appearance for part in seen.parts),
        geometry=add_unseen(geometry, seen.unseen, unseen_share),
        model=PayloadQuadratic(),
        features=pack(felt),
        num_samples=len(run.q),
        num_joints=len(robot.joint_names),
        robot=name_robot(Path(robot.source), robot.tip),
        fingerprint=robot.fingerprint,
        p_value=1.0 if belief.p_value is None else belief.p_value,
        source=show_text(Path(run.source).name),
        source_hash=run.fingerprint,
    )


def teach(place: str, trial: TrialEvidence, prior: Prior) -> tuple[MaterialMemory, bool]:
    """Adds a trial to a lasting memory.

    Args:
        place: Path of the memory.
        trial: Evidence of the run.
        prior: Prior for materials that were never felt.

    Returns: The updated memory, and True if the trial was new.
    """
    with open_memory(place) as ledger:
        is_new = ledger.append([trial]) > 0
        return ledger.recall(prior=prior), is_new
