"""Simulation IV (paper, IV-D): choosing a grip for driving a nail with a demanded peak force with least work."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from affordance.choice.blow_cost import AIM, BlowCost
from affordance.choice.hammer import Hammer, find_swing, sample_swing
from affordance.choice.inner_simulation import Choice
from affordance.choice.motion_cost import MotionCost
from affordance.exceptions import BadValueError, name_object
from affordance.experiments.blows import (
    OF_BLOWS,
    count_light_ends,
    draw_start_and_strike,
    label_blows,
    measure_blows,
    measure_demand,
    write_slow_replay,
)
from affordance.experiments.definition import Outputs
from affordance.experiments.shared.choice_task import ChoicePlan, ChoiceTask
from affordance.experiments.shared.decisions import find_grip_of_densest, remove_errors
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.files.netcdf import Trajectories
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.effective_mass import EffectiveMass
from affordance.plant.load import load_arm
from affordance.reporting.figures import draw_blow
from affordance.settings import Settings
from affordance.simulation.blow import Blow, simulate_blow
from affordance.simulation.diagram import TrialDiagram
from affordance.simulation.trial import get_runner

# The posture at the strike, and with it the mass, hardly depends on the speed: the second swing is within a hundredth
# of the speed of the first, and a third within a tenth of that.
_NUM_SWINGS = 3


def list_blow_costs(choice: Choice) -> dict[str, BlowCost]:
    """Lists the blows that were planned for a choice, by grip."""
    found = {}
    for option, cost in zip(choice.options, choice.cost_models, strict=True):
        assert isinstance(cost, BlowCost)  # as built by a Hammer
        found[option.grip] = cost
    return found


@dataclass(frozen=True)
class Hammering(ChoiceTask):
    """Choice of a grip for a blow, whose contact is simulated.

    Attributes:
        task: Task of the blow.
    """

    task: Hammer

    name = "hammer"
    simulations = "blows"
    key = "blow"
    failure = "cannot be carried out"
    figure = ("figure10", "Choosing a grip for hammering")
    plans_truth = True
    names = (
        *OF_BLOWS,
        *("force_ratios", "force_demanded_N", "tip_speed", "energy_planned", "energy_at_equal_tip_speed"),
        *("tip_energy", "tip_energy_from_surface", "p_light_end_held", "grip_of_densest_far"),
    )
    names_of_second_tool = tuple(f"{name}_headed_tool" for name in OF_BLOWS)

    def check(self, tools: Sequence[Tool], path: Path, costs: Mapping[str, Mapping[str, BlowCost]]) -> None:
        """Checks that the nail can be driven deep enough with every tool and grip."""
        held = {(tool.name, grip): each for tool in tools for grip, each in tool.list_gripped().items()}
        for (name, grip), gripped in held.items():
            if reason := costs[name][grip].explain_infeasibility(gripped.parameters):
                asked = f"is {self.task.nail.depth_demanded:g} m and asks for {self.task.force:.0f} N"
                depth = min(costs[one][by].find_greatest_depth(each.parameters) for (one, by), each in held.items())
                floor = math.floor(1e4 * depth) / 1e4
                bound = f"must be at most {floor:g} m"
                if floor <= self.task.nail.depth_set:
                    bound = "no depth is within the joints' limits"
                problem = f"{asked}, for which with {name_object(name)} by {grip} {reason}; {bound}"
                raise BadValueError(path, "depth_demanded", problem)

    def simulate(self, held: Tool, cost: BlowCost, densities: Mapping[Colour, float], settings: Settings) -> Blow:
        """Simulates a blow, contact included."""
        return simulate_blow(held, self.task, cost, densities, settings)

    def describe_error(self, simulated: Blow, tool: str, grip: str, settings: Settings) -> str:
        """Describes by how much the force differs from the demanded one."""
        problem = simulated.describe_force_error(self.task.force, load_arm(settings.arm))
        return problem and f"asks for {self.task.force:.0f} N, {tool} by {grip} {problem}"

    def explain(self, option: str, reason: str) -> str:
        """Explains why no blow can be carried out with an option, for a reason that is a noun phrase."""
        return f"{option}: {reason}"

    def compute_work(self, settings: Settings, costs: Mapping[str, Mapping[str, BlowCost]], held: Tool) -> float:
        """Plans the demanded blow with a gripped tool, from the one for its name and grip; returns its work, [J]."""
        model = ArmModel(load_arm(settings.arm))
        target = self.task.find_target(model, held.components)
        planned, pi = costs[held.name][held.grip], held.parameters[None]
        speed = float(planned.find_speed(pi)[0])
        swing = planned.pick_swing(speed)
        for _ in range(_NUM_SWINGS):
            swing = find_swing(model, target, self.task, speed, swing)
            (mass,) = EffectiveMass(model, target.p_TS, target.direction_W, swing.q_end).compute(pi)
            speed = float(self.task.nail.compute_tip_speed(np.array(AIM * self.task.force), mass))
        assert swing is not None  # there is at least one
        motion = sample_swing(swing, settings.control_period)
        return float(MotionCost(model, motion).compute(pi).work[0])

    def measure(self, novel: Sequence[Tool], config: ExperienceConfig, plan: ChoicePlan) -> dict[str, Any]:
        """Computes cost and outcome of the blows."""
        first, *others = novel
        costs = plan.costs[first.name]
        exact = remove_errors(config.settings)
        return {
            "force_ratios": [
                blow.force / self.task.force for blows in plan.simulated.values() for blow in blows.values()
            ],
            **measure_blows(plan.simulated[first.name]),
            **(measure_blows(plan.simulated[others[0].name], "_headed_tool") if others else {}),
            **measure_demand(self.task, first, costs),
            "p_light_end_held": count_light_ends(first, costs, config, exact),
        }

    def list_facts(self, tool: Tool) -> dict[str, Any]:
        """Returns the grip with the densest material farthest from the hand."""
        return {"grip_of_densest_far": find_grip_of_densest(tool, at_hand=False)}

    def get_trial(self, settings: Settings, held: Tool, simulated: Blow) -> TrialDiagram:
        """Returns the Diagram of a blow."""
        duration = simulated.strike.compute_duration(settings.mpc.horizon)
        return get_runner(settings).get_diagram(duration, held, simulated.strike.placement)

    def show(self, novel: Sequence[Tool], arm: Path, plan: ChoicePlan, numbers: Mapping[str, Any]) -> Outputs:
        """Returns figure 9, the blow, and the replay."""
        first = novel[0]
        blows = plan.simulated[first.name]
        records = {f"held by {grip}": blow.nail for grip, blow in blows.items()}
        return Outputs(
            figures={
                "figure9": partial(draw_start_and_strike, arm, first, blows),
                "blow": partial(draw_blow, records, force_demanded=self.task.force),
            },
            trajectories=Trajectories(label_blows(list(blows.values())), {}),
            replay=lambda path: write_slow_replay(path, arm, first, blows),
        )
