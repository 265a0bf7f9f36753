"""Blows on a nail with other integrators, plants, models of contact and nails.

A discrete plant and hydroelastic contact are simulated without the controller, with its torques (plain_blow.py).
Slow settings are simulated from fewer starts. Times are wall times: run it on an otherwise idle machine.
"""

import dataclasses
import functools
from collections.abc import Callable, Iterator

import numpy as np
from pydrake.multibody.plant import ContactModel

from affordance.plant.nail import STICTION_TOLERANCE, Nail
from studies.speed.plain_blow import Blow, PlainBlow, Strip
from studies.speed.strike import (
    CHOSEN,
    LABEL,
    LONG_PATIENCE,
    MEASURES,
    NUM_STARTS,
    SETTINGS,
    SHIFTS,
    Start,
    configure,
    find_reference,
    format_blows,
    label,
    prepare_starts,
    run_blows,
    strike_nail,
    strike_with,
)

HEADER = [*LABEL, *MEASURES]
# Starts for slow settings.
FEW, ONE = slice(0, NUM_STARTS, 6), slice(1)
CASES = (
    ("implicit_euler", 1e-3, 1e-3),
    CHOSEN,
    ("implicit_euler", 1e-4, 1e-4),
    ("radau1", 1e-3, 1e-4),
    ("radau3", 1e-3, 1e-3),
    ("radau3", 1e-3, 1e-4),
    ("cenic", 1e-3, 1e-3),
    ("cenic", 1e-5, 1e-4),
    ("cenic", 1e-6, 1e-5),
)
DISCRETE_STEPS = (1e-4, 1e-5, 1e-6)
STICTION_TOLERANCES = (1e-3, STICTION_TOLERANCE, 3e-2)
# Integrators of the closed loop that are slow.
_SLOW = (("cenic", 1e-6, 1e-5),)


def find_strip(start: Start) -> Strip:
    """Returns the state at a start, and the subsequent torques of the closed loop."""
    done = strike_nail(start, configure(*CHOSEN))
    assert done is not None  # the chosen setting
    plant, n = start.trial.arm.plant, start.trial.arm.num_joints
    plant_context = start.trial.arm.plant.GetMyContextFromRoot(start.context)
    x = np.concatenate([plant.GetPositions(plant_context)[:n], plant.GetVelocities(plant_context)[:n]])
    log = start.trial.tau_log.FindLog(done[1])
    # A row's torques are those of the control period that ends then.
    since = np.array(log.sample_times()) > start.context.get_time() + 0.5 * SETTINGS.control_period
    return Strip(x, log.data().T[since], SETTINGS.control_period)


def strike_plainly(start: Start, *, model: ContactModel = ContactModel.kPoint, time_step: float = 0.0) -> Blow | None:
    """Simulates the blow of a start without the controller, with the chosen integrator if continuous."""
    plain = PlainBlow(start.tool, start.strike.placement, model=model, time_step=time_step)
    return plain.run(find_strip(start), configure(*CHOSEN), LONG_PATIENCE)


def strike_with_stiction(tolerance: float, start: Start) -> Blow | None:
    """Simulates the blow of a start with the chosen integrator and another stiction tolerance, [m/s]."""
    plant = start.trial.arm.plant
    plant.set_stiction_tolerance(tolerance)
    blow = strike_with(*CHOSEN)(start)
    plant.set_stiction_tolerance(STICTION_TOLERANCE)
    return blow


def list_cases() -> Iterator[tuple[list[str], Callable[[Start], Blow | None], slice]]:
    """Yields first cells, a function that simulates a blow, and the starts of all rows on the nail of the file.

    They are integrators of the closed loop, discrete plants, models of contact, and stiction tolerances.
    """
    every = slice(None)
    for case in CASES:
        yield label(*case), strike_with(*case), FEW if case in _SLOW else every
    for time_step in DISCRETE_STEPS:
        blow = functools.partial(strike_plainly, time_step=time_step)
        some = every if time_step > min(DISCRETE_STEPS) else FEW
        yield ["discrete", "", f"{1e6 * time_step:.0f}"], blow, some
    for name, model, some in (("point", ContactModel.kPoint, FEW), ("hydroelastic", ContactModel.kHydroelastic, ONE)):
        yield [f"{name} contact", "", ""], functools.partial(strike_plainly, model=model), some
    for tolerance in STICTION_TOLERANCES:
        cells = [f"stiction tolerance {1e3 * tolerance:.0f} mm/s", "", ""]
        yield cells, functools.partial(strike_with_stiction, tolerance), every


def drive_yielding_nail() -> Iterator[list[str]]:
    """Yields rows for a nail of constant yield force that takes the same work over the demanded travel."""

    def change(nail: Nail) -> Nail:
        mean = 0.5 * nail.stiffness * (nail.depth_set + nail.depth_demanded)
        return dataclasses.replace(nail, yield_force=mean)

    for grip, starts in prepare_starts(SHIFTS, change).items():
        blows = run_blows(strike_with(*CHOSEN), starts)
        force = starts[0].strike.placement.nail.yield_force
        assert force is not None  # set by change
        yield format_blows([f"yield force {force:.1f} N", "", ""], grip, blows, force)


def measure() -> Iterator[list[str]]:
    """Yields the rows of all comparisons."""
    grips = prepare_starts(SHIFTS)
    rows, reference = find_reference(grips)
    yield from rows
    for cells, blow, some in list_cases():
        for grip, starts in grips.items():
            yield format_blows(cells, grip, run_blows(blow, starts[some]), reference[grip])
    yield from drive_yielding_nail()
