"""Torques while the arm holds the learning tools, simulated once for all studies of learning from them.

Torques, the arm's own part of them, and the payload regressor do not depend on beliefs, so the same holds can be used
with any geometry and whichever tool is left out. Several holds of one tool are one observation with less noise,
because the tool's deviation from its materials and the errors of its observed features are the same in each hold.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from affordance.arguments import Seed, check_seed
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, list_colours
from affordance.proprioception.estimator import TorqueStatistics, condition_on_torques
from affordance.proprioception.torque_noise import NoiseModel, WeberNoise
from affordance.settings import Settings
from affordance.simulation.trial import TrialRunner
from affordance.vision.eye import measure_drawing
from affordance.vision.features import ComponentFeatures
from affordance.vision.systems import predict_object

# Duration of a hold, [s]; the arm is at rest again after half of it.
DURATION = 1.0
_ROUNDING = 1e-9
# Margin before the end of a presentation, because at the end the memory learns and the statistics are reset, [s].
_TO_SPARE = 0.05


def simulate_holds(
    tools: Sequence[Tool], settings: Settings, *, rounds: int, seed: Seed
) -> dict[str, list[TorqueStatistics]]:
    """Simulates holds of each tool in each round, in random order, with learning in between.

    Tools are held by their grip. Equal seeds and orders give equal holds.

    Returns:
        Torque statistics of the holds of each tool, by its name.
    """
    runner, seed = TrialRunner(settings), check_seed(seed)
    colours = list_colours(tools)
    memory: MaterialMemory = MaterialMemory().add_colours(colours, settings.prior)
    drawings = {tool.name: measure_drawing(tool) for tool in tools}
    order = np.random.default_rng([*seed, 1])
    felt: dict[str, list[TorqueStatistics]] = {tool.name: [] for tool in tools}
    for turn in range(rounds):
        for index in order.permutation(len(tools)):
            tool = tools[index]
            # Counted from 1, because a seed that ends in 0 gives the same numbers as the seed without that 0.
            hold = feel(runner, tool, memory, duration=DURATION, seed=(*seed, 1 + turn, 1 + int(index)))
            felt[tool.name].append(hold)
            memory = _teach(memory, drawings[tool.name], felt[tool.name][-1], settings, settings.noise)
            memory = memory.restrict_to(colours)
    return felt


def feel(
    runner: TrialRunner, tool: Tool, memory: MaterialMemory, *, duration: float, seed: tuple[int, ...]
) -> TorqueStatistics:
    """Measures the torques of one hold; the arguments are those of ``TrialRunner.run_hold``."""
    trial = runner.get_diagram(duration + _TO_SPARE)
    simulator = runner.prepare(trial, tool, trial.hold, memory, seed)
    simulator.AdvanceTo(duration + _ROUNDING)
    return trial.estimator.get_statistics(trial.estimator.GetMyContextFromRoot(simulator.get_context()))


def learn(
    felt: Mapping[str, Sequence[TorqueStatistics]],
    features: Mapping[str, Sequence[ComponentFeatures]],
    colours: Sequence[Colour],
    settings: Settings,
) -> MaterialMemory:
    """Learns from held tools, by name, with one update per tool.

    Features are those of each tool as it was held. Only materials whose colours the learner knows are remembered.
    """
    memory: MaterialMemory = MaterialMemory().add_colours(colours, settings.prior)
    for name, holds in felt.items():
        percept = TorqueStatistics(
            np.mean([hold.features for hold in holds], axis=0), sum(hold.num_samples for hold in holds)
        )
        memory = _teach(memory, features[name], percept, settings, _average(settings.noise, len(holds)))
        memory = memory.restrict_to(colours)
    return memory


def gain_experience(tools: Sequence[Tool], settings: Settings, *, holds: int, seed: int) -> MaterialMemory:
    """Learns materials from tools held in the home posture, by their first grip, or at frame T if they have none."""
    held = [tool.gripped_by(tool.grips[0]) if tool.grips else tool for tool in tools]
    felt = simulate_holds(held, settings, rounds=holds, seed=(seed, 1))
    return learn(felt, {tool.name: measure_drawing(tool) for tool in held}, list_colours(held), settings)


def _teach(
    memory: MaterialMemory,
    features: Sequence[ComponentFeatures],
    felt: TorqueStatistics,
    settings: Settings,
    noise: NoiseModel,
) -> MaterialMemory:
    belief = predict_object(features, memory, settings.prior)
    num_joints = _count_joints(felt, noise)
    posterior, _ = condition_on_torques(belief, felt, num_joints, noise, settings.prior.deviation)
    learned: MaterialMemory = posterior.memory
    return learned


def _count_joints(felt: TorqueStatistics, noise: NoiseModel) -> int:
    """Returns the number of joints that the length of the torque features corresponds to."""
    count = 1
    while noise.num_features(count) < len(felt.features):
        count += 1
    return count


def _average(noise: NoiseModel, count: int) -> NoiseModel:
    """Returns the noise of the mean of several holds; noise with independent samples needs no change."""
    if not isinstance(noise, WeberNoise) or noise.independent_samples:
        return noise
    shrink = 1.0 / np.sqrt(count)
    return replace(noise, weber_fraction=shrink * noise.weber_fraction, threshold=shrink * noise.threshold)
