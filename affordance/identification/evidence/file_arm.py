"""Evidence by the arm's file, for lack of a run with an empty hand.

Inertias in files are wrong by some ten per cent, and a wrist a hundred grams heavier than in its file looks like a
load of a hundred grams. This error is carried over: the uncertainty of the links is projected onto the payload.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.fitted_arm import build_link_scale
from affordance.identification.evidence.gains import Gains
from affordance.identification.evidence.joint_evidence import build_joint_evidence, restore_compensated
from affordance.identification.evidence.model_error import project_link_errors
from affordance.identification.recording.preparation import prepare
from affordance.identification.recording.robot_chain import RobotChain
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings

# Friction scale: the signal contains all of the friction, not only its change between two runs.
WHOLE_FRICTION = 10.0


def build_file_evidence(
    robot: RobotChain, loaded: Run, empty: Sequence[Run], gains: Gains, settings: IdentificationSettings
) -> Evidence:
    """Builds the evidence of a loaded run from the arm's file; empty runs are not used."""
    prepared = prepare(loaded, settings)
    evidence = build_joint_evidence(
        robot,
        loaded,
        prepared,
        restore_compensated(robot, loaded, prepared, gains.mean[:, 0]),
        settings,
        analysis=f"unpaired: the arm as {robot.source} has it",
        is_difference=False,
    )
    covariance = evidence.phantom_covariance
    if settings.floor:
        covariance = project_link_errors(robot, prepared, evidence.samples, np.diag(build_link_scale(robot)))
    return replace(
        evidence,
        phantom_covariance=covariance,
        friction_scale=WHOLE_FRICTION,
        notes=(f"the arm's file may err by {1e3 * np.sqrt(covariance[0, 0]):.0f} g at the tip",),
    )
