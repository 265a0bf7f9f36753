"""Accuracy and time of the integrator for a blow on a nail, whenever its steps happen to occur.

The stick of Simulation IV is swung at the nail by either end, with known densities. The whole closed loop is
simulated, including controller, estimator and loggers. Starts differ in the position of the nail, by up to a
millimetre to either side along the blow, so that the nail is struck up to 0.3 ms before or after the start of a
control period and at different moments within steps. Each swing is simulated once; every setting of the integrator
then continues from a copy of its Context, from 20 ms before the planned strike until 35 ms after it. The reference is
implicit Euler at 1e-6 with steps of at most 10 us, from one start for each grip. An explicit integrator would need
steps of 20 ns, because the resistance of a nail at rest is very stiff.

Times are wall times, so run it on an otherwise idle machine. Other integrators, plants and contact models were
compared once (docs/decisions/0013-nail.md).
"""

import dataclasses
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import Context

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import load_hammer, plan_strike
from affordance.control.strike import Strike
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.blow import read_nail_record
from affordance.simulation.diagram import TrialDiagram
from affordance.simulation.trial import TrialRunner

HEADER = [
    "integrator",
    "accuracy",
    "largest step (us)",
    "grip",
    "blows",
    "peak force (N)",
    "difference from reference (%)",
    "contact peak (N)",
    "impulse (N s)",
    "travel (mm)",
    "largest number of steps",
    "median time (s)",
]
# Displacements of the nail from its believed position, along the blow, [m].
SHIFTS = np.linspace(-1e-3, 1e-3, 12)
REFERENCE = dataclasses.replace(
    DEFAULT_SETTINGS,
    integrator=dataclasses.replace(
        DEFAULT_SETTINGS.integrator, contact_scheme="implicit_euler", contact_accuracy=1e-6, contact_max_step=1e-5
    ),
)
# Fraction of the nail's travel up to which the impulse is counted; afterwards only the tool's weight rests on the
# nail.
_WHOLE_WAY = 0.999


class Start(NamedTuple):
    """Closed loop shortly before its strike."""

    tool: Tool  # tool as it is held
    strike: Strike  # task, with the true position of the nail
    trial: TrialDiagram  # diagram of the trial
    context: Context  # Context of the Diagram shortly before the strike


class Blow(NamedTuple):
    """Measures of a blow."""

    peak: float  # peak of the resistance, [N]
    contact: float  # peak of the tool's force on the nail along its axis, [N]
    impulse: float  # impulse of the resistance until the nail has been driven in, [N s]
    travel: float  # travel of the nail, [m]
    steps: int  # number of the integrator's steps
    seconds: float  # wall time, [s]


def prepare_starts() -> dict[str, list[Start]]:
    """Simulates the swings by either grip of the stick at displaced nails; returns the starts by grip."""
    stick = load_tools(MODELS / "tools" / "novel.yaml")[0]
    memory = MaterialMemory.from_densities(list_densities([stick]))
    hammer, model, runner = load_hammer(MODELS / "nail.yaml"), ArmModel(load_arm()), TrialRunner(DEFAULT_SETTINGS)
    grips = {}
    for grip, tool in stick.list_gripped().items():
        costs = hammer.build_cost(model, tool.components, DEFAULT_SETTINGS)
        planned = plan_strike(costs, hammer, model, tool.parameters, DEFAULT_SETTINGS)
        starts = []
        for shift in SHIFTS:
            placement = planned.placement
            placement = placement._replace(p_WNo=placement.p_WNo + shift * placement.direction_W)
            strike = Strike(planned.swing, placement, DEFAULT_SETTINGS.control_period)
            trial = runner.get_diagram(strike.compute_duration(DEFAULT_SETTINGS.mpc.horizon), tool, placement)
            simulator = runner.prepare(trial, tool, strike, memory, (0,))
            simulator.AdvanceTo(strike.contact[0])
            starts.append(Start(tool, strike, trial, simulator.get_context().Clone()))
        grips[grip] = starts
    return grips


def strike_nail(start: Start, settings: Settings) -> Blow:
    """Continues from a start with the integrator that the settings prescribe where contact is possible."""
    context, config = start.context.Clone(), settings.integrator.contact
    touch, leave = start.strike.contact
    simulator = Simulator(start.trial.diagram, context)
    config.start_time = touch
    ApplySimulatorConfig(config, simulator)
    begun = time.perf_counter()
    simulator.AdvanceTo(leave)
    seconds = time.perf_counter() - begun
    record = read_nail_record(start.trial, context, start.strike.placement)
    since = record.times >= touch
    times, travel, resistance = record.times[since], record.travel[since], record.resistance[since]
    driven = 1 + int(np.argmax(travel >= _WHOLE_WAY * travel.max()))
    impulse = float(np.trapezoid(resistance[:driven], times[:driven]))
    steps = len(np.unique(times)) - 1
    return Blow(resistance.max(), record.contact[since].max(), impulse, float(travel[-1]), steps, seconds)


def format_blows(settings: Settings, grip: str, blows: Sequence[Blow], reference: float) -> list[str]:
    """Formats a row of the table; ``reference`` is the peak of the resistance in the reference, [N]."""
    peaks, contacts, impulses, travels, steps, seconds = np.array(blows).T
    return [
        settings.integrator.contact_scheme,
        f"{settings.integrator.contact_accuracy:.0e}",
        f"{1e6 * settings.integrator.contact_max_step:.0f}",
        grip,
        str(len(blows)),
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


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Compares the chosen integrator with the reference; returns the rows of a table, and the time per blow."""
    rows, seconds = [], []
    for grip, starts in prepare_starts().items():
        exact = strike_nail(starts[0], REFERENCE)  # one start is enough: another integrator gave the same from all
        blows = [strike_nail(start, DEFAULT_SETTINGS) for start in starts]
        rows.append(format_blows(REFERENCE, grip, [exact], exact.peak))
        rows.append(format_blows(DEFAULT_SETTINGS, grip, blows, exact.peak))
        seconds += [blow.seconds for blow in blows]
    return rows, {"strike_wall_s": float(np.median(seconds))}
