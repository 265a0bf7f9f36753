"""Inner simulation beside brute force: the same decisions by a matrix product and by moving the arm in Drake.

A decision is which grip of the novel object moves its free end along the path with less work, under one sampled
density. Inner simulation plans the motion of each grip once and then decides for ten thousand densities at a time;
brute force simulates both grips under each density. Half of the densities are drawn from the prior, half from what an
observer believes after one trial, so that near ties are among them.
"""

import time

import numpy as np

from affordance.arm import ArmModel, load_arm
from affordance.belief import DensityBelief
from affordance.choice import NO_OPTION, Choice, list_options, pick_cheapest
from affordance.experience import gain_experience
from affordance.experiments.reach import load_config
from affordance.memory import MaterialMemory
from affordance.planned_motion import NUM_NODES, MotionEnergies
from affordance.rollout import roll_out
from benchmarks.timing import time_by_turns

HEADER = ["what", "value"]
NUM_ROLLOUTS = 100
NUM_FAST = 10_000


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Decides both ways for the same densities; returns rows of a table, and the ratio of decisions a second."""
    config = load_config()
    settings, tool, looks = config.experience.settings, config.novel.plain, config.experience.looks
    start = time.perf_counter()
    choice = Choice(list_options(tool), config.task, settings)
    planning = time.perf_counter() - start
    arrays = gain_experience(config.experience, 0)
    rng = np.random.default_rng(0)
    deviation = settings.prior.deviation_sd
    memories = [
        MaterialMemory(looks, DensityBelief(arrays["precision"][trial], arrays["shift"][trial])) for trial in (0, 1)
    ]
    rho = np.vstack([memory.belief.spread(deviation).draw_samples(rng, NUM_ROLLOUTS // 2) for memory in memories])
    planned = choice.compute_costs(choice.compute_parameters(memories[0], rho))

    works, errors = np.empty_like(planned.work), np.empty_like(planned.work)
    start = time.perf_counter()
    for k, densities in enumerate(rho):
        for i, grip in enumerate(tool.grips):
            rollout = roll_out(tool.hold_by(grip), config.task, dict(zip(looks, densities, strict=True)), settings)
            works[i, k], errors[i, k] = rollout.work, rollout.error
    seconds_per_rollout_decision = (time.perf_counter() - start) / NUM_ROLLOUTS
    simulated = planned._replace(work=works, feasible=errors <= config.task.path.tolerance)
    coin = np.random.default_rng(0)
    fast, brute = pick_cheapest(planned, coin), pick_cheapest(simulated, coin)
    both = planned.feasible & simulated.feasible
    difference = np.abs(works / planned.work - 1.0)[both]

    def decide() -> None:
        generator = np.random.default_rng(1)
        pick_cheapest(choice.compute_costs(choice.draw_parameters(memories[0], generator, NUM_FAST)), generator)

    seconds_per_fast_decision = time_by_turns({"fast": decide}, turns=7, calls_per_turn=2)["fast"] / NUM_FAST
    ratio = seconds_per_rollout_decision / seconds_per_fast_decision
    with_planning = seconds_per_rollout_decision / (seconds_per_fast_decision + planning / NUM_FAST)
    model = ArmModel(load_arm(settings.arm))
    pi = choice.compute_parameters(memories[0], rho)
    quadrature = 0.0
    for option, parameters, coarse in zip(choice.options, pi, planned.work, strict=True):
        motion = config.task.build_energies(model, option.gripped, settings).motion
        every_tick = MotionEnergies(model, motion, num_nodes=len(motion.q)).compute(parameters).work
        quadrature = max(quadrature, float(np.abs(coarse / every_tick - 1.0).max()))
    rows = [
        ["same choice", f"{int((fast == brute).sum())} of {NUM_ROLLOUTS}"],
        ["no option feasible, fast and brute", f"{(fast == NO_OPTION).sum()}, {(brute == NO_OPTION).sum()}"],
        ["work, largest difference", f"{100 * difference.max():.2f} %"],
        ["work, median difference", f"{100 * np.median(difference):.2f} %"],
        [f"quadrature, {NUM_NODES} nodes beside every tick, largest error", f"{100 * quadrature:.3f} %"],
        ["path, largest error", f"{1000 * errors[simulated.feasible].max():.1f} mm"],
        ["a decision by brute force", f"{1e3 * seconds_per_rollout_decision:.0f} ms"],
        ["a decision by inner simulation, its density drawn", f"{1e6 * seconds_per_fast_decision:.2f} us"],
        ["planning both grips, once", f"{1e3 * planning:.0f} ms"],
        ["10,000 decisions with their planning, times as fast as brute force", f"{with_planning:.0f}"],
    ]
    return rows, {"decisions_vs_rollouts": ratio}
