"""Further motion that would show what a run left undetermined: a few motions are tried, none is designed."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from affordance.identification.evidence.gains import Gains
from affordance.identification.excitation.expectation import Aim, Expectation
from affordance.identification.excitation.planned_motion import (
    FourierFamily,
    MotionFamily,
    MotionLimits,
    PostureFamily,
    list_times,
)
from affordance.identification.posterior.marginals import QUANTITIES
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.recording.robot_chain import RobotChain
from affordance.identification.settings import IdentificationSettings, SignalKind

_SECONDS = 4.0  # more
_POSTURES = 2
# Times the top speed and acceleration of the run, by the words for a motion.
_PACES = {
    "slowly through other postures": (1.0, 1.0),
    "as fast as before, elsewhere": (1.0, 1.0),
    "faster": (2.0, 4.0),
}
_HELPS = 0.8  # share of the standard deviation that is left, below which a motion is worth a line
_AIMS = ((Aim.MASS, "g", 1e3), (Aim.COM, "mm", 1e3), (Aim.INERTIA, "kg m^2", 1.0))
_WORDS = {Aim.MASS: "mass", Aim.COM: "centre of mass", Aim.INERTIA: "moments of inertia"}
_OF = {"mass": Aim.MASS, **dict.fromkeys(QUANTITIES[1:4], Aim.COM), **dict.fromkeys(QUANTITIES[4:7], Aim.INERTIA)}


def suggest_motion(
    robot: RobotChain, belief: PayloadBelief, gains: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Says what four more seconds would bring for the first quantity that was not seen, and of which motion.

    Yields nothing if everything was seen, or if the arm is believed to be as in its file: an empty run helps more.

    Args:
        robot: Model of the arm, with gravity as in the run.
        belief: Result of the identification.
        gains: Gains as known before, drift included.
        settings: Identification settings.
    """
    fit, hidden = belief.fit, {_OF[name] for name in belief.hidden}
    wanted = next((each for each in _AIMS if each[0] in hidden), None)
    if wanted is None or fit.evidence.kind is SignalKind.WRENCH or not fit.evidence.is_difference:
        return
    aim, unit, factor = wanted
    rate = fit.evidence.rate
    evidence = replace(fit.evidence, least_variance=fit.long_run_variance)
    expectation = Expectation(
        robot,
        gains,
        fit.long_run_variance / rate,
        fit.mode.theta[None],
        evidence.phantom_covariance,
        settings=settings,
    )
    now = expectation.measure(evidence, fit.statistics).get(aim)
    rng, times = np.random.default_rng(0), list_times(_SECONDS)
    least, words, name, pace = now, "", "", ""
    for name, family in _list_families(robot, belief):
        motion = family.build(family.draw(rng), times)
        if motion is None:
            continue
        added = expectation.build_evidence(motion).compute_statistics(settings).products
        total = replace(fit.statistics, products=fit.statistics.products + rate / motion.rate * added)
        found = expectation.measure(evidence, total).get(aim)
        pace = f"up to {family.limits.v_max.max():.1f} rad/s and {family.limits.vdot_max.max():.1f} rad/s^2"
        if found <= least:
            least, words = found, f"{name} ({pace})"
    if least < _HELPS * now:
        yield (
            f"{_SECONDS:g} s more, moved {words}, would bring the SD of the {_WORDS[aim]} from {factor * now:.2g} to "
            f"{factor * least:.2g} {unit}; affordance excite --for {aim.value} designs a motion"
        )
    else:
        yield f"{_SECONDS:g} s more would hardly show the {_WORDS[aim]}, even if moved {name} ({pace})"


def _list_families(robot: RobotChain, belief: PayloadBelief) -> Iterator[tuple[str, MotionFamily]]:
    """Lists motions about the place of the run, within the arm's angles; torques of its file are not known here."""
    run = belief.fit.evidence.prepared
    middle, quarter = run.q.mean(axis=0), np.full(robot.num_joints, 0.5 * np.pi)
    low, high = robot.limits
    for words, (speed, acceleration) in _PACES.items():
        limits = MotionLimits(
            np.minimum(np.maximum(low, middle - quarter), run.q.min(axis=0)),
            np.maximum(np.minimum(high, middle + quarter), run.q.max(axis=0)),
            speed * np.maximum(np.abs(run.v).max(axis=0), 0.1),
            acceleration * np.maximum(np.abs(run.vdot).max(axis=0), 0.1),
            np.full(robot.num_joints, np.inf),
        )
        yield (
            words,
            PostureFamily(robot, limits, _SECONDS, _POSTURES)
            if "postures" in words
            else FourierFamily(robot, limits, _SECONDS),
        )
