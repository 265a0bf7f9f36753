"""The brute-force check of a planned blow: the arm strikes a nail in Drake, with a tool whose densities it knows."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import BlowCost
from affordance.control.strike import Strike
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.arm import load_arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.nail import Nail
from affordance.settings import Settings
from affordance.simulation.blow_trial import NailRecord
from affordance.simulation.rollout import measure_costs
from affordance.simulation.trial import TrialRecord, get_runner


@dataclasses.dataclass(frozen=True)
class Blow:
    """What a simulated blow did and cost.

    Attributes:
        strike: What was planned.
        record: The arm's motion, one row a tick.
        nail: What happened to the nail.
        work: Mechanical work without recovery, from rest to the strike, [J].
        work_raising: The part of it up to where the striking point is highest, [J].
        effort: Integral of |tau|^2 dt from rest to the strike, [N^2 m^2 s].
        kinetic_energy: Of arm and tool where the strike was planned, [J].
    """

    strike: Strike
    record: TrialRecord
    nail: NailRecord
    work: float
    work_raising: float
    effort: float
    kinetic_energy: float

    @property
    def force(self) -> float:
        """Peak of the nail's resistance, [N]."""
        return float(self.nail.resistance.max())

    @property
    def travel(self) -> float:
        """How far the nail was driven, [m]."""
        return float(self.nail.travel[-1])


def simulate_blow(
    tool: Tool,
    planned: BlowCost,
    densities: Mapping[Colour, float],
    settings: Settings,
    *,
    force: float | None = None,
    nail: Nail | None = None,
) -> Blow:
    """Plans and simulates a blow with a tool whose densities are known.

    Args:
        tool: The tool as it is gripped.
        planned: The blows that were planned for it.
        densities: True density of what shows a colour, [kg/m^3].
        settings: Those of all simulations; only the log is kept at every tick.
        force: Peak resistance, [N]; the one that is asked for if None.
        nail: What stands there in truth; what the blow is planned for if None.

    Raises:
        AffordanceError: No swing is fast enough.
    """
    every_tick = dataclasses.replace(settings, log_period=settings.control_period)
    tool = tool.with_densities(densities)
    strike = planned.plan(ArmModel(load_arm(settings.arm)), tool.parameters, settings, force, nail)
    runner = get_runner(every_tick)
    record, nail_record = runner.run_blow(tool, strike, MaterialMemory.from_densities(densities), seed=(0,))
    end = round(strike.time_of_strike / settings.control_period)
    work, effort = measure_costs(record, settings.control_period, end)
    trial = runner.get_diagram(tool, strike.placement)
    heights = -trial.chain.compute_positions(record.q[: end + 1], planned.target.p_TS) @ strike.placement.direction_W
    raising, _ = measure_costs(record, settings.control_period, int(np.argmax(heights)))
    trial.model.set_payload(tool.parameters)
    trial.model.set_state(np.concatenate([record.q[end], record.v[end]]))
    kinetic_energy = 0.5 * float(record.v[end] @ trial.model.compute_mass_matrix() @ record.v[end])
    return Blow(strike, record, nail_record, work, raising, effort, kinetic_energy)
