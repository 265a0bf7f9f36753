"""Learning from objects at rest, for thousands of observers, without simulating holds.

Beliefs are updated as in a simulated trial, except that the arm does not sink if an object is heavier than expected.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from affordance.belief.felt_object import AtHand
from affordance.belief.holds import Felt, Holds
from affordance.belief.learners import DENSITY
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.belief.prior import Prior
from affordance.belief.rows import Seen, pad, take_rows
from affordance.experiments.shared.experience import draw_order
from affordance.experiments.shared.observers import Setup
from affordance.objects.tool import Tool
from affordance.proprioception.static_hold import StaticHold
from affordance.runs.random_streams import ObserverDraws
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object
from studies.robustness.build import World

_FELT = 1  # last element of the seed of torque errors, as in a simulated trial


def learn_at_rest(
    hold: StaticHold, world: World, tools: Sequence[Tool], orders: Sequence[Sequence[int]], seed: int
) -> list[list[MaterialMemory]]:
    """Computes memories of observers before their first object and after each object, without evidence.

    Colours are in the order of the objects' parts. Torque errors equal the errors in simulated trials with the same
    root seed.

    Args:
        hold: Arm at rest.
        world: Objects and settings.
        tools: Objects.
        orders: Order of the objects for each observer.
        seed: Root seed.
    """
    prior = world.settings.prior
    features = [measure_features(tool, VisionError(), np.random.default_rng(0)) for tool in tools]
    colours = dict.fromkeys(part.looks_like.colour for tool in tools for part in tool.components)
    start = MaterialMemory().add_colours(tuple(colours), prior)
    observers = [[start] for _ in orders]
    for trial, turn in enumerate(zip(*orders, strict=True)):
        seen = [predict_object(features[index], each[-1], prior) for index, each in zip(turn, observers, strict=True)]
        felt = [
            _feel(hold, world, tools[index], each, (seed, repeat, trial, _FELT))
            for repeat, (index, each) in enumerate(zip(turn, seen, strict=True))
        ]
        for each, memory in zip(observers, _learn_together([each.memory for each in seen], felt, prior), strict=True):
            each.append(memory)
    return observers


def collect_experience_at_rest(hold: StaticHold, world: World, seed: int, count: int) -> list[list[MaterialMemory]]:
    """Computes the experience of observers with the objects of Simulation II.

    Each observer has its own order of the objects.

    Returns: Memory of materials, without single objects, of each observer before the first hold and after each hold.
    """
    tools = world.learning[:2]
    orders = [draw_order(Setup(seed=seed), len(tools), observer) for observer in range(count)]
    observers = learn_at_rest(hold, world, tools, orders, seed)
    return [
        [MaterialMemory.from_belief(memory.colours, memory.belief) for memory in memories] for memories in observers
    ]


def _feel(hold: StaticHold, world: World, tool: Tool, prior: ObjectBelief, seed: tuple[int, ...]) -> Felt:
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
    return settings.noise.describe(statistics.features, statistics.num_samples, len(hold.tau_arm), prior.geometry)


def _learn_together(memories: Sequence[MaterialMemory], felt: Sequence[Felt], prior: Prior) -> list[MaterialMemory]:
    """Updates each memory with its current object. Objects with the same colours are processed together."""
    learned: dict[int, MaterialMemory] = {}
    at_hand = [cast(AtHand, memory.at_hand) for memory in memories]
    for colours in dict.fromkeys(each.seen.colours for each in at_hand):
        rows = [row for row, each in enumerate(at_hand) if each.seen.colours == colours]
        states = [memories[row].state for row in rows]
        shapes = {
            name: [max(n) for n in zip(*(each[name].shape[1:] for each in states), strict=True)] for name in states[0]
        }
        state = {name: np.concatenate([pad(each[name], shapes[name]) for each in states]) for name in shapes}
        state["deviation"] = np.full(len(rows), prior.deviation)
        things = np.array([at_hand[row].number for row in rows])
        holds = Holds(*map(np.concatenate, zip(*(felt[row].hold for row in rows), strict=True)))
        evidence = Felt(holds, np.zeros(len(rows)), felt[0].num_values)
        found = DENSITY.learn(state, Seen(colours, things), evidence, ObserverDraws([])).state
        for place, row in enumerate(rows):
            memory, own = memories[row], at_hand[row]
            known = memory.things if own.number < len(memory.things) else (*memory.things, own.thing)
            of_row = take_rows(found, np.array([place]))
            learned[row] = replace(memory, state=of_row, things=known, num_lifts=memory.num_lifts + 1, at_hand=None)
    return [learned[row] for row in range(len(memories))]
