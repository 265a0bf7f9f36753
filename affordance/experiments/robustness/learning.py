"""What observers learn by holding objects, felt at rest: by the thousand, without simulating the holds.

Beliefs change as in a simulated trial but for the posture, which there sinks under an object that is misjudged.
"""

from collections.abc import Sequence

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.experiments.robustness.build import World
from affordance.experiments.shared.experience import Experience, ExperienceConfig, draw_order
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.proprioception.estimator import compute_posterior
from affordance.proprioception.static_hold import StaticHold
from affordance.vision.features import VisionError, measure_features
from affordance.vision.visual_prior import predict_object

_FELT = 1  # in a seed, as of a simulated trial: errors of feeling


def hold_at_rest(hold: StaticHold, world: World, tool: Tool, memory: Memory, seed: tuple[int, ...]) -> Memory:
    """The memory after holding an object; errors of feeling are those of a simulated trial with this seed."""
    settings = world.settings
    features = measure_features(tool, VisionError(), np.random.default_rng(0))
    prior = predict_object(features, memory, settings.prior)
    true = {part.looks_like.colour: part.material.density for part in tool.components}
    rho = np.array([true.get(colour, 0.0) for colour in prior.memory.colours])
    statistics = hold.measure(
        prior,
        rho,
        settings.noise,
        (*seed, _FELT),
        num_samples=world.num_samples,
        acceleration_sd=settings.acceleration_sd,
    )
    return compute_posterior(
        prior, statistics, len(hold.tau_arm), settings.noise, settings.prior.deviation_sd
    ).posterior.memory


def learn_in_turn(
    hold: StaticHold, world: World, tools: Sequence[Tool], colours: Sequence[Colour], seed: tuple[int, ...]
) -> list[Memory]:
    """The memories of an observer before the first and after each of some objects.

    Args:
        hold: The arm at rest.
        world: Gives the settings.
        tools: What is held, in this order.
        colours: Those of the tools, in the order in which they are remembered.
        seed: Determines all errors.
    """
    memories: list[Memory] = [MaterialMemory().add_colours(colours, world.settings.prior)]
    for trial, tool in enumerate(tools):
        memories.append(hold_at_rest(hold, world, tool, memories[-1], (*seed, trial)))
    return memories


def collect_experience_at_rest(hold: StaticHold, world: World, config: ExperienceConfig, count: int) -> Experience:
    """What observers learn of the objects of Simulation II, each in an order of its own."""
    observers = [
        learn_in_turn(
            hold,
            world,
            [config.tools[index] for index in draw_order(config, repeat)],
            config.colours,
            (config.seed, repeat),
        )
        for repeat in range(count)
    ]
    return Experience(
        config.colours,
        np.array([[memory.belief.precision for memory in memories] for memories in observers]),
        np.array([[memory.belief.information_vector for memory in memories] for memories in observers]),
        np.array([draw_order(config, repeat) for repeat in range(count)], dtype=np.intp),
    )
