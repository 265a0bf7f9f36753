"""Accuracy of the integrator for a blow on a nail: its peaks, for any timing of the steps.

The stick of Simulation IV is swung at the nail by either end, with known densities. The whole closed loop is
simulated, with controller, estimator and loggers in place, from starts that differ in the position of the nail: up to
a millimetre to either side along the blow, so that it is struck up to 0.3 ms before or after the start of a control
period, at different moments of steps. The swing is simulated once for each; every setting then continues from a copy
of its Context 20 ms before the planned strike, until 35 ms after it. The reference is implicit Euler at 1e-6 with
steps of at most 10 us, from one start for each grip; an explicit integrator would need steps of 20 ns, as the
resistance is so stiff at rest.

Times are wall times: run it on an otherwise idle machine. Here the chosen integrator is compared with the reference;
strike_tables.py has other integrators, plants and models of contact.
"""

import dataclasses
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
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
from affordance.plant.nail import Nail
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.blow import read_nail_record
from affordance.simulation.diagram import TrialDiagram
from affordance.simulation.trial import TrialRunner
from studies.speed.plain_blow import Blow, advance, free_joints, measure_blow

MEASURES = [
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
LABEL = ["integrator", "accuracy", "largest step (us)"]
HEADER = [*LABEL, *MEASURES]
# Logs at every control period, for the torques that are fed to plain blows; steps end at control periods anyway.
SETTINGS = dataclasses.replace(DEFAULT_SETTINGS, log_period=DEFAULT_SETTINGS.control_period)
NUM_STARTS = 12
# Displacement of the nail from its believed position, along the blow, [m].
SHIFTS = np.linspace(-1e-3, 1e-3, NUM_STARTS)
# The reference hardly depends on the start: radau3 finds the same from all.
REFERENCE = ("implicit_euler", 1e-6, 1e-5)
CHOSEN = (
    SETTINGS.integrator.contact_scheme,
    SETTINGS.integrator.contact_accuracy,
    SETTINGS.integrator.contact_max_step,
)
# Wall time after which a blow, and with it the setting, is given up, [s].
PATIENCE = 10.0
# Patience for the reference, and for simulations without the controller, [s].
LONG_PATIENCE = 120.0


class Start(NamedTuple):
    """Closed loop shortly before its strike."""

    tool: Tool  # tool as it is held
    strike: Strike  # task, with the true position of the nail
    trial: TrialDiagram  # diagram of the trial
    context: Context  # context of the Diagram at that time


def prepare_starts(
    shifts: Iterable[float], change_nail: Callable[[Nail], Nail] = lambda nail: nail
) -> dict[str, list[Start]]:
    """Simulates the swings, the nail being displaced along the blow, [m]; returns starts by the grip of the stick.

    The simulated nail may be changed; blows are planned for the nail of the file.
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
        SETTINGS.integrator, contact_scheme=scheme, contact_accuracy=accuracy, contact_max_step=max_step
    ).contact


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
        return [*label, grip, count, *[""] * (len(MEASURES) - 2)]
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
    least, largest = f"{values.min():{form}}", f"{values.max():{form}}"
    return least if least == largest else f"{least} to {largest}"


def label(scheme: str, accuracy: float, max_step: float) -> list[str]:
    """Formats the first cells of an integrator's row."""
    mark = "**" if (scheme, accuracy, max_step) == CHOSEN else ""
    return [f"{mark}{text}{mark}" for text in (scheme, f"{accuracy:.0e}", f"{1e6 * max_step:.0f}")]


def find_reference(grips: Mapping[str, Sequence[Start]]) -> tuple[list[list[str]], dict[str, float]]:
    """Computes rows of the reference, and by grip the peak of the resistance, [N]."""
    rows, peaks = [], {}
    for grip, starts in grips.items():
        blow = strike_with(*REFERENCE, LONG_PATIENCE)(starts[0])
        assert blow is not None  # otherwise there is nothing to compare with
        peaks[grip] = blow.peak
        rows.append(format_blows(label(*REFERENCE), grip, [blow], blow.peak))
    return rows, peaks


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Measures the chosen setting against the reference; returns rows of a table, and the time per blow."""
    grips = prepare_starts(SHIFTS)
    rows, reference = find_reference(grips)
    seconds = []
    for grip, starts in grips.items():
        found = list(run_blows(strike_with(*CHOSEN), starts))
        rows.append(format_blows(label(*CHOSEN), grip, found, reference[grip]))
        seconds += [blow.seconds for blow in found if blow is not None]
    return rows, {"strike_wall_s": float(np.median(seconds))}
