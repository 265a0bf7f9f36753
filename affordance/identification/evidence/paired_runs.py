"""Evidence by repetition: the same motion without and with the load, one run subtracted from the other.

All that both runs share cancels, friction included; no model of the arm is needed.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from affordance.exceptions import BadValueError
from affordance.identification.evidence.evidence import Evidence, build_joint_evidence, restore_compensated
from affordance.identification.evidence.gains import Gains
from affordance.identification.recording.alignment import align
from affordance.identification.recording.preparation import find_cutoff, prepare
from affordance.identification.recording.robot_chain import RobotChain
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings


def build_paired_evidence(
    robot: RobotChain, loaded: Run, empty: Sequence[Run], gains: Gains, settings: IdentificationSettings
) -> Evidence:
    """Builds the evidence of a loaded run that repeats the only empty one; gains apply to it later.

    Raises:
        BadValueError: There are several empty runs, or the loaded run does not repeat the empty one.
    """
    return pair_runs(robot, take_only(empty, "a paired analysis"), loaded, settings)


def take_only(empty: Sequence[Run], analysis: str) -> Run:
    """Returns the only empty run.

    Raises:
        BadValueError: There are several.
    """
    if len(empty) > 1:
        raise BadValueError("--empty", "", f"names {len(empty)} runs, must name one for {analysis}")
    return empty[0]


def pair_runs(robot: RobotChain, empty: Run, loaded: Run, settings: IdentificationSettings) -> Evidence:
    """Subtracts an empty run from a loaded one of the same motion, by an arm with gravity as in the runs.

    Raises:
        BadValueError: The loaded run does not repeat the empty one.
    """
    alignment = align(empty, loaded, settings.repeat_tolerance)
    step = max(1.0 / empty.rate, 1.0 / loaded.rate)
    times = np.arange(alignment.start, alignment.end, step)
    cutoff = max(find_cutoff(empty, settings), find_cutoff(loaded, settings))
    before = prepare(empty, settings, cutoff=cutoff, times=times)
    after = prepare(loaded, settings, cutoff=cutoff, times=times + alignment.lag)
    nominal = np.ones(robot.num_joints)
    # The mean of both motions: they differ by a ten-thousandth of a radian.
    both = before._replace(
        q=0.5 * (before.q + after.q),
        v=0.5 * (before.v + after.v),
        vdot=0.5 * (before.vdot + after.vdot),
        signal=restore_compensated(robot, loaded, after, nominal)
        - restore_compensated(robot, empty, before, nominal),
    )
    analysis = f"paired with {empty.source}, {alignment.lag:.3f} s earlier by its clock"
    evidence = build_joint_evidence(robot, loaded, both, settings, analysis=analysis, is_difference=True)
    return replace(
        evidence,
        prepared=both._replace(times=both.times + alignment.lag),
        notes=(f"joint angles of both runs agree to {1e3 * alignment.difference:.2g} mrad",),
    )
