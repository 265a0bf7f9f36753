"""Blows with real tools in contact simulation: compares planned and simulated peak force and work."""

from collections.abc import Sequence
from typing import NamedTuple

from affordance.choice.blow_cost import AIM
from affordance.choice.hammer import Hammer
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import Settings
from affordance.simulation.blow import Blow, simulate_blow
from affordance.vision.eye import measure_drawing


class CheckedBlow(NamedTuple):
    """Planned and simulated blow at true densities."""

    tool: str  # name of the tool
    grip: str  # name of the grip
    force_aimed: float  # planned peak of the nail's resistance, [N]
    force: float  # simulated peak of the nail's resistance, [N]
    work_planned: float  # planned work, [J]
    work: float  # simulated work, [J]
    travel: float  # travel of the nail, [m]
    held: Tool  # tool in that grip
    blow: Blow  # simulated motion


def check_blows(tools: Sequence[Tool], grips: Sequence[str], task: Hammer, settings: Settings) -> list[CheckedBlow]:
    """Simulates a blow with each tool in one of its grips.

    Raises:
        AffordanceError: No swing is fast enough, or a simulation stalls.
    """
    checked = []
    for tool, name in zip(tools, grips, strict=True):
        held = tool.list_gripped()[name]
        planned = task.build_cost(ArmModel(load_arm(settings.arm)), measure_drawing(held), settings)
        blow = simulate_blow(held, task, planned, list_densities([held]), settings)
        work = float(planned.compute(held.parameters[None]).work[0])
        aimed = AIM * task.force
        checked.append(CheckedBlow(tool.name, name, aimed, blow.force, work, blow.work, blow.travel, held, blow))
    return checked
