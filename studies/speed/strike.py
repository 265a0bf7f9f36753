"""Accuracy of the integrator for a blow on a nail: its peaks, for any timing of the steps.

The stick of Simulation IV is swung at the nail by either end, with known densities. The whole closed loop is
simulated, with controller, estimator and loggers in place, from starts that differ in the position of the nail: up to
a millimetre to either side along the blow, so that it is struck up to 0.3 ms before or after the start of a control
period, at different moments of steps. The swing is simulated once for each; every setting then continues from a copy
of its Context 20 ms before the planned strike, until 35 ms after it. The reference is implicit Euler at 1e-6 with
steps of at most 10 us, from one start for each grip; an explicit integrator would need steps of 20 ns, as the
resistance is so stiff at rest.

Slow settings are simulated from fewer starts. Times are wall times: run it on an otherwise idle machine.

A discrete plant and hydroelastic contact are simulated without the controller, with its torques (plain_blow.py).
"""

import dataclasses
import functools
import itertools
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from pydrake.multibody.plant import ContactModel
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import load_hammer, plan_strike
from affordance.control.strike import Strike
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.plant.nail import STICTION_TOLERANCE, Nail
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.blow import read_nail_record
from affordance.simulation.diagram import TrialDiagram
from affordance.simulation.trial import TrialRunner
from studies.speed.plain_blow import Blow, PlainBlow, Strip, advance, free_joints, measure_blow
from studies.study import format_row, format_table

_MEASURES = [
    "grip",
    "blows",
    "peak force (N)",
    "off the reference (%)",
    "contact peak (N)",
    "impulse (N s)",
    "travel (mm)",
    "steps, most",
    "time, median (s)",
]
HEADER = ["integrator", "accuracy", "largest step (us)", *_MEASURES]
# Logs at every control period, for the torques that are fed to plain blows; steps end at control periods anyway.
SETTINGS = dataclasses.replace(DEFAULT_SETTINGS, log_period=DEFAULT_SETTINGS.control_period)
NUM_STARTS = 12
# Displacement of the nail from its believed position, along the blow, [m].
SHIFTS = np.linspace(-1e-3, 1e-3, NUM_STARTS)
# Starts for slow settings.
FEW = slice(0, NUM_STARTS, 6)
# The reference hardly depends on the start: radau3 finds the same from all.
REFERENCE = ("implicit_euler", 1e-6, 1e-5)
CHOSEN = (SETTINGS.contact_scheme, SETTINGS.contact_accuracy, SETTINGS.contact_max_step_size)
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
# Wall time after which a blow, and with it the setting, is given up, [s].
PATIENCE = 10.0
# Patience for the reference, and for simulations without the controller, [s].
_LONG_PATIENCE = 120.0


class Start(NamedTuple):
    """Closed loop shortly before its strike.

    Attributes:
        tool: Tool as it is held.
        strike: Task, with the true position of the nail.
        trial: Diagram of the trial.
        context: Context of the Diagram at that time.
    """

    tool: Tool
    strike: Strike
    trial: TrialDiagram
    context: Context


def prepare_starts(
    shifts: Iterable[float], change_nail: Callable[[Nail], Nail] = lambda nail: nail
) -> dict[str, list[Start]]:
    """Simulates the swings; returns the starts by the grip of the stick.

    Args:
        shifts: Displacements of the nail along the blow, [m].
        change_nail: Function that changes the simulated nail; blows are planned for the nail of the file.
    """
    materials = load_materials(MODELS / "materials.yaml")
    stick = load_tools(MODELS / "tools" / "novel.yaml", materials)[0]
    memory = MaterialMemory.from_densities(list_densities([stick]))
    hammer, model, runner = load_hammer(MODELS / "nail.yaml"), ArmModel(load_arm()), TrialRunner(SETTINGS)
    grips = {}
    for grip in stick.grips:
        tool = stick.gripped_by(grip)
        costs = hammer.build_cost(model, tool.components, SETTINGS)
        planned = plan_strike(costs, hammer, model, tool.parameters, SETTINGS)
        starts = []
        for shift in shifts:
            p_WNo = planned.placement.p_WNo + shift * planned.placement.direction_W
            placement = planned.placement._replace(nail=change_nail(planned.placement.nail), p_WNo=p_WNo)
            strike = Strike(planned.swing, placement, SETTINGS.control_period)
            trial = runner.get_diagram(strike.compute_duration(SETTINGS.mpc.horizon), tool, placement)
            free_joints(trial.arm.plant)
            simulator = runner.prepare(trial, tool, strike, memory, (0,))
            simulator.AdvanceTo(strike.contact[0])
            starts.append(Start(tool, strike, trial, simulator.get_context().Clone()))
        grips[grip.name] = starts
    return grips


def configure(scheme: str, accuracy: float, max_step: float) -> SimulatorConfig:
    """Returns the default configuration during possible contact, with another integrator."""
    return dataclasses.replace(
        SETTINGS, contact_scheme=scheme, contact_accuracy=accuracy, contact_max_step_size=max_step
    ).contact_simulator


def strike_nail(start: Start, config: SimulatorConfig, patience: float = PATIENCE) -> tuple[Blow, Context] | None:
    """Continues from a start; returns the blow and the Context after it, or None if it takes too long."""
    context = start.context.Clone()
    touch, leave = start.strike.contact
    simulator = Simulator(start.trial.diagram, context)
    config.start_time = touch
    ApplySimulatorConfig(config, simulator)
    begun = time.perf_counter()
    if not advance(simulator, start.trial.diagram, leave, patience):
        return None
    duration = time.perf_counter() - begun
    record = read_nail_record(start.trial, context, start.strike.placement)
    since = record.times >= touch
    logged = (record.travel[since], record.resistance[since], record.contact[since])
    return measure_blow(record.times[since], *logged, duration), context


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
    return plain.run(find_strip(start), configure(*CHOSEN), _LONG_PATIENCE)


def run_blows(blow: Callable[[Start], Blow | None], starts: Iterable[Start]) -> Iterator[Blow | None]:
    """Simulates blows from some starts, up to the first that takes too long, for which it yields None."""
    for start in starts:
        done = blow(start)
        yield done
        if done is None:
            return


def strike_with(
    scheme: str, accuracy: float, max_step: float, patience: float = PATIENCE
) -> Callable[[Start], Blow | None]:
    """Returns a function that simulates a blow with an integrator."""
    config = configure(scheme, accuracy, max_step)

    def blow(start: Start) -> Blow | None:
        done = strike_nail(start, config, patience)
        return None if done is None else done[0]

    return blow


def format_blows(label: Sequence[str], grip: str, found: Iterable[Blow | None], reference: float) -> list[str]:
    """Formats a row of a table; found is the result of ``run_blows``."""
    found = list(found)
    blows = [blow for blow in found if blow is not None]
    count = str(len(blows)) if len(blows) == len(found) else f"{len(blows)}, then given up"
    if not blows:
        return [*label, grip, count, *[""] * (len(_MEASURES) - 2)]
    peaks, contacts, impulses, travels, steps, seconds = np.array(blows).T
    return [
        *label,
        grip,
        count,
        _span(peaks, ".1f"),
        _span(100.0 * (peaks / reference - 1.0), "+.2f"),
        _span(contacts, ".0f"),
        _span(impulses, ".3f"),
        _span(1e3 * travels, ".2f"),
        f"{steps.max():.0f}",
        f"{np.median(seconds):.2f}",
    ]


def _span(values: Array, form: str) -> str:
    """Formats the least and largest of some values."""
    least, largest = f"{values.min():{form}}", f"{values.max():{form}}"
    return least if least == largest else f"{least} to {largest}"


def _label(scheme: str, accuracy: float, max_step: float) -> list[str]:
    mark = "**" if (scheme, accuracy, max_step) == CHOSEN else ""
    return [f"{mark}{text}{mark}" for text in (scheme, f"{accuracy:.0e}", f"{1e6 * max_step:.0f}")]


def find_reference(grips: Mapping[str, Sequence[Start]]) -> tuple[list[list[str]], dict[str, float]]:
    """Computes rows of the reference, and by grip the peak of the resistance, [N]."""
    rows, peaks = [], {}
    for grip, starts in grips.items():
        blow = strike_with(*REFERENCE, _LONG_PATIENCE)(starts[0])
        assert blow is not None  # otherwise there is nothing to compare with
        peaks[grip] = blow.peak
        rows.append(format_blows(_label(*REFERENCE), grip, [blow], blow.peak))
    return rows, peaks


def compare_integrators(grips: Mapping[str, Sequence[Start]], reference: Mapping[str, float]) -> Iterator[list[str]]:
    """Yields rows for each integrator of the closed loop, and for discrete plants."""
    for case in CASES:
        for grip, starts in grips.items():
            blows = run_blows(strike_with(*case), starts[FEW] if case in _SLOW else starts)
            yield format_blows(_label(*case), grip, blows, reference[grip])
    for time_step in DISCRETE_STEPS:
        for grip, starts in grips.items():
            some = starts if time_step > min(DISCRETE_STEPS) else starts[FEW]
            blows = run_blows(functools.partial(strike_plainly, time_step=time_step), some)
            yield format_blows(["discrete", "", f"{1e6 * time_step:.0f}"], grip, blows, reference[grip])


def compare_contact_models(
    grips: Mapping[str, Sequence[Start]], reference: Mapping[str, float]
) -> Iterator[list[str]]:
    """Yields rows for point contact and hydroelastic contact, with the chosen integrator."""
    for name, model in (("point", ContactModel.kPoint), ("hydroelastic", ContactModel.kHydroelastic)):
        for grip, starts in grips.items():
            some = starts[FEW] if model == ContactModel.kPoint else starts[:1]
            blows = run_blows(functools.partial(strike_plainly, model=model), some)
            yield format_blows([name], grip, blows, reference[grip])


def compare_stiction_tolerances(
    grips: Mapping[str, Sequence[Start]], reference: Mapping[str, float]
) -> Iterator[list[str]]:
    """Yields rows for each stiction tolerance, with the chosen integrator."""
    for tolerance in STICTION_TOLERANCES:
        for grip, starts in grips.items():
            for start in starts:
                start.trial.arm.plant.set_stiction_tolerance(tolerance)
            blows = run_blows(strike_with(*CHOSEN), starts)
            yield format_blows([f"{1e3 * tolerance:.0f}"], grip, blows, reference[grip])
            for start in starts:
                start.trial.arm.plant.set_stiction_tolerance(STICTION_TOLERANCE)


def drive_yielding_nail() -> Iterator[list[str]]:
    """Yields rows for a nail of constant yield force that takes the same work over the demanded travel."""

    def change(nail: Nail) -> Nail:
        mean = 0.5 * nail.stiffness * (nail.depth_set + nail.depth_demanded)
        return dataclasses.replace(nail, yield_force=mean)

    for grip, starts in prepare_starts(SHIFTS, change).items():
        blows = run_blows(strike_with(*CHOSEN), starts)
        force = starts[0].strike.placement.nail.yield_force
        assert force is not None  # set by change
        yield format_blows([f"{force:.1f}"], grip, blows, force)


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Measures the chosen setting against the reference; returns rows of a table, and the time per blow."""
    grips = prepare_starts(SHIFTS)
    rows, reference = find_reference(grips)
    seconds = []
    for grip, starts in grips.items():
        found = list(run_blows(strike_with(*CHOSEN), starts))
        rows.append(format_blows(_label(*CHOSEN), grip, found, reference[grip]))
        seconds += [blow.seconds for blow in found if blow is not None]
    return rows, {"strike_wall_s": float(np.median(seconds))}


def main() -> None:
    """Prints the tables of the full study, row by row as they are computed."""
    grips = prepare_starts(SHIFTS)
    rows, reference = find_reference(grips)
    for header, found in (
        (HEADER, itertools.chain(rows, compare_integrators(grips, reference))),
        (["contact", *_MEASURES], compare_contact_models(grips, reference)),
        (["stiction tolerance (mm/s)", *_MEASURES], compare_stiction_tolerances(grips, reference)),
        (["yield force (N)", *_MEASURES], drive_yielding_nail()),
    ):
        print(format_table(header, ()), flush=True)
        for row in found:
            print(format_row(row), flush=True)
        print()


if __name__ == "__main__":
    main()
