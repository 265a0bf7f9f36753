"""Compares inner simulation with brute force: the same decisions from a matrix product and from moving the arm.

A decision is the choice of the novel object's grip with which a task takes less work, under one sampled density. The
task is to move the free end along the path of Simulation III, or to drive the nail of Simulation IV. Inner simulation
plans the motions of each grip once, and then decides for ten thousand densities at a time. Brute force simulates both
grips in Drake under each density, with contact. Half of the densities are drawn from the prior and half from an
observer's belief after one trial, so that they include near ties.
"""

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.motion_cost import NUM_NODES, Costs, MotionCost
from affordance.choice.picking import NO_OPTION, Chosen, pick_cheapest
from affordance.choice.reach import Reach
from affordance.exceptions import AffordanceError
from affordance.experiments import experience, hammer, reach
from affordance.experiments.observers import Setup
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, list_colours
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.simulation.blow import FORCE_TOLERANCE, simulate_blow
from affordance.simulation.rollout import roll_out
from studies.speed.timing import time_by_turns

HEADER = ["what", "reach", "hammer"]
NUM_ROLLOUTS = 100
NUM_FAST = 10_000
# Relative difference between the works of both grips below which a decision counts as a near tie.
NEAR_TIE = 0.03
LABELS = (
    "same choice",
    f"same choice where works differ by more than {100 * NEAR_TIE:.0f} %",
    "no option feasible: inner simulation, brute force",
    "work, largest difference",
    "work, median difference",
    "time of a decision by brute force",
    "time of a decision by inner simulation, with the draw of its density",
    "time to plan both grips, once",
    "10,000 decisions with planning, times as fast as brute force",
    f"largest error of the quadrature with {NUM_NODES} nodes, compared with every control period",
)


class Comparison(NamedTuple):
    """Costs of one tool by inner and by full simulation, for S densities and G grips."""

    inner: Costs  # costs by inner simulation, (G, S) each
    full: Costs  # costs by full simulation, (G, S) each; effort is not simulated

    @property
    def differences(self) -> Array:
        """Relative differences of the work where both simulations find the task feasible, (N,)."""
        both = self.inner.feasible & self.full.feasible
        return np.abs(self.full.work[both] / self.inner.work[both] - 1.0)

    def choose(self) -> tuple[Chosen, Chosen]:
        """Returns the choices by inner and by full simulation, (S,) each."""
        one, other = (pick_cheapest(costs, np.random.default_rng(0)) for costs in (self.inner, self.full))
        return one, other


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Makes the same decisions in both ways; returns the rows of a table, and the ratio of decisions per second."""
    setup = Setup()
    held, (tool, *_), task = reach.read(setup)
    _, _, nail = hammer.read(setup)
    for_reach, choice, ratio = compare(tool, task, held, setup)
    for_hammer, _, ratio_of_blows = compare(tool, nail, held, setup)
    for_reach.append(f"{100 * measure_quadrature(choice, task, held):.3f} %")
    rows = [list(row) for row in zip(LABELS, for_reach, [*for_hammer, ""], strict=True)]
    return rows, {"decisions_vs_rollouts": ratio, "decisions_vs_blows": ratio_of_blows}


def compare(tool: Tool, task: Reach | Hammer, held: Sequence[Tool], setup: Setup) -> tuple[list[str], Choice, float]:
    """Makes decisions in both ways; half of the densities are drawn from an observer's belief after one hold.

    Returns:
        A column of the table, the choice, and the ratio of decisions per second, with planning included.
    """
    start = time.perf_counter()
    choice = plan_choice(list_options(tool), task, setup.settings)
    planning = time.perf_counter() - start
    _, (before, after, *_), _ = experience.hold(setup, held, 0)
    rng, deviation = np.random.default_rng(0), setup.settings.prior.deviation
    rho = np.vstack(
        [
            memory.belief.add_object_variation(deviation).draw_samples(rng, NUM_ROLLOUTS // 2)
            for memory in (before, after)
        ]
    )
    planned = choice.compute_costs(choice.compute_parameters(before, rho))
    start = time.perf_counter()
    compared = Comparison(planned, simulate_all(tool, task, choice, list_colours(held), rho))
    brute_seconds = (time.perf_counter() - start) / NUM_ROLLOUTS
    fast, brute = compared.choose()
    difference = compared.differences
    clear = (np.abs(np.log(planned.work[0] / planned.work[1])) > NEAR_TIE) | ~planned.feasible.all(axis=0)

    def decide() -> None:
        generator = np.random.default_rng(1)
        pick_cheapest(choice.compute_costs(choice.draw_parameters(before, generator, NUM_FAST)), generator)

    fast_seconds = time_by_turns({"fast": decide}, turns=7, calls_per_turn=2)["fast"] / NUM_FAST
    ratio = brute_seconds / (fast_seconds + planning / NUM_FAST)
    column = [
        f"{int((fast == brute).sum())} of {NUM_ROLLOUTS}",
        f"{int((fast == brute)[clear].sum())} of {int(clear.sum())}",
        f"{(fast == NO_OPTION).sum()}, {(brute == NO_OPTION).sum()}",
        f"{100 * difference.max():.2f} %",
        f"{100 * np.median(difference):.2f} %",
        f"{1e3 * brute_seconds:.0f} ms",
        f"{1e6 * fast_seconds:.2f} us",
        f"{1e3 * planning:.0f} ms",
        f"{ratio:.0f}",
    ]
    return column, choice, ratio


def simulate_all(tool: Tool, task: Reach | Hammer, choice: Choice, colours: Sequence[Colour], rho: Array) -> Costs:
    """Moves the arm with each grip of a tool, with contact, under given densities of its colours, (S, M), [kg/m^3].

    Returns:
        Costs, (G, S) each; effort is not simulated.
    """
    grips = list(tool.list_gripped().values())
    work, feasible = np.full((len(grips), len(rho)), np.inf), np.zeros((len(grips), len(rho)), dtype=bool)
    for k, densities in enumerate(rho):
        known = dict(zip(colours, map(float, densities), strict=True))
        for place, (held, cost) in enumerate(zip(grips, choice.cost_models, strict=True)):
            try:
                if isinstance(task, Reach):
                    rollout = roll_out(held, task, known, choice.settings)
                    work[place, k], feasible[place, k] = rollout.work, rollout.error <= task.path.tolerance
                else:
                    assert isinstance(cost, BlowCost)  # because a Hammer built it
                    blow = simulate_blow(held, task, cost, known, choice.settings)
                    work[place, k] = blow.work
                    feasible[place, k] = abs(blow.force / task.force - 1.0) <= FORCE_TOLERANCE
            except AffordanceError:
                continue
    return Costs(work, np.full_like(work, np.nan), feasible, work)


def measure_quadrature(choice: Choice, task: Reach, held: Sequence[Tool]) -> float:
    """Computes the largest relative error of work from the quadrature's nodes, under densities from the prior."""
    memory = MaterialMemory().add_colours(list_colours(held), choice.settings.prior)
    pi = choice.draw_parameters(memory, np.random.default_rng(2), NUM_ROLLOUTS)
    model = ArmModel(load_arm(choice.settings.arm))
    error = 0.0
    for option, parameters, coarse in zip(choice.options, pi, choice.compute_costs(pi).work, strict=True):
        motion = task.build_cost(model, option.gripped, choice.settings).motion
        every_tick = MotionCost(model, motion, num_nodes=len(motion.q)).compute(parameters).work
        error = max(error, float(np.abs(coarse / every_tick - 1.0).max()))
    return error
