"""Users' mistakes of increasing size: which sizes are not noticed, and how far they change the answer.

Each mistake is made in a good pair of runs, with gains from before. The blind band of a mistake ends at the smallest
size that is refused or doubted.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import AffordanceError
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings
from studies.recorded.mistake_outcomes import Case


class SizedMistake(NamedTuple):
    """Mistake made in several sizes, in increasing order."""

    name: str  # description of the mistake
    unit: str  # unit of its size
    sizes: tuple[float, ...]
    make: Callable[[Case, float], Case]


class Answer(NamedTuple):
    """Answer of identification to a mistake of one size."""

    size: float
    verdict: str  # refused, doubted, not seen, or answered
    mass: float  # mean of the mass, [kg]; NaN if refused
    moved: float  # difference of the mass from that of the good pair, in stated SDs
    reason: str  # first reason given


def _scale(case: Case, factor: float, *, both: bool) -> Case:
    """Multiplies the signal of the loaded run, or of both runs, by a factor."""
    loaded = replace(case.loaded, signal=factor * case.loaded.signal)
    empty = replace(case.empty, signal=factor * case.empty.signal) if both else case.empty
    return replace(case, loaded=loaded, empty=empty)


def _get_gain(case: Case) -> Array:
    return np.ones(case.robot.num_joints) if case.gains is None else case.gains.mean[:, 0]


def _move(run: Run) -> tuple[Array, Array, Array]:
    v = np.gradient(run.q, run.times, axis=0) if run.v is None else run.v
    return run.q, v, np.gradient(v, run.times, axis=0)


def _command(case: Case, share: float) -> Case:
    """Replaces a fraction of the measured signals with what a controller would command for the arm alone."""

    def change(run: Run) -> Run:
        robot = case.robot.with_gravity(run.description.gravity)
        commanded = _get_gain(case) * robot.compute_arm_torques(*_move(run))
        return replace(run, signal=(1.0 - share) * run.signal + share * commanded)

    return replace(case, loaded=change(case.loaded), empty=change(case.empty))


def _pull(case: Case, force: float) -> Case:
    """Adds an upward pull at the tip in the loaded run, [N]."""
    run, robot = case.loaded, case.robot.with_gravity(case.loaded.description.gravity)
    J = robot.compute_motion(*_move(run)).Jv_V_WT[:, 3:]
    up = -np.array(run.description.gravity) / np.linalg.norm(run.description.gravity)
    torque = -force * np.einsum("nkj,k->nj", J, up)
    return replace(case, loaded=replace(run, signal=run.signal + _get_gain(case) * torque))


def _subtract(case: Case, share: float, pi: Array) -> Case:
    """Subtracts a fraction of the payload in the loaded run only, as a controller may do without saying so."""
    run, robot = case.loaded, case.robot.with_gravity(case.loaded.description.gravity)
    torque = robot.compute_payload_regressors(*_move(run)) @ (share * pi)
    return replace(case, loaded=replace(run, signal=run.signal - _get_gain(case) * torque))


def _delay(case: Case, milliseconds: float) -> Case:
    """Delays the velocities of both runs."""

    def change(run: Run) -> Run:
        _, v, _ = _move(run)
        late = [np.interp(run.times - 1e-3 * milliseconds, run.times, column) for column in v.T]
        return replace(run, v=np.column_stack(late))

    return replace(case, loaded=change(case.loaded), empty=change(case.empty))


def list_mistakes(pi: Array) -> tuple[SizedMistake, ...]:
    """Lists the mistakes, given the parameters of the good pair's payload, (10,)."""
    factors = (1.01, 1.02, 1.03, 1.05, 1.07, 1.1, 1.2)
    return (
        SizedMistake("another controller: both signals scaled by", "", factors, lambda c, x: _scale(c, x, both=True)),
        SizedMistake("signals of the loaded run scaled by", "", factors, lambda c, x: _scale(c, x, both=False)),
        SizedMistake("commanded instead of measured signals, fraction", "", (0.5, 0.9, 1.0), _command),
        SizedMistake("pull at the tip in the loaded run", "N", (0.1, 0.3, 1.0, 2.0, 3.0), _pull),
        SizedMistake(
            "payload subtracted in the loaded run, fraction",
            "",
            (0.05, 0.2, 0.5, 1.0),
            lambda c, x: _subtract(c, x, pi),
        ),
        SizedMistake("delay of velocities", "ms", (5.0, 10.0, 20.0, 40.0, 65.0, 100.0), _delay),
    )


def measure_blind_bands(case: Case, settings: IdentificationSettings) -> dict[str, Any]:
    """Makes every mistake in every size; returns answers by mistake, and mass and SD of the good pair, [kg]."""
    good = case.identify(settings)
    found = {
        mistake.name: [_try(mistake, case, size, good, settings)._asdict() for size in mistake.sizes]
        for mistake in list_mistakes(good.parameters)
    }
    return {"mass_kg": good.mass, "sd_kg": good.mass_sd, "doubts": list(good.doubts), "mistakes": found}


def _try(
    mistake: SizedMistake, case: Case, size: float, good: PayloadBelief, settings: IdentificationSettings
) -> Answer:
    try:
        belief = mistake.make(case, size).identify(settings)
    except AffordanceError as error:
        return Answer(size, "refused", float("nan"), float("nan"), str(error))
    moved = abs(belief.mass - good.mass) / max(belief.mass_sd, 1e-12)
    verdict = "doubted" if belief.doubts else "answered" if belief.shows_mass else "not seen"
    return Answer(size, verdict, belief.mass, moved, belief.doubts[0] if belief.doubts else "")


def list_rows(found: dict[str, Any]) -> Sequence[Sequence[str]]:
    """Lists table rows: unnoticed sizes, their largest effect on the mass, and the smallest size that is noticed."""
    rows = []
    for name, answers in found["mistakes"].items():
        passed = [each for each in answers if each["verdict"] == "answered"]
        seen = next((each for each in answers if each["verdict"] != "answered"), None)
        worst = max(passed, key=lambda each: abs(each["mass"] - found["mass_kg"]), default=None)
        moved = "" if worst is None else f"{worst['size']:g}: {worst['mass']:.3f} kg, {worst['moved']:.1f} SD"
        first = "never" if seen is None else f"{seen['size']:g}: {seen['verdict']}"
        rows.append([name, ", ".join(f"{each['size']:g}" for each in passed) or "none", moved, first])
    return rows
