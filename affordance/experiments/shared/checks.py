"""Checks that every experiment makes before it writes anything."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from affordance.control.start_posture import Start
from affordance.exceptions import BadArgumentError, BadValueError, InfeasibleError, ModelFileError
from affordance.objects.tool import Tool
from affordance.plant.arm import Arm
from affordance.plant.load import load_arm, parse_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.protocols.protocol import Protocol
from affordance.settings import Settings
from affordance.simulation.trial import check_duration


def check_stuck_joint(settings: Settings) -> None:
    """Raises a BadValueError for a stuck joint that the arm does not have."""
    if settings.faults.stuck_joint:
        settings.faults.find_stuck(load_arm(settings.arm).joint_names)


def check_durations(protocol: Protocol, path: Path, settings: Settings) -> None:
    """Raises a BadValueError for a presentation that ends before the first sample: nothing would be measured."""
    for index, block in enumerate(protocol.blocks):
        if block.do.duration:
            try:
                check_duration(block.do.duration, settings)
            except BadArgumentError as error:
                raise BadValueError(path, f"blocks[{index}].do.duration", error.problem) from error


def check_tools_can_be_held(path: Path, tools: Sequence[Tool], settings: Settings, start: Start = ()) -> None:
    """Checks the static torque of every joint, in the start posture of a task or at home, against its limit.

    A tool that is too heavy for a joint raises an InfeasibleError, an arm that cannot be loaded or cannot hold itself
    a ModelFileError, and a posture out of its reach an AffordanceError.
    """
    arm = load_arm(settings.arm)
    _load_shapes(arm, settings.arm)
    hold = StaticHold(arm, arm.find_posture(dict(start)))
    posture = "start" if start else "home"
    for tool in tools:
        # Otherwise the arm's own weight, in wrong units perhaps, would be blamed on the tool.
        for joint, torque, bound in arm.find_overloads(hold.tau_arm):
            problem = f"loads {joint} with {torque:.3g} N m in the {posture} posture with an empty hand"
            raise ModelFileError(settings.arm, f"{problem}, must be at most {bound:.3g} N m")
        overloads = arm.find_overloads(hold.tau_arm + hold.Y @ tool.parameters)
        if overloads:
            joint, torque, bound = max(overloads, key=lambda each: each.torque / each.bound)
            problem = f"weighs {tool.mass:.3g} kg and loads {joint} with {torque:.3g} N m in the {posture} posture"
            raise InfeasibleError(path, f"tools: {tool.name}", f"{problem}, must be at most {bound:.3g} N m")


@lru_cache(maxsize=16)
def _load_shapes(arm: Arm, directives: Path) -> None:
    """Loads an arm's shapes too, once per version of its files; else their ModelFileError appears in replays only."""
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    parse_arm(plant, directives)
