"""Simulation IV (paper, IV-D): choosing a grip for driving a nail with a demanded peak force with least work."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.blow_cost import AIM, BlowCost
from affordance.choice.hammer import Hammer, find_swing, sample_swing
from affordance.choice.inner_simulation import Choice
from affordance.choice.listed_options import list_options
from affordance.choice.motion_cost import MotionCost
from affordance.choice.picking import NO_OPTION, Chosen, pick_cheapest
from affordance.exceptions import BadValueError, name_object
from affordance.experiments.definition import Outputs
from affordance.experiments.shared.choice_task import ChoicePlan, ChoiceTask
from affordance.experiments.shared.decisions import NUM_PRIOR_CHOICES, find_grip_of_densest, remove_errors
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.files.netcdf import LabelledArray, Trajectories
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.effective_mass import EffectiveMass
from affordance.plant.load import load_arm
from affordance.reporting.blow_figures import draw_blow, draw_renderings
from affordance.reporting.renderings import Pose, render_close_ups, render_poses
from affordance.reporting.replay import Scene, write_replay
from affordance.runs.random_streams import Stream
from affordance.settings import Settings
from affordance.simulation.blow import Blow, simulate_blow
from affordance.simulation.diagram import TrialDiagram
from affordance.simulation.trial import get_runner
from affordance.vision.features import ComponentFeatures

# The posture at the strike, and with it the mass, hardly depends on the speed: the second swing is within a hundredth
# of the speed of the first, and a third within a tenth of that.
_NUM_SWINGS = 3
# Time span saved around the first touch, and its step: driving takes 5 ms, or longer with a heavier arm, [s].
_KEPT_FROM, _KEPT_TO, _KEPT_STEP = -0.002, 0.012, 2e-5
# Factor of slow motion, and its span before and after the strike: driving takes 5 ms, [s].
_SLOWER, _SLOW_BEFORE, _SLOW_AFTER = 80.0, 0.01, 0.03

_MEASURES: Mapping[str, Callable[[Blow], float]] = {
    "energy_true": lambda blow: blow.work,
    "energy_raising_true": lambda blow: blow.work_raising,
    "energy_without_raising_true": lambda blow: blow.work - blow.work_raising,
    "kinetic_energy_true": lambda blow: blow.kinetic_energy,
    "effort_true": lambda blow: blow.effort,
    "force_measured_N": lambda blow: blow.force,
    "contact_peak_N": lambda blow: float(blow.nail.contact.max()),
    "travel_m": lambda blow: blow.travel,
    "periods_limited": lambda blow: blow.record.counts.limited,
}
# Names of the numbers of blows.
OF_BLOWS = tuple(_MEASURES)


@dataclass(frozen=True)
class Hammering(ChoiceTask):
    """Choice of a grip for a blow, whose contact is simulated."""

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
        """Describes the difference of the force from the demanded one."""
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


def measure_blows(blows: Mapping[str, Blow], suffix: str = "") -> dict[str, Any]:
    """Computes cost and outcome of blows, by grip."""
    return {
        name + suffix: {grip: measure(blow) for grip, blow in blows.items()} for name, measure in _MEASURES.items()
    }


def measure_demand(task: Hammer, tool: Tool, costs: Mapping[str, BlowCost]) -> dict[str, Any]:
    """Computes speed and energy of a tool's tip at the demanded force."""
    nail = task.nail
    pi = {grip: gripped.parameters[None] for grip, gripped in tool.list_gripped().items()}
    speeds = {grip: costs[grip].find_speed(pi[grip]) for grip in pi}
    slower = min(speeds.values())
    at_equal_speed = {grip: float(costs[grip].compute_at_speed(pi[grip], slower).work[0]) for grip in pi}
    return {
        "force_demanded_N": task.force,
        "tip_speed": {grip: float(speed[0]) for grip, speed in speeds.items()},
        "energy_planned": {grip: float(costs[grip].compute(pi[grip]).work[0]) for grip in pi},
        "energy_at_equal_tip_speed": at_equal_speed,
        # Energy to drive the nail from its set depth, and from the surface of the wood.
        "tip_energy": (task.force**2 - (nail.stiffness * nail.depth_set) ** 2) / (2.0 * nail.stiffness),
        "tip_energy_from_surface": task.force**2 / (2.0 * nail.stiffness),
    }


def count_light_ends(
    tool: Tool, costs: Mapping[str, BlowCost], experience: ExperienceConfig, settings: Settings
) -> float | None:
    """Computes the fraction of choices, under densities from the prior, that grip the less dense end.

    The true features are used, however features are observed, as the number characterises the task.
    """
    choice = Choice(list_options(tool, seed=experience.seed), list(costs.values()), settings)
    memory = MaterialMemory().add_colours(experience.colours, settings.prior)
    rng = np.random.default_rng([experience.seed, Stream.LIGHT_ENDS])
    rho = memory.belief.add_object_variation(settings.prior.deviation_sd).draw_samples(rng, NUM_PRIOR_CHOICES)
    chosen = pick_cheapest(choice.compute_costs(choice.compute_parameters(memory, rho)), rng)
    near, far = np.array([_order_colours(option.gripped, memory) for option in choice.options]).T
    return compute_share_of_light_ends(chosen, rho=rho, near=near, far=far)


def compute_share_of_light_ends(
    chosen: Chosen, *, rho: Array, near: NDArray[np.intp], far: NDArray[np.intp]
) -> float | None:
    """Computes the fraction of choices that put the less dense end into the hand; None if no choice was made.

    Chosen, (S,), are indices of options or NO_OPTION, under densities rho, (S, M), [kg/m^3]; near and far are the
    indices of the density nearest to the hand and farthest from it, by option.
    """
    decided = np.flatnonzero(chosen != NO_OPTION)
    if not len(decided):
        return None
    option = chosen[decided]
    return float((rho[decided, near[option]] < rho[decided, far[option]]).mean())


def _order_colours(parts: Sequence[ComponentFeatures], memory: MaterialMemory) -> tuple[int, int]:
    """Returns the indices of the materials nearest to and farthest from the hand."""
    ordered = sorted(parts, key=lambda part: float(np.linalg.norm(part.X_TE[:3, 3])))
    near, far = (memory.colours.index(part.colour) for part in (ordered[0], ordered[-1]))
    return near, far


def draw_start_and_strike(arm: Path, tool: Tool, blows: Mapping[str, Blow]) -> Figure:
    """Draws figure 9, rendered: the start and the strike with each grip of a tool, and the nail."""
    held = tool.list_gripped()
    poses, close = [], []
    for grip, blow in blows.items():
        row = int(np.argmin(np.abs(blow.record.times - blow.nail.time_of_touch)))
        start = Pose(held[grip], blow.strike.placement, blow.record.q[0])
        strike = start._replace(
            q=blow.record.q[row], travel=float(np.interp(blow.record.times[row], blow.nail.times, blow.nail.travel))
        )
        poses += [start, strike]
        close.append(strike)
    images = render_poses(arm, poses, width=1000, height=380)
    close_ups = render_close_ups(arm, close, width=400, height=380)
    rows = {f"held by {grip}": [*images[2 * i : 2 * i + 2], close_ups[i]] for i, grip in enumerate(blows)}
    return draw_renderings(rows, titles=["start", "strike", "the nail at the strike"])


def label_blows(blows: Sequence[Blow]) -> dict[str, LabelledArray]:
    """Labels the motion of the nail."""
    longest = max(blow.nail.time_of_rest - blow.nail.time_of_touch for blow in blows)
    times = np.arange(_KEPT_FROM, max(_KEPT_TO, longest - _KEPT_FROM), _KEPT_STEP)
    nails = {
        name: LabelledArray(
            ("trial", "time_since_touch"),
            np.stack([np.interp(times, b.nail.times - b.nail.time_of_touch, getattr(b.nail, name)) for b in blows]),
            unit,
            meaning,
        )
        for name, unit, meaning in (
            ("resistance", "N", "resistance of the nail"),
            ("contact", "N", "force of the tool on the nail"),
            ("travel", "m", "how far the nail was driven"),
        )
    }
    return {
        **nails,
        "time_since_touch": LabelledArray(("time_since_touch",), times, "s", "time since the tool touched the nail"),
    }


def write_slow_replay(path: Path, arm: Path, tool: Tool, blows: Mapping[str, Blow]) -> None:
    """Writes the blow with each grip of a tool, in slow motion around the strike."""
    held = tool.list_gripped()
    scenes = []
    for grip, blow in blows.items():
        strike, times = blow.strike.time_of_strike, blow.record.times
        scenes.append(
            Scene(
                held[grip],
                times,
                blow.record.q,
                f"held by {grip}: absolute work {blow.work:.1f} J, {blow.force:.0f} N",
                placement=blow.strike.placement,
                travel=np.interp(times, blow.nail.times, blow.nail.travel),
                slow=(strike - _SLOW_BEFORE, strike + _SLOW_AFTER, _SLOWER),
            )
        )
    write_replay(path, arm, scenes, title=f"Simulation IV: {tool.name}")
