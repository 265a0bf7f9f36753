"""Predicts how much a few seconds of further motion, chosen at random, would improve a result."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from affordance.extensions.payload.evidence.evidence import build_evidence
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.excitation.expectation import Aim, Expectation, Spread, format_sd
from affordance.extensions.payload.excitation.planned_motion import (
    FourierFamily,
    MotionFamily,
    MotionLimits,
    PostureFamily,
    list_times,
)
from affordance.extensions.payload.posterior.payload_belief import COM, MASS, MOMENTS, QUANTITIES, PayloadBelief
from affordance.extensions.payload.recording.preparation import PreparedRun
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.plant.serial_chain import SerialChain

_SECONDS = 4.0  # duration of the additional motion, [s]
_POSTURES, _DRAWS = 2, 3  # postures per motion, and motions drawn for each speed
# Factors of the run's largest speed and acceleration, for each description of a motion.
_PACES = {
    "slowly through other postures": (1.0, 1.0),
    "as fast as before, elsewhere": (1.0, 1.0),
    "faster": (2.0, 4.0),
}
# Joint acceleration that arms of any size reach, [rad/s^2], for robot files without a limit.
USUAL_ACCELERATION = 3.0
_HELPS = 0.8  # ratio of standard deviations below which a motion is recommended
# Name of each aim, its indices in QUANTITIES, and the printed unit with its factor.
_AIMS = {
    Aim.MASS: ("mass", MASS, "g", 1e3),
    Aim.COM: ("centre of mass", COM, "mm", 1e3),
    Aim.INERTIA: ("moments of inertia", MOMENTS, "kg m^2", 1.0),
}


def suggest_motion(
    robot: SerialChain, belief: PayloadBelief, gains: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Predicts how much four more seconds of motion would reduce standard deviations.

    The quantities are the mass and the first other quantity that was not identified. Nothing is yielded for a wrist
    sensor, or for an arm modelled from its file, because an empty run helps more there. If the run was combined with
    a camera or a scale, the prediction uses the motion alone, and is reported only if it is an improvement.

    Args:
        robot: Arm with the gravity of the run.
        belief: Posterior after the run.
        gains: Gains before the run, including drift.
        settings: Settings of the identification.
    """
    fit = belief.fit
    if fit.evidence.kind is SignalKind.WRENCH or not fit.evidence.is_difference:
        return
    rate = fit.evidence.rate
    evidence = replace(fit.evidence, least_variance=fit.long_run_variance)
    expectation = Expectation.after_run(robot, gains, fit, settings)
    now = expectation.measure(evidence, fit.statistics)
    rng, times = np.random.default_rng(0), list_times(_SECONDS)
    found: list[tuple[str, Spread]] = []
    pace = ""
    for name, family in _list_families(robot, belief):
        pace = f"up to {family.limits.v_max.max():.1f} rad/s and {family.limits.vdot_max.max():.1f} rad/s^2"
        drawn = [family.build(family.draw(rng), times) for _ in range(_DRAWS)]
        for motion in (each for each in drawn if each is not None):
            added = expectation.build_evidence(motion).compute_statistics(settings).products
            total = replace(fit.statistics, products=fit.statistics.products + rate / motion.rate * added)
            found.append((f"{name} ({pace})", expectation.measure(evidence, total)))
    if not found:
        return
    hidden = [aim for aim in (Aim.COM, Aim.INERTIA) if belief.hidden & set(QUANTITIES[_AIMS[aim][1]])]
    for aim in (Aim.MASS, *hidden[:1]):
        name, place, unit, factor = _AIMS[aim]
        best = int(np.argmin([spread.get(aim) for _, spread in found]))
        words, least = found[best][0], min(found[best][1].get(aim), now.get(aim))
        # For three components: the root sum of squares.
        stated = float(np.linalg.norm(belief.marginals.sd[place]))
        before, alone = now.get(aim), " (from the motion alone, without camera or scale)"
        if belief.seen is None and belief.reference_mass is None:
            before, least, alone = stated, least / before * stated, ""  # as printed in the table
        elif least >= stated:
            continue
        sds = [format_sd(factor * sd) for sd in (before, least)]
        if least < _HELPS * before:
            yield (
                f"{_SECONDS:g} s more, moving {words}, would reduce the SD of the {name} from {sds[0]} to "
                f"{sds[1]} {unit}{alone}; affordance excite --for {aim.value} designs a motion"
            )
        else:
            yield (
                f"{_SECONDS:g} s more would hardly help: the best of {len(found)} random motions ({pace}) "
                f"leaves the SD of the {name} at {sds[1]} (now {sds[0]}) {unit}{alone}"
            )


def suggest_run(belief: PayloadBelief) -> str:
    """Suggests a recording that would identify the mass. The text is empty if the run identified it."""
    evidence = belief.fit.evidence
    if belief.shows_mass:
        return ""
    if evidence.is_at_rest and (evidence.kind is SignalKind.WRENCH or evidence.is_repeated):
        return "hold more postures, in which the payload has other orientations"
    if evidence.is_at_rest:
        return "hold the same postures also with an empty hand (--empty)"
    if evidence.kind is SignalKind.WRENCH:
        return "turn the sensor slowly through other postures, also with an empty hand (--empty)"
    if not evidence.is_difference:
        return "record the same motion with an empty hand (--empty): the arm's file is too uncertain"
    if not evidence.is_repeated:
        return "record the same motion with an empty hand: an arm fitted to other motions is too uncertain"
    return "move slowly through other postures; affordance excite --for mass designs the motion"


def _list_families(robot: SerialChain, belief: PayloadBelief) -> Iterator[tuple[str, MotionFamily]]:
    """Lists families of motions near the run, within angle limits only because torque limits are not known."""
    run = belief.fit.evidence.prepared
    middle, quarter = run.q.mean(axis=0), np.full(robot.num_joints, 0.5 * np.pi)
    low, high = robot.limits
    fastest = np.maximum(np.abs(run.v).max(axis=0), 0.1)
    hardest = np.maximum(np.abs(run.vdot).max(axis=0), 0.1)
    # Without a limit in the file, the run's own acceleration is certainly possible.
    known = np.isfinite(robot.acceleration_limits)
    hardest_allowed = np.where(known, robot.acceleration_limits, np.maximum(USUAL_ACCELERATION, hardest))
    for words, (speed, acceleration) in _PACES.items():
        limits = MotionLimits(
            np.minimum(np.maximum(low, middle - quarter), run.q.min(axis=0)),
            np.maximum(np.minimum(high, middle + quarter), run.q.max(axis=0)),
            np.minimum(speed * fastest, robot.velocity_limits),
            np.minimum(acceleration * hardest, hardest_allowed),
            np.full(robot.num_joints, np.inf),
        )
        yield (
            words,
            PostureFamily(robot, limits, _SECONDS, _POSTURES)
            if "postures" in words
            else FourierFamily(robot, limits, _SECONDS),
        )


_BASES = 3  # number of recorded postures that are varied: the first, a middle one and the last
_TURNS = np.radians([-90.0, -45.0, 45.0, 90.0])  # changes of one joint's angle, [rad]
_POSTURE_HELPS = 0.9  # ratio of standard deviations below which a posture is recommended


def suggest_posture(
    robot: SerialChain, belief: PayloadBelief, gains: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Suggests an additional posture: the most helpful change of one joint in a recorded posture.

    The criterion is the SD of the mass if it was not identified, otherwise of the centre of mass. Collisions are not
    checked.
    """
    fit, kind = belief.fit, belief.fit.evidence.kind
    run = fit.evidence.prepared
    evidence = replace(fit.evidence, least_variance=fit.long_run_variance)
    expectation = Expectation.after_run(robot, gains, fit, settings)
    low, high = robot.limits
    rows = np.unique(np.linspace(0, len(run.q) - 1, _BASES).astype(int))
    turns = [(row, joint, turn) for row in rows for joint in range(robot.num_joints) for turn in _TURNS]
    q = np.array([run.q[row] + turn * np.eye(robot.num_joints)[joint] for row, joint, turn in turns])
    allowed = ((q >= low) & (q <= high)).all(axis=1)
    if not allowed.any():
        return
    rest = np.zeros_like(q)
    motion = PreparedRun(np.arange(len(q)) / run.rate, q, rest, rest, np.zeros((len(q), len(gains.mean))), run.cutoff)
    tried = build_evidence(robot, "", kind, motion, settings, analysis="", is_difference=True)
    name, unit, i = ("centre of mass", "mm", 1) if belief.shows_mass else ("mass", "g", 0)
    now = expectation.measure(evidence, fit.statistics)[i]
    found = np.full(len(q), np.inf)
    for number in np.flatnonzero(allowed):
        added = tried.select(slice(number, number + 1)).compute_statistics(settings).products
        total = replace(fit.statistics, products=fit.statistics.products + added)
        found[number] = expectation.measure(evidence, total)[i]
    best = int(found.argmin())
    row, joint, turn = turns[best]
    before, after = (format_sd(1e3 * sd) for sd in (now, found[best]))
    if found[best] < _POSTURE_HELPS * now:
        yield (
            f"hold one more posture: posture {row + 1} with {robot.joint_names[joint]} turned by "
            f"{np.degrees(turn):+.0f} deg would reduce the SD of the {name} from {before} to {after} {unit} "
            "(collisions are not checked)"
        )
    else:
        left = f"leaves the SD of the {name} at {after} {unit}"
        yield f"one more posture would hardly help: the best of {allowed.sum()} {left}"
