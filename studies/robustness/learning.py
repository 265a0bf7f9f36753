"""Learning from objects held at rest, for thousands of observers, without simulating the holds.

Beliefs change as in a simulated trial, except that the posture does not sink under a misjudged object.
"""

from collections.abc import Sequence

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.experiments.shared.experience import draw_order
from affordance.experiments.shared.observers import Setup
from affordance.objects.tool import Tool
from affordance.proprioception.estimator import condition_on_torques
from affordance.proprioception.static_hold import StaticHold
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object
from studies.robustness.build import World

_FELT = 1  # element of a seed for errors of felt torques, as in a simulated trial


def learn_at_rest(
    hold: StaticHold, world: World, tools: Sequence[Tool], orders: Sequence[Sequence[int]], seed: int
) -> list[list[MaterialMemory]]:
    """Returns observers' memories before the first object that they hold and after each; computes no evidence.

    Each observer holds the objects in its own order; colours are remembered in the order of the objects' parts.
    Errors of felt torques equal those of simulated trials with the same root.
    """
    prior = world.settings.prior
    features = [measure_features(tool, VisionError(), np.random.default_rng(0)) for tool in tools]
    colours = dict.fromkeys(part.looks_like.colour for tool in tools for part in tool.components)
    start = MaterialMemory().add_colours(tuple(colours), prior)
    observers = []
    for repeat, order in enumerate(orders):
        memories: list[MaterialMemory] = [start]
        for trial, index in enumerate(order):
            seen = predict_object(features[index], memories[-1], prior)
            memories.append(_hold(hold, world, tools[index], seen, (seed, repeat, trial, _FELT)))
        observers.append(memories)
    return observers


def collect_experience_at_rest(hold: StaticHold, world: World, seed: int, count: int) -> list[list[MaterialMemory]]:
    """Returns what observers learn about materials from the objects of Simulation II, each in its own order.

    Returns:
        Each observer's memory of materials, without single objects: before the first hold and after every hold.
    """
    tools = world.learning[:2]
    orders = [draw_order(Setup(seed=seed), len(tools), observer) for observer in range(count)]
    observers = learn_at_rest(hold, world, tools, orders, seed)
    return [
        [MaterialMemory.from_belief(memory.colours, memory.belief) for memory in memories] for memories in observers
    ]


def _hold(hold: StaticHold, world: World, tool: Tool, prior: ObjectBelief, seed: tuple[int, ...]) -> MaterialMemory:
    settings = world.settings
    true = {part.looks_like.colour: part.material.density for part in tool.components}
    statistics = hold.measure(
        prior,
        np.array([true.get(colour, 0.0) for colour in prior.list_colours()]),
        settings.noise,
        seed,
        num_samples=world.num_samples,
        acceleration_sd=settings.acceleration_sd,
    )
    posterior, _ = condition_on_torques(
        prior, statistics, len(hold.tau_arm), settings.noise, settings.prior.deviation
    )
    memory: MaterialMemory = posterior.memory
    return memory
