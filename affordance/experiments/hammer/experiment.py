"""Simulation IV (paper, IV-D): choosing a grip for driving a nail with a demanded peak force with least work."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer
from affordance.experiments.definition import Outputs
from affordance.experiments.hammer.drawings import (
    draw_start_and_strike,
    label_blows,
    write_slow_replay,
)
from affordance.experiments.hammer.measures import (
    OF_BLOWS,
    count_light_ends,
    measure_blows,
    measure_demand,
)
from affordance.experiments.hammer.plan import check_feasible, compute_blow_work
from affordance.experiments.shared.choice_task import ChoicePlan, ChoiceTask
from affordance.experiments.shared.correct_grip import find_grip_of_densest, remove_errors
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.files.netcdf import Trajectories
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.reporting.blow_figures import draw_blow
from affordance.settings import Settings
from affordance.simulation.blow import Blow, simulate_blow
from affordance.simulation.diagram import TrialDiagram
from affordance.simulation.trial import get_runner


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
        check_feasible(path, tools, self.task, costs)

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
        """Plans the demanded blow with a gripped tool, and returns its work, [J]."""
        return compute_blow_work(self.task, settings, costs, held)

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
