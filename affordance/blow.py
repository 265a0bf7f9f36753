"""The brute-force check of a planned blow: the arm strikes a nail in Drake, with a tool whose densities it knows."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from affordance.arm import ArmModel, load_arm
from affordance.memory import MaterialMemory
from affordance.nail import Nail
from affordance.rollout import measure_costs
from affordance.settings import Settings
from affordance.tasks.hammer import BlowEnergies
from affordance.tasks.strike import Strike
from affordance.tools import Colour, Tool
from affordance.trial import NailRecord, TrialRecord, get_runner

Array = NDArray[np.float64]


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


def deal_blow(
    tool: Tool,
    energies: BlowEnergies,
    densities: Mapping[Colour, float],
    settings: Settings,
    *,
    force: float | None = None,
    nail: Nail | None = None,
) -> Blow:
    """Plans and simulates a blow with a tool whose densities are known.

    Args:
        tool: The tool as it is gripped.
        energies: The blows that were planned for it.
        densities: True density of what shows a colour, [kg/m^3].
        settings: Those of all simulations; only the log is kept at every tick.
        force: Peak resistance, [N]; the one that is asked for if None.
        nail: What stands there in truth; what the blow is planned for if None.

    Raises:
        AffordanceError: No swing is fast enough.
    """
    every_tick = dataclasses.replace(settings, log_period=settings.tick)
    tool = tool.make_of(densities)
    strike = energies.plan(ArmModel(load_arm(settings.arm)), tool.parameters, settings, force, nail)
    runner = get_runner(every_tick)
    record, nail_record = runner.run_blow(tool, strike, MaterialMemory.know(densities), seed=(0,))
    end = round(strike.time_of_strike / settings.tick)
    work, effort = measure_costs(record, settings.tick, end)
    trial = runner.get_diagram(tool, strike.placement)
    heights = -trial.chain.compute_positions(record.q[: end + 1], energies.target.p_TS) @ strike.placement.direction_W
    raising, _ = measure_costs(record, settings.tick, int(np.argmax(heights)))
    trial.model.set_payload(tool.parameters)
    trial.model.set_state(np.concatenate([record.q[end], record.v[end]]))
    kinetic_energy = 0.5 * float(record.v[end] @ trial.model.compute_mass_matrix() @ record.v[end])
    return Blow(strike, record, nail_record, work, raising, effort, kinetic_energy)
