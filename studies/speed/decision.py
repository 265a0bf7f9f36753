"""Inner simulation against brute force: the same decisions by a matrix product and by moving the arm in Drake.

A decision is the choice of the grip of the novel object with which a task takes less work, under one sampled density:
moving its free end along the path of Simulation III, or driving the nail of Simulation IV. Inner simulation plans the
motions of each grip once and then decides for ten thousand densities at a time; brute force simulates both grips
under each density, with contact. Half of the densities are drawn from the prior, half from an observer's belief after
one trial, so that near ties are among them.
"""

import time
from collections.abc import Callable, Mapping

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.motion_cost import NUM_NODES, MotionCost
from affordance.choice.observed_options import list_options
from affordance.choice.ranking import NO_OPTION, pick_cheapest
from affordance.choice.reach import Reach
from affordance.exceptions import AffordanceError
from affordance.experiments.hammer import Hammering, list_blow_costs
from affordance.experiments.protocol_runs import load_choice_experiment
from affordance.experiments.reach import Reaching
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.experiments.shared.gain_experience import gain_experience
from affordance.objects.colour import Colour
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.simulation.blow import FORCE_TOLERANCE, simulate_blow
from affordance.simulation.rollout import roll_out
from studies.speed.timing import time_by_turns

# Function that simulates one grip, by its index, under densities by colour: its work, [J], and whether it succeeded.
Simulate = Callable[[int, Mapping[Colour, float]], tuple[float, bool]]

HEADER = ["what", "reach", "hammer"]
NUM_ROLLOUTS = 100
NUM_FAST = 10_000
# Relative difference of both grips' works below which a decision counts as a near tie.
NEAR_TIE = 0.03


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Decides both ways for the same densities; returns rows of a table, and the ratio of decisions per second."""
    reaching, hammering = (load_choice_experiment(name) for name in ("reach", "hammer"))
    assert isinstance(reaching.adapter, Reaching)
    assert isinstance(hammering.adapter, Hammering)
    reach, hammer = reaching.adapter.task, hammering.adapter.task
    settings, tool = reaching.settings, reaching.novel[0]

    def follow_path(grip: int, densities: Mapping[Colour, float]) -> tuple[float, bool]:
        rollout = roll_out(tool.gripped_by(tool.grips[grip]), reach, densities, settings)
        return rollout.work, rollout.error <= reach.path.tolerance

    start = time.perf_counter()
    choice = plan_choice(list_options(tool), reach, settings)
    for_reach, ratio = compare(choice, reaching.experience, follow_path, time.perf_counter() - start)
    for_reach += [f"{100 * measure_quadrature(choice, reach, reaching.experience):.3f} %"]

    start = time.perf_counter()
    choice = plan_choice(list_options(tool), hammer, settings)
    planning = time.perf_counter() - start
    planned = list(list_blow_costs(choice).values())

    def strike(grip: int, densities: Mapping[Colour, float]) -> tuple[float, bool]:
        gripped = tool.gripped_by(tool.grips[grip])
        try:
            done = simulate_blow(gripped, hammer, planned[grip], densities, settings)
        except AffordanceError:
            return np.inf, False
        return done.work, abs(done.force / hammer.force - 1.0) <= FORCE_TOLERANCE

    for_hammer, ratio_of_blows = compare(choice, hammering.experience, strike, planning)
    labels = [
        "same choice",
        f"same choice where works differ by more than {100 * NEAR_TIE:.0f} %",
        "no option feasible, fast and brute",
        "work, largest difference",
        "work, median difference",
        "a decision by brute force",
        "a decision by inner simulation, its density drawn",
        "planning both grips, once",
        "10,000 decisions with their planning, times as fast as brute force",
        f"quadrature, {NUM_NODES} nodes against every control period, largest error",
    ]
    rows = [list(row) for row in zip(labels, for_reach, [*for_hammer, ""], strict=True)]
    return rows, {"decisions_vs_rollouts": ratio, "decisions_vs_blows": ratio_of_blows}


def compare(
    choice: Choice, experience: ExperienceConfig, simulate: Simulate, planning: float
) -> tuple[list[str], float]:
    """Decides both ways; returns a column of the table and the ratio of decisions per second, planning included.

    Args:
        choice: Choice by inner simulation.
        experience: Experience of the observer whose belief yields half of the densities.
        simulate: Function by which brute force decides.
        planning: Time taken to plan the choice, [s].
    """
    arrays, rng = gain_experience(experience, 0), np.random.default_rng(0)
    memories = [
        MaterialMemory(
            experience.colours, DensityBelief(arrays["precision"][trial], arrays["information_vector"][trial])
        )
        for trial in (0, 1)
    ]
    deviation = choice.settings.prior.deviation_sd
    rho = np.vstack(
        [memory.belief.add_object_variation(deviation).draw_samples(rng, NUM_ROLLOUTS // 2) for memory in memories]
    )
    planned = choice.compute_costs(choice.compute_parameters(memories[0], rho))
    works, done = np.empty_like(planned.work), np.empty_like(planned.feasible)
    start = time.perf_counter()
    for k, densities in enumerate(rho):
        for grip in range(len(choice.options)):
            works[grip, k], done[grip, k] = simulate(grip, dict(zip(experience.colours, densities, strict=True)))
    brute_seconds = (time.perf_counter() - start) / NUM_ROLLOUTS
    coin = np.random.default_rng(0)
    fast, brute = pick_cheapest(planned, coin), pick_cheapest(planned._replace(work=works, feasible=done), coin)
    both = planned.feasible & done
    difference = np.abs(works[both] / planned.work[both] - 1.0)
    clear = (np.abs(np.log(planned.work[0] / planned.work[1])) > NEAR_TIE) | ~planned.feasible.all(axis=0)

    def decide() -> None:
        generator = np.random.default_rng(1)
        pick_cheapest(choice.compute_costs(choice.draw_parameters(memories[0], generator, NUM_FAST)), generator)

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
    return column, ratio


def measure_quadrature(choice: Choice, task: Reach, experience: ExperienceConfig) -> float:
    """Computes the largest relative error of the work by the quadrature's nodes, under densities of the prior."""
    memory = MaterialMemory().add_colours(experience.colours, choice.settings.prior)
    pi = choice.draw_parameters(memory, np.random.default_rng(2), NUM_ROLLOUTS)
    model = ArmModel(load_arm(choice.settings.arm))
    error = 0.0
    for option, parameters, coarse in zip(choice.options, pi, choice.compute_costs(pi).work, strict=True):
        motion = task.build_cost(model, option.gripped, choice.settings).motion
        every_tick = MotionCost(model, motion, num_nodes=len(motion.q)).compute(parameters).work
        error = max(error, float(np.abs(coarse / every_tick - 1.0).max()))
    return error
