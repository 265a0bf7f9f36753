"""Simulates a blow with contact in Drake, as a check of blows that were planned with inner simulation."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig, SimulatorStatus
from pydrake.systems.framework import Context, EventStatus

from affordance.arguments import Seed
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer, plan_strike
from affordance.choice.motion_cost import measure_cost
from affordance.control.strike import Strike
from affordance.exceptions import AffordanceError, StallError, name_object
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.plant.nail import NailRecord
from affordance.settings import Settings
from affordance.simulation.trial import TrialRunner, get_runner
from affordance.simulation.trial_record import TrialRecord

# Largest relative error of the peak resistance of a successful blow. The formula for planning blows neglects losses
# in nail and contact (docs/decisions/0013-nail.md).
FORCE_TOLERANCE = 0.15
# Number of integrator steps after which a blow counts as stalled, which takes one or two minutes. A blow from rest to
# rest takes 1300 to 2430 steps (docs/decisions/0013-nail.md).
_MAX_STEPS = 200_000


@dataclasses.dataclass(frozen=True)
class Blow:
    """Simulated blow with its forces and cost."""

    strike: Strike  # planned strike
    record: TrialRecord  # record of the arm's motion, one row per control period
    nail: NailRecord  # record of the nail's motion and forces
    work: float  # absolute work of the joints, from rest to the strike, [J]
    work_raising: float  # absolute work up to the highest position of the striking point, [J]
    effort: float  # integral of |tau|^2 dt from rest to the strike, [N^2 m^2 s]
    kinetic_energy: float  # kinetic energy of arm and tool at the planned time of the strike, [J]

    @property
    def force(self) -> float:
        """Peak of the nail's resistance, [N]."""
        return float(self.nail.resistance.max())

    @property
    def travel(self) -> float:
        """Distance that the nail was driven, [m]."""
        return float(self.nail.travel[-1])

    def describe_force_error(self, force: float, arm: Arm) -> str:
        """Describes the error of the peak resistance, with possible remedies; empty within the tolerance.

        Args:
            force: Demanded peak resistance, [N].
            arm: Simulated arm.
        """
        if abs(self.force / force - 1.0) <= FORCE_TOLERANCE:
            return ""
        rotors = [arm.plant.get_joint_actuator(index) for index in arm.plant.GetJointActuatorIndices()]
        ways = []
        # With strong damping, a light wrist stops within a control period and does not yield to the nail.
        if any(rotor.joint().default_damping_vector().any() for rotor in rotors):
            ways.append("an arm without damping (import-arm --damping none)")
        if not all(rotor.default_rotor_inertia() > 0.0 for rotor in rotors):
            ways.append("the inertia of its rotors (import-arm --rotor-inertia)")
        ways = ways or ["a smaller depth_demanded", "a longer blow.duration"]
        bound = f"must agree with the demanded force to {100.0 * FORCE_TOLERANCE:.0f} %"
        return f"gives {self.force:.0f} N, {bound}; what may help: {' or '.join(ways)}"


def simulate_blow(
    tool: Tool,
    hammer: Hammer,
    planned: BlowCost,
    densities: Mapping[Colour, float],
    settings: Settings,
) -> Blow:
    """Plans and simulates a blow with a gripped tool of known densities, [kg/m^3].

    Raises:
        AffordanceError: No swing is fast enough.
    """
    every_tick = dataclasses.replace(settings, log_period=settings.control_period)
    tool = tool.with_densities(densities)
    model = ArmModel(load_arm(settings.arm))
    strike = plan_strike(planned, hammer, model, tool.parameters, settings)
    runner = get_runner(every_tick)
    memory = MaterialMemory.from_densities(densities)
    record, nail_record = run_blow(runner, tool, strike, memory, seed=(0,))
    end = round(strike.time_of_strike / settings.control_period)
    work, effort = measure_cost(record.tau[: end + 1], record.v[: end + 1], settings.control_period)
    trial = runner.get_diagram(tool, strike.placement)
    heights = -trial.chain.compute_positions(record.q[: end + 1], planned.target.p_TS) @ strike.placement.direction_W
    top = int(np.argmax(heights))
    raising, _ = measure_cost(record.tau[: top + 1], record.v[: top + 1], settings.control_period)
    trial.model.set_payload(tool.parameters)
    trial.model.set_state(np.concatenate([record.q[end], record.v[end]]))
    kinetic_energy = 0.5 * float(record.v[end] @ trial.model.compute_mass_matrix() @ record.v[end])
    return Blow(strike, record, nail_record, work, raising, effort, kinetic_energy)


def describe_blow_fault(tool: Tool, task: Hammer, planned: BlowCost, settings: Settings) -> str:
    """Describes why a planned blow with known densities fails in simulation; empty if it succeeds."""
    try:
        blow = simulate_blow(tool, task, planned, list_densities([tool]), settings)
    except AffordanceError as error:
        return str(error)
    problem = blow.describe_force_error(task.force, load_arm(settings.arm))
    return f"asked for {task.force:.0f} N, {name_object(tool.name)} by {tool.grip} {problem}" if problem else ""


def run_blow(
    runner: TrialRunner, tool: Tool, strike: Strike, memory: MaterialMemory, *, seed: Seed
) -> tuple[TrialRecord, NailRecord]:
    """Runs the trial of a blow from rest to rest. The arguments are explained in ``TrialRunner.run``.

    Raises:
        StallError: The integrator takes too many steps.
    """
    settings = runner.settings
    duration = strike.compute_duration(settings.mpc.horizon)
    trial = runner.get_diagram(tool, strike.placement)
    simulator = trial.prepare(trial.diagram.CreateDefaultContext(), tool, strike, memory, seed)
    end = trial.find_end(duration)
    monitor = BlowMonitor(trial.arm.plant, tool.name)
    simulator.set_monitor(monitor)
    touch, leave = strike.contact
    _advance(simulator, settings.integrator.free, touch)
    _advance(simulator, settings.integrator.contact, leave)
    # If the tool touches the nail again during the return, the integrator of an undamped arm stalls (0013).
    monitor.stops_at_touch = True
    if not _advance(simulator, settings.integrator.free, end):
        monitor.stops_at_touch = False
        _advance(simulator, settings.integrator.second_touch, end)
    record = trial.finish(simulator, tool, duration)
    return record, trial.read_nail_record(simulator.get_context())


class BlowMonitor:
    """Monitor that aborts a stalled simulation, and stops at any contact while ``stops_at_touch`` is True."""

    def __init__(self, plant: MultibodyPlant, tool_name: str) -> None:
        """Stores the plant, and the name of the tool for messages."""
        self.stops_at_touch = False
        self._plant = plant
        self._tool_name = tool_name
        self._num_steps = 0

    def __call__(self, context: Context) -> EventStatus:
        """Counts an integrator step. Too many steps raise a StallError."""
        self._num_steps += 1
        if self._num_steps > _MAX_STEPS:
            raise StallError(self._tool_name, context.get_time(), _MAX_STEPS, self._list_touches(context))
        if self.stops_at_touch and self._get_contacts(context).num_point_pair_contacts():
            return EventStatus.ReachedTermination(self._plant, "touch")
        return EventStatus.DidNothing()

    def _get_contacts(self, context: Context) -> Any:
        return self._plant.get_contact_results_output_port().Eval(self._plant.GetMyContextFromRoot(context))

    def _list_touches(self, context: Context) -> tuple[tuple[str, str], ...]:
        """Lists the names of each pair of bodies in contact."""
        contacts, get_body = self._get_contacts(context), self._plant.get_body
        pairs = [contacts.point_pair_contact_info(k) for k in range(contacts.num_point_pair_contacts())]
        return tuple((get_body(pair.bodyA_index()).name(), get_body(pair.bodyB_index()).name()) for pair in pairs)


def _advance(simulator: Simulator, config: SimulatorConfig, end: float) -> bool:
    """Sets the integrator, and simulates until a time, [s]. Returns False if the monitor stops the simulation."""
    config.start_time = simulator.get_context().get_time()  # otherwise the time would be reset
    ApplySimulatorConfig(config, simulator)
    return bool(simulator.AdvanceTo(end).reason() == SimulatorStatus.ReturnReason.kReachedBoundaryTime)
