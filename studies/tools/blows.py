"""Blows with real tools in contact simulation: planned and simulated peak force and work."""

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
    """Planned and simulated blow, at true densities.

    Attributes:
        tool: Name of the tool.
        grip: Name of the grip.
        force_aimed: Planned peak of the nail's resistance, [N].
        force: Simulated peak of the nail's resistance, [N].
        work_planned: Planned work, [J].
        work: Simulated work, [J].
        travel: Travel of the nail, [m].
        held: Tool in that grip.
        blow: Simulated motion.
    """

    tool: str
    grip: str
    force_aimed: float
    force: float
    work_planned: float
    work: float
    travel: float
    held: Tool
    blow: Blow


def check_blows(tools: Sequence[Tool], grips: Sequence[str], task: Hammer, settings: Settings) -> list[CheckedBlow]:
    """Simulates a blow with each tool in one of its grips.

    Raises:
        AffordanceError: No swing is fast enough, or a simulation stalls.
    """
    checked = []
    for tool, name in zip(tools, grips, strict=True):
        held = hold_by(tool, name)
        planned = task.build_cost(ArmModel(load_arm(settings.arm)), measure_drawing(held), settings)
        blow = simulate_blow(held, task, planned, list_densities([held]), settings)
        work = float(planned.compute(held.parameters[None]).work[0])
        aimed = AIM * task.force
        checked.append(CheckedBlow(tool.name, name, aimed, blow.force, work, blow.work, blow.travel, held, blow))
    return checked


def hold_by(tool: Tool, name: str) -> Tool:
    """Returns the tool in the grip with the given name."""
    return tool.gripped_by(next(grip for grip in tool.grips if grip.name == name))
