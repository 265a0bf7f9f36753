"""Evidence of an identified payload, from a run of a real robot with an object that a camera saw."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import BadArgumentError, show_text
from affordance.identification.posterior.part_posterior import SeenObject
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.recording.run import Run
from affordance.memory.felt_models import PayloadQuadratic, pack
from affordance.memory.ledger import has_memory, open_memory
from affordance.memory.same_colours import SameColours
from affordance.memory.trial_evidence import TrialEvidence
from affordance.objects.inertia import Geometry, build_transform_map
from affordance.plant.arm import name_robot
from affordance.plant.serial_chain import SerialChain
from affordance.vision.systems import measure_geometry


def build_identified_trial(
    belief: PayloadBelief, seen: SeenObject, robot: SerialChain, run: Run, object_name: str, unseen_share: float
) -> TrialEvidence:
    """Builds the evidence of a run with an object that a camera saw, in the object's frame.

    The share is the standard deviation of the unseen mass divided by the total mass. A payload that was identified
    without the object raises a BadArgumentError.
    """
    if belief.felt is None:
        raise BadArgumentError("belief", "", "is of a payload that no camera saw, must be of the seen object")
    geometry = measure_geometry(seen.parts, range(len(seen.parts)), len(seen.parts))
    values, vectors = np.linalg.eigh(unseen_share**2 * seen.unseen)
    roots = vectors * np.sqrt(np.maximum(values, 0.0))  # of 1 kg; each column is an error of its own
    unseen = roots.T[:, :, None] * geometry.Phi[0]
    felt = belief.felt.change_frame(build_transform_map(run.description.object_pose))
    return TrialEvidence(
        object_name=object_name,
        parts=tuple(part.appearance for part in seen.parts),
        geometry=Geometry(geometry.Phi, np.concatenate([geometry.Phi_errors, unseen])),
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


def teach(
    place: str,
    trial: TrialEvidence,
    prior: Prior,
    *,
    former_hash: str,
    known: str = "",
    same_colours: SameColours = (),
) -> tuple[MaterialMemory, bool]:
    """Appends a trial to the lasting memory of a place; returns it as recalled, and True if the trial was new to it.

    Another, known memory is merged into it first, if it exists. A memory that was written by an earlier version knows
    a run by its former hash. Of the pairs of colours that count as one, the memory's second is read as the first.
    """
    with open_memory(place) as ledger:
        if known and has_memory(known):
            with open_memory(known) as before:
                ledger.merge(before)
        is_known = replace(trial, source_hash=former_hash).id in ledger
        is_new = not is_known and ledger.append([trial]) > 0
        return ledger.recall(prior=prior, same_colours=same_colours), is_new
