"""Builds evidence from a repeated motion: subtracts the empty run from the loaded run.

Everything that both runs share cancels, including friction, and no model of the arm is needed. The delay between the
runs is estimated to a fraction of a sample by matching joint angles.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.evidence.evidence import Evidence, build_evidence, restore_compensated
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.model_error import project_pulls
from affordance.extensions.payload.recording.preparation import compute_cutoff, prepare
from affordance.extensions.payload.recording.run import FEWEST_POSTURES, POSTURE_STEP, Run, resample
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.plant.serial_chain import SerialChain

# Share of the loaded run's motion that the common part must include.
_SHARE = 0.5
_NUM_STEPS = 5  # number of least-squares steps for the lag, each of which divides the error by a hundred
_MOVING = 0.01  # joint speed below which the arm is at rest, [rad/s]


def build_paired_evidence(
    robot: SerialChain, loaded: Run, empty: Sequence[Run], gains: Gains, settings: IdentificationSettings
) -> Evidence:
    """Builds the evidence of a loaded run that repeats the only empty run.

    Raises:
        BadValueError: There are several empty runs, or the loaded run does not repeat the empty run.
    """
    of_empty = get_only(empty, "a paired analysis")
    if loaded.description.postures:
        return pair_postures(robot, of_empty, loaded, settings)
    return pair_runs(robot, of_empty, loaded, settings)


def get_only(empty: Sequence[Run], analysis: str) -> Run:
    """Returns the only empty run.

    Raises:
        BadValueError: There are several empty runs.
    """
    if len(empty) > 1:
        raise BadValueError("--empty", "", f"names {len(empty)} runs, must name one for {analysis}")
    return empty[0]


def pair_runs(robot: SerialChain, empty: Run, loaded: Run, settings: IdentificationSettings) -> Evidence:
    """Subtracts an empty run from a loaded run with the same motion.

    Raises:
        BadValueError: The loaded run does not repeat the empty run.
    """
    alignment = align(empty, loaded, settings.repeat_tolerance)
    step = max(1.0 / empty.rate, 1.0 / loaded.rate)
    times = np.arange(alignment.start, alignment.end, step)
    cutoff = max(compute_cutoff(empty, settings), compute_cutoff(loaded, settings))
    before = prepare(empty, settings, cutoff=cutoff, times=times)
    after = prepare(loaded, settings, cutoff=cutoff, times=times + alignment.lag)
    nominal = np.ones(robot.num_joints)
    # The motion is the mean of both runs, which differ by a ten-thousandth of a radian.
    both = before._replace(
        q=0.5 * (before.q + after.q),
        v=0.5 * (before.v + after.v),
        vdot=0.5 * (before.vdot + after.vdot),
        signal=restore_compensated(robot, loaded, after, nominal)
        - restore_compensated(robot, empty, before, nominal),
    )
    analysis = f"paired with {Path(empty.source).name}, lag {alignment.lag:.3f} s"
    evidence = build_evidence(
        robot, loaded.source, loaded.description.kind, both, settings, analysis=analysis, is_difference=True
    )
    covariance = evidence.phantom_covariance
    if settings.floor:
        covariance = project_pulls(robot, both, evidence.samples)
    return replace(
        evidence,
        prepared=both._replace(times=both.times + alignment.lag),
        phantom_covariance=covariance,
        is_repeated=True,
        notes=(f"the joint angles of the two runs agree to {1e3 * alignment.difference:.2g} mrad",),
    )


def pair_postures(robot: SerialChain, empty: Run, loaded: Run, settings: IdentificationSettings) -> Evidence:
    """Subtracts empty postures from the same postures with the load. Unmatched postures are left out.

    Raises:
        BadValueError: Too few postures match.
    """
    apart = np.abs(loaded.q[:, None] - empty.q[None]).max(axis=2)
    nearest = apart.argmin(axis=1)
    rows = np.flatnonzero(apart.min(axis=1) <= settings.repeat_tolerance)
    if len(rows) < FEWEST_POSTURES:
        problem = (
            f"repeats {len(rows)} postures of {empty.source} within {settings.repeat_tolerance:g} rad, must repeat"
        )
        hint = "--unpaired for other postures"
        raise BadValueError(loaded.source, "q", f"{problem} at least {FEWEST_POSTURES} ({hint})")
    kind = loaded.description.kind
    after = prepare(loaded, settings).select(rows)
    before = prepare(empty, settings).select(nearest[rows])
    nominal = np.ones(robot.num_joints)
    signal = restore_compensated(robot, loaded, after, nominal) - restore_compensated(robot, empty, before, nominal)
    if kind is not SignalKind.CURRENT:  # the arm droops under the load, so its own-weight torque changes
        signal = signal - robot.compute_arm_torques(*after.motion) + robot.compute_arm_torques(*before.motion)
    times = np.linspace(0.0, POSTURE_STEP * (len(rows) - 1), len(rows))
    evidence = build_evidence(
        robot,
        loaded.source,
        kind,
        after._replace(times=times, signal=signal),
        settings,
        analysis=f"postures held with the load, minus the same postures of {empty.source}",
        is_difference=True,
    )
    lost = len(loaded.q) - len(rows)
    notes = (f"{lost} postures without a counterpart in {empty.source} are left out",) if lost else ()
    return replace(evidence, is_repeated=True, notes=notes)


class Alignment(NamedTuple):
    """Alignment of a loaded run with an empty run in time."""

    lag: float  # lag of the loaded run behind the empty run, each on its own clock, [s]
    start: float  # start of the common part on the empty run's clock, [s]
    end: float  # end of the common part on the empty run's clock, [s]
    difference: float  # largest difference of a joint angle in the common part, [rad]


def align(empty: Run, loaded: Run, tolerance: float) -> Alignment:
    """Finds the lag of a loaded run behind an empty run with the same motion.

    Joint angles must agree within a tolerance, [rad].

    Raises:
        BadValueError: A run has no motion, or the loaded run does not repeat the empty run; the message names the row
            and the joint with the largest difference.
    """
    step = max(1.0 / empty.rate, 1.0 / loaded.rate)
    reference, moved = (_sample_velocity(run, step) for run in (empty, loaded))
    if not reference.any() or not moved.any():
        still = empty if not reference.any() else loaded
        raise BadValueError(still.source, "q", f"has no joint that moves faster than {_MOVING:g} rad/s")
    rough = _correlate(reference, moved) * step + loaded.times[0] - empty.times[0]
    margin = 3.0 * step  # the lag may change by two more steps
    start = float(max(empty.times[0], loaded.times[0] - rough + margin))
    end = float(min(empty.times[-1], loaded.times[-1] - rough - margin))
    times = np.arange(start, end, step)
    reference_q = resample(times, empty.times, empty.q)

    def compare(lag: float) -> Array:
        return resample(times + lag, loaded.times, loaded.q) - reference_q

    least = _SHARE * _measure_motion(loaded)
    if len(times) < 3 or end - start < least:
        problem = f"repeats {max(end - start, 0.0):.2f} s of {empty.source}, must repeat at least {least:.2f} s of it"
        raise BadValueError(loaded.source, "time", f"{problem} (--unpaired for other motions)")
    lag, slope = rough, np.gradient(reference_q, step, axis=0)
    for _ in range(_NUM_STEPS):  # least squares, with the slope of the reference
        lag -= float((slope * compare(lag)).sum() / np.maximum((slope**2).sum(), np.finfo(float).tiny))
        lag = float(np.clip(lag, rough - 2.0 * step, rough + 2.0 * step))
    difference = np.abs(compare(lag))
    row, joint = np.unravel_index(int(np.argmax(difference)), difference.shape)
    largest = float(difference[row, joint])
    if largest > tolerance:
        at = int(np.searchsorted(loaded.times, times[row] + lag))
        name = f"q_{joint + 1} ({loaded.description.joint_names[joint]})"
        problem = f"is {largest:.4f} rad off the same moment of {empty.source}, must be within {tolerance:g} rad"
        raise loaded.error_at(at, name, f"{problem} (--unpaired for runs that do not repeat each other)")
    return Alignment(lag, start, end, largest)


def _correlate(reference: Array, moved: Array) -> int:
    """Finds the lag of velocities, (N, C), behind similar reference velocities, in rows."""
    size = len(reference) + len(moved) - 1  # padded, so that ends do not wrap around
    spectra = np.fft.rfft(moved, size, axis=0) * np.fft.rfft(reference, size, axis=0).conj()
    lag = int(np.argmax(np.fft.irfft(spectra.sum(axis=1), size)))
    return lag if lag < len(moved) else lag - size


def _measure_motion(run: Run) -> float:
    """Computes the time from the first to the last motion, [s]."""
    moving = np.flatnonzero(np.abs(np.gradient(run.q, run.times, axis=0)).max(axis=1) > _MOVING)
    return float(run.times[moving[-1]] - run.times[moving[0]]) if moving.size else 0.0


def _sample_velocity(run: Run, step: float) -> Array:
    """Computes velocities from angles at evenly spaced times, with zero for an arm at rest.

    Velocities are matched instead of angles, so that motion decides and not the postures at rest.
    """
    times = np.arange(run.times[0], run.times[-1], step)
    v = np.gradient(resample(times, run.times, run.q), step, axis=0)
    return np.where(np.abs(v) > _MOVING, v, 0.0)
