"""Inner simulation against brute force: the same decisions by a matrix product and by moving the arm in Drake.

A decision is the choice of the grip of the novel object with which a task takes less work, under one sampled density:
moving its free end along the path of Simulation III, or driving the nail of Simulation IV. Inner simulation plans the
motions of each grip once and then decides for ten thousand densities at a time; brute force simulates both grips
under each density, with contact. Half of the densities are drawn from the prior, half from an observer's belief after
one trial, so that near ties are among them.
"""

import time

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import Hammer
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.motion_cost import NUM_NODES, MotionCost
from affordance.choice.picking import NO_OPTION, pick_cheapest
from affordance.choice.reach import Reach
from affordance.experiments.protocol_runs import load_choice_experiment
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.experiments.shared.gain_experience import gain_experience
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from studies.speed.inner_vs_full import Comparison, simulate_all
from studies.speed.timing import time_by_turns

HEADER = ["what", "reach", "hammer"]
NUM_ROLLOUTS = 100
NUM_FAST = 10_000
# Relative difference of both grips' works below which a decision counts as a near tie.
NEAR_TIE = 0.03
LABELS = (
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
)


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Decides both ways for the same densities; returns rows of a table, and the ratio of decisions per second."""
    reaching, hammering = (load_choice_experiment(name) for name in ("reach", "hammer"))
    tool, reach, hammer = reaching.novel[0], reaching.task, hammering.task
    assert isinstance(reach, Reach)
    assert isinstance(hammer, Hammer)
    for_reach, choice, ratio = compare(tool, reach, reaching.experience)
    for_hammer, _, ratio_of_blows = compare(tool, hammer, hammering.experience)
    for_reach.append(f"{100 * measure_quadrature(choice, reach, reaching.experience):.3f} %")
    rows = [list(row) for row in zip(LABELS, for_reach, [*for_hammer, ""], strict=True)]
    return rows, {"decisions_vs_rollouts": ratio, "decisions_vs_blows": ratio_of_blows}


def compare(tool: Tool, task: Reach | Hammer, experience: ExperienceConfig) -> tuple[list[str], Choice, float]:
    """Decides both ways; half of the densities are drawn from the belief of an observer with the experience.

    Returns: Column of the table, the choice, and the ratio of decisions per second, planning included.
    """
    start = time.perf_counter()
    choice = plan_choice(list_options(tool), task, experience.settings)
    planning = time.perf_counter() - start
    arrays, rng = gain_experience(experience, 0), np.random.default_rng(0)
    beliefs = [DensityBelief(arrays["precision"][k], arrays["information_vector"][k]) for k in (0, 1)]
    deviation = experience.settings.prior.deviation_sd
    rho = np.vstack(
        [belief.add_object_variation(deviation).draw_samples(rng, NUM_ROLLOUTS // 2) for belief in beliefs]
    )
    unknown = MaterialMemory(experience.colours, beliefs[0])
    planned = choice.compute_costs(choice.compute_parameters(unknown, rho))
    start = time.perf_counter()
    compared = Comparison(planned, simulate_all(tool, task, choice, experience.colours, rho))
    brute_seconds = (time.perf_counter() - start) / NUM_ROLLOUTS
    fast, brute = compared.choose()
    difference = compared.differences
    clear = (np.abs(np.log(planned.work[0] / planned.work[1])) > NEAR_TIE) | ~planned.feasible.all(axis=0)

    def decide() -> None:
        generator = np.random.default_rng(1)
        pick_cheapest(choice.compute_costs(choice.draw_parameters(unknown, generator, NUM_FAST)), generator)

    fast_seconds = time_by_turns({"fast": decide}, turns=7, calls_per_turn=2)["fast"] / NUM_FAST
    ratio = brute_seconds / (fast_seconds + planning / NUM_FAST)
    column = [
        f"{compared.num_same} of {NUM_ROLLOUTS}",
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
