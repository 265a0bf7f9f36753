"""Suggestion of the next posture to hold, by predicting what recorded postures with one joint turned would show."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from affordance.extensions.payload.evidence.evidence import build_evidence
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.excitation.expectation import Expectation, format_sd
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief
from affordance.extensions.payload.recording.preparation import PreparedRun
from affordance.extensions.payload.settings import IdentificationSettings
from affordance.plant.serial_chain import SerialChain

_BASES = 3  # number of recorded postures to vary: the first, a middle one and the last
_TURNS = np.radians([-90.0, -45.0, 45.0, 90.0])  # turns of one joint that are tried, [rad]
_HELPS = 0.9  # a posture is recommended if it reduces the standard deviation to less than this share


def suggest_posture(
    robot: SerialChain, belief: PayloadBelief, gains: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Suggests the posture that would help most, as a recorded posture with one joint turned.

    The criterion is the SD of the mass if it was not seen, else of the centre of mass. Collisions are not checked.
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
    if found[best] < _HELPS * now:
        yield (
            f"hold one more posture: posture {row + 1} with {robot.joint_names[joint]} turned by "
            f"{np.degrees(turn):+.0f} deg would reduce the SD of the {name} from {before} to {after} {unit} "
            "(collisions are not checked)"
        )
    else:
        left = f"leaves the SD of the {name} at {after} {unit}"
        yield f"one more posture would hardly help: the best of {allowed.sum()} {left}"
