"""Observers that follow the advice until it says stop, in drawn worlds and in worlds with one odd object."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.belief.density_belief import EMPTY_BELIEF
from affordance.belief.felt_object import FeltObject
from affordance.belief.material_memory import start_memory as start_learner
from affordance.choice.hold_advice import CERTAIN, HoldAdvice
from affordance.objects.colour import Colour
from affordance.reporting.statistics import estimate_proportion
from studies.active import world as worlds

# Number of samples for advice, and pieces of stock of which there are two in worlds with an odd object.
NUM_SAMPLES, _NUM_DOUBLED = 1000, 5
# Number of worlds drawn from the prior.
NUM_DRAWN = 500
# Reasons to stop: none within the allowed holds; all choices are certain; no hold is worth its price; no option can
# do any task.
_REASONS = ("", "certain", "not worth its price", "impossible")


@dataclass(frozen=True)
class StopConfig:
    """Configuration of observers that hold objects until the advice says stop."""

    # True if the materials' densities are drawn from the prior, false for the real densities.
    is_drawn: bool = False
    # True if there are two pieces of stock of each material, and one of all pieces is odd: it has the density of
    # another material.
    has_decoy: bool = False
    doubts: bool = True  # true if observers report what they felt, so that the advice allows for an odd object
    most: int = 7  # largest number of holds
    seed: int = 0  # root of every random draw; worlds and errors are the same whether or not observers doubt
    tasks: tuple[str, ...] = worlds.TASKS  # names of the tasks


def run_observer(config: StopConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Lets an observer follow the advice until it says stop, and judges the choices made then.

    Returns:
        ``right``, (tasks,), judged by the true costs, NaN where no option can do the task; ``p_best``, (tasks,), the
        stated probability of being right; ``holds``, the number of holds; ``reason``, the index of the reason to
        stop; and ``rests``, (tasks,), the number of objects on each of which a certain choice depends: without it the
        choice would be open.
    """
    rng = np.random.default_rng([config.seed, repeat, 1])
    workshop = worlds.build_workshop(config.tasks)
    if config.has_decoy:
        workshop = double_stock(workshop)
    true = worlds.draw_world(workshop, rng, draw_means(workshop, rng) if config.is_drawn else None)
    if config.has_decoy:
        true = swap_density(true, rng)
    memory = worlds.start_memory(workshop, start_learner())
    names = list(workshop.candidates)
    felt: dict[str, FeltObject] = {}
    left = list(names)
    for number in range(config.most + 1):
        advice = worlds.advise(
            workshop,
            memory,
            left,
            num_samples=NUM_SAMPLES,
            seed=int(np.random.default_rng([config.seed, repeat, 3, number]).integers(2**31)),
            felt=felt if config.doubts else None,
        )
        if advice.stop or number == config.most or len(left) == 1:
            break
        name = advice.next_name
        left.remove(name)
        seed = (config.seed, repeat, 4 + names.index(name))
        memory, felt[name] = worlds.learn(workshop, name, true.densities[name], memory, seed)
    return {
        "right": np.array([_is_right(workshop, true, advice, task) for task in range(len(config.tasks))]),
        "p_best": np.array([each.p_best for each in advice.decisions]),
        "holds": np.array(len(felt)),
        "reason": np.array(_REASONS.index(advice.stop)),
        "rests": np.array([len(each.rests_on) for each in advice.decisions]),
    }


def double_stock(workshop: worlds.Workshop) -> worlds.Workshop:
    """Returns the workshop with two pieces of stock of each of the tools' materials, and no other stock."""
    stock = dict(list(workshop.candidates.items())[:_NUM_DOUBLED])
    pattern = workshop.candidates["rod of cast steel"]
    for name, tool in list(stock.items()):
        material = tool.components[0].looks_like
        second = replace(pattern.components[0], material=material, looks_like=material)
        stock[f"second of {name}"] = replace(pattern, name=f"second of {name}", components=(second,))
    return workshop._replace(candidates=stock)


def swap_density(true: worlds.TrueWorld, rng: np.random.Generator) -> worlds.TrueWorld:
    """Returns the world after giving one random candidate the density of another material."""
    names = list(true.densities)
    odd = names[int(rng.integers(len(names)))]
    (colour,) = true.densities[odd]
    others = [name for name in names if colour not in true.densities[name]]
    (density,) = true.densities[others[int(rng.integers(len(others)))]].values()
    return true._replace(densities={**true.densities, odd: {colour: density}})


def draw_means(workshop: worlds.Workshop, rng: np.random.Generator) -> dict[Colour, float]:
    """Draws the mean density of every material in the workshop from the prior."""
    shown = {part.looks_like.colour for tool in workshop.candidates.values() for part in tool.components}
    options = (option for question in workshop.questions for option in question.choice.options)
    colours = sorted({*shown, *(part.colour for option in options for part in option.features)})
    drawn = EMPTY_BELIEF.extend(workshop.settings.prior, len(colours)).draw_samples(rng, 1)[0]
    return {colour: float(density) for colour, density in zip(colours, drawn, strict=True)}


def list_configs(seed: int, repeats: int) -> dict[str, tuple[StopConfig, int]]:
    """Lists configurations by name, with numbers of observers; hammering is left out because it takes longest."""
    tasks = ("reach", "mash")
    return {
        "drawn": (StopConfig(is_drawn=True, seed=seed, tasks=tasks), NUM_DRAWN),
        "drawn_undoubted": (StopConfig(is_drawn=True, doubts=False, seed=seed, tasks=tasks), NUM_DRAWN),
        "before": (StopConfig(has_decoy=True, doubts=False, most=9, seed=seed, tasks=tasks), repeats),
        "after": (StopConfig(has_decoy=True, most=9, seed=seed, tasks=tasks), repeats),
    }


def summarise(stops: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Summarises the results of each configuration, as in metrics.json."""
    return {
        "drawn": stops["drawn"],
        "drawn_undoubted": stops["drawn_undoubted"],
        "decoy": {name: stops[name]["right"] for name in ("before", "after")},
        "decoy_stops": {name: stops[name] for name in ("before", "after")},
        "drawn_right": stops["drawn"]["right"],
        "drawn_stopped": stops["drawn"]["stopped"],
        "drawn_certain": stops["drawn"]["certain"],
        "decoy_right": stops["after"]["right"],
    }


def describe_stops(arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Summarises the final choices, as in metrics.json; tasks that no option can do are not judged."""
    judged = np.isfinite(arrays["right"])
    certain = judged & (arrays["p_best"] >= CERTAIN)
    checked = certain & (arrays["rests"] == 0)
    found: dict[str, Any] = {
        "choices": int(judged.sum()),
        "stopped": float((arrays["reason"] > 0).mean()),
        "stopped_as_certain": float((arrays["reason"] == _REASONS.index("certain")).mean()),
        "certain": float(certain.sum() / judged.sum()),
        "checked": float(checked.sum() / judged.sum()),
        "holds": float(arrays["holds"].mean()),
        "said": float(arrays["p_best"][certain].mean()) if certain.any() else None,
    }
    for key, chosen in (("right", certain), ("right_checked", checked)):
        share = estimate_proportion(np.array([arrays["right"][chosen].sum()]), max(int(chosen.sum()), 1))
        found |= {key: float(share.mean[0]), f"{key}_ci95": share.ci95[0].tolist()}
    return found


def _is_right(workshop: worlds.Workshop, true: worlds.TrueWorld, advice: HoldAdvice, task: int) -> float:
    costs = true.costs[advice.decisions[task].name]
    if not np.isfinite(costs).any():
        return float("nan")
    options = [option.name for option in workshop.questions[task].choice.options]
    return float(costs[options.index(advice.decisions[task].best)] <= costs[np.isfinite(costs)].min())
