"""Workshop in which observers may hold pieces of stock before they choose tools, with true costs and observations."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.felt_object import FeltObject
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.hold_advice import HoldAdvice
from affordance.choice.hold_worth import Decision
from affordance.choice.inner_simulation import Choice
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.next_hold import Question, advise_hold
from affordance.choice.pricing import plan_options, price_options
from affordance.files.model_folder import MODELS
from affordance.objects.colour import Colour
from affordance.objects.inertia import Geometry, build_transform_map
from affordance.objects.load import load_tools
from affordance.objects.materials import Material, load_materials
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import condition_on_torques
from affordance.proprioception.static_hold import StaticHold
from affordance.robots.robot import Robot
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.trial import TrialRunner
from affordance.vision.eye import measure_drawing
from affordance.vision.features import ComponentFeatures
from affordance.vision.systems import measure_geometry, predict_object

TASKS = ("hammer", "reach", "mash")
# Materials of the rods and blocks in the paper's world, and tasks of its tools.
_PAPERS, _PAPERS_TASKS = ("brass", "steel", "beech"), ("reach", "hammer")
# Number of materials in stock that no tool contains.
_NUM_OTHERS = 4
# Duration of a simulated hold, [s].
_DURATION = 1.0
# Smallest density of an object, as a fraction of its material's mean.
_LEAST = 0.3


class Workshop(NamedTuple):
    """Workshop on the paper's arm: stock, tools and tasks, planned once."""

    candidates: Mapping[str, Tool]  # objects that may be held, by name
    questions: Sequence[Question]  # tasks with their planned options
    static: StaticHold  # arm at rest at home
    settings: Settings


class TrueWorld(NamedTuple):
    """World of one observer."""

    densities: Mapping[str, Mapping[Colour, float]]  # true densities of each candidate by colour, [kg/m^3]
    costs: Mapping[str, Array]  # true costs of all options of each task, infinite where infeasible, (k,) each, [J]


@lru_cache(maxsize=1)
def build_workshop(tasks: tuple[str, ...] = TASKS) -> Workshop:
    """Builds the workshop: five pieces of stock, one piece of each of four other materials, hammers, kitchen tools.

    Hammers are for hammering and reaching, kitchen tools for mashing.
    """
    materials, folder = load_materials(), MODELS / "workshop"
    stock = load_tools(folder / "blanks.yaml", materials)
    shown = {part.material.name for tool in stock for part in tool.components}
    others = [each for name, each in materials.items() if name not in shown][:_NUM_OTHERS]
    tools = {"mash": load_tools(folder / "uncommon.yaml", materials)}
    hammers = load_tools(folder / "tools.yaml", materials)
    return _build(
        [*stock, *(make_stock(stock[1], "rod", each) for each in others)],
        {name: (name, tools.get(name, hammers)) for name in tasks},
    )


@lru_cache(maxsize=1)
def build_paper_world() -> Workshop:
    """Builds the paper's world: two tools of Simulation II, rods and blocks, and ten choices of a new tool's grip."""
    materials = load_materials()
    rod, block = (load_tools(MODELS / "workshop" / "blanks.yaml", materials)[place] for place in (1, 2))
    held = load_tools(MODELS / "tools" / "com.yaml", materials)[:2]
    stock = [
        make_stock(one, kind, materials[each]) for one, kind in ((rod, "rod"), (block, "block")) for each in _PAPERS
    ]
    novel = load_tools(MODELS / "tools" / "novel.yaml", materials)
    return _build(
        [*held, *stock], {f"{task}, {tool.name}": (task, [tool]) for task in _PAPERS_TASKS for tool in novel}
    )


def _build(stock: Sequence[Tool], decisions: Mapping[str, tuple[str, Sequence[Tool]]]) -> Workshop:
    """Builds a workshop from stock and, for each named decision, its task and tools."""
    robot, settings = Robot(), DEFAULT_SETTINGS
    questions = [
        Question(name, plan_options(list_drawn_options(tools), robot.load_task(task), settings))
        for name, (task, tools) in decisions.items()
    ]
    return Workshop({tool.name: tool for tool in stock}, questions, StaticHold(load_arm(settings.arm)), settings)


def make_stock(pattern: Tool, kind: str, material: Material) -> Tool:
    """Makes a piece of stock with the shape of another piece, of a single material."""
    parts = tuple(replace(part, material=material, looks_like=material) for part in pattern.components)
    return replace(pattern, name=f"{kind} of {material.name}", components=parts)


def draw_world(
    workshop: Workshop, rng: np.random.Generator, means: Mapping[Colour, float] | None = None
) -> TrueWorld:
    """Draws an observer's world, in which every object deviates from its materials; means are real if None."""
    deviation = workshop.settings.prior.deviation
    means = means or {each.colour: each.density for each in load_materials().values()}
    densities: dict[str, dict[Colour, float]] = {}
    for name, tool in workshop.candidates.items():
        colours = list(dict.fromkeys(part.looks_like.colour for part in tool.components))
        drawn = deviate([means[colour] for colour in colours], deviation, rng)
        densities[name] = dict(zip(colours, drawn.tolist(), strict=True))
    costs = {}
    for question in workshop.questions:
        true: dict[str, Array] = {}
        for option in question.choice.options:
            if option.object_name not in true:
                materials = [part.colour for part in option.features]
                true[option.object_name] = draw_parameters(option.features, materials, means, deviation, rng)
        costs[question.name] = find_true_costs(question.choice, true)
    return TrueWorld(densities, costs)


def draw_parameters[K](
    features: Sequence[ComponentFeatures],
    materials: Sequence[K],
    means: Mapping[K, float],
    deviation: float,
    rng: np.random.Generator,
) -> Array:
    """Draws an object's true parameters, (10,), given the material of each part and the materials' mean densities."""
    kinds = list(dict.fromkeys(materials))
    geometry = measure_geometry(features, [kinds.index(each) for each in materials], len(kinds))
    pi: Array = geometry.Phi @ deviate([means[kind] for kind in kinds], deviation, rng)
    return pi


def deviate(means: Sequence[float], deviation: float, rng: np.random.Generator) -> Array:
    """Draws the densities of an object, (M,), [kg/m^3], with one deviation from the mean for each of its materials.

    ``deviation`` is the standard deviation as a fraction of the mean.
    """
    mean = np.array(means)
    return mean * np.maximum(1.0 + deviation * rng.standard_normal(len(mean)), _LEAST)


def find_true_costs(choice: Choice, truths: Mapping[str, Array], criterion: Criterion = Criterion.WORK) -> Array:
    """Computes the costs of all options for the tools' true parameters, (options,), infinite where infeasible."""
    pi = np.array(
        [build_transform_map(np.linalg.inv(option.X_TG)) @ truths[option.object_name] for option in choice.options]
    )
    costs, _ = price_options(choice, pi[:, None], criterion)
    true_costs: Array = np.where(costs.feasible, costs.cost, np.inf)[:, 0]
    return true_costs


def start_memory(workshop: Workshop, memory: MaterialMemory) -> MaterialMemory:
    """Adds the colours of all candidates and tools, so that all rules' beliefs have the same order."""
    for tool in workshop.candidates.values():
        memory = memory.add_colours([part.looks_like.colour for part in tool.components], workshop.settings.prior)
    for question in workshop.questions:
        memory = question.choice.add_colours(memory)
    return memory


def advise(
    workshop: Workshop,
    memory: MaterialMemory,
    names: Sequence[str],
    *,
    num_samples: int,
    seed: int = 0,
    felt: Mapping[str, FeltObject] | None = None,
) -> HoldAdvice:
    """Advises which of the candidates to hold next, with work as the cost."""
    return advise_hold(
        [workshop.candidates[name] for name in names],
        workshop.questions,
        memory,
        workshop.settings,
        criterion=Criterion.WORK,
        felt=felt,
        num_samples=num_samples,
        seed=seed,
    )


def hold(
    workshop: Workshop,
    world: TrueWorld,
    name: str,
    memory: MaterialMemory,
    seed: tuple[int, ...],
    *,
    is_simulated: bool = False,
) -> MaterialMemory:
    """Lets an observer hold an object at rest, in closed form or simulated; returns the memory afterwards."""
    if not is_simulated:
        return learn(workshop, name, world.densities[name], memory, seed)[0]
    tool = workshop.candidates[name].with_densities(world.densities[name])
    return _get_runner(workshop.settings).run_hold(tool, memory, duration=_DURATION, seed=seed).memory


@lru_cache(maxsize=1)
def _get_runner(settings: Settings) -> TrialRunner:
    """Returns the runner of simulated holds; objects are seen as in their drawings, as when advice is given."""
    return TrialRunner(settings, eye=lambda tool, rng: measure_drawing(tool))


def learn(
    workshop: Workshop,
    name: str,
    densities: Mapping[Colour, float],
    memory: MaterialMemory,
    seed: tuple[int, ...],
) -> tuple[MaterialMemory, FeltObject]:
    """Lets an observer learn from holding an object with given densities by colour.

    Returns:
        Memory after the hold, and the object with its likelihoods.
    """
    settings, static = workshop.settings, workshop.static
    parts = measure_drawing(workshop.candidates[name])
    recollection = memory.recall([part.appearance for part in parts], settings.prior)
    belief = predict_object(parts, memory, settings.prior)
    rho = np.zeros(belief.densities.size)
    columns = {part.colour: column for part, column in zip(parts, recollection.columns, strict=True)}
    for colour, column in columns.items():
        rho[column] = densities[colour]
    statistics = static.measure(belief, rho, settings.noise, seed)
    learned, _ = condition_on_torques(
        belief, statistics, len(static.tau_arm), settings.noise, settings.prior.deviation
    )
    felt = learned.memory.recall([part.appearance for part in parts], settings.prior).felt
    assert felt is not None  # because the learner has just learned from this object
    return learned.memory, felt


def recall_felt(workshop: Workshop, memory: MaterialMemory) -> dict[str, FeltObject]:
    """Returns the candidates that were held before, with their likelihoods from the memory."""
    felt = {}
    for name, tool in workshop.candidates.items():
        found = memory.recall([part.appearance for part in measure_drawing(tool)], workshop.settings.prior).felt
        if found is not None:
            felt[name] = found
    return felt


def build_hold_geometry(workshop: Workshop, name: str, memory: MaterialMemory) -> Geometry:
    """Builds the geometry of a candidate, with one column for each colour of the memory."""
    parts = measure_drawing(workshop.candidates[name])
    columns = [memory.colours.index(part.colour) for part in parts]
    return measure_geometry(parts, columns, len(memory.colours))


def decide(
    workshop: Workshop, memory: MaterialMemory, num_samples: int, rng: np.random.Generator
) -> tuple[Array, list[Decision]]:
    """Draws materials' means, (S, M), and the costs of all options given each draw."""
    mu = memory.belief.draw_samples(rng, num_samples)
    deviation = workshop.settings.prior.deviation
    decisions = []
    for question in workshop.questions:
        drawn: dict[str, Array] = {}
        for option in question.choice.options:
            if option.object_name not in drawn:
                columns = [memory.colours.index(part.colour) for part in option.features]
                geometry = measure_geometry(option.features, columns, len(memory.colours))
                own = np.maximum(mu * (1.0 + deviation * rng.standard_normal(mu.shape)), 0.0)
                errors = rng.standard_normal((num_samples, len(geometry.Phi_errors)))
                drawn[option.object_name] = geometry.compute_parameters(own, errors)
        options = question.choice.options
        pi = np.array([drawn[each.object_name] @ build_transform_map(np.linalg.inv(each.X_TG)).T for each in options])
        costs, _ = price_options(question.choice, pi)
        names = tuple(each.name for each in options)
        decisions.append(Decision(question.name, names, costs.cost, costs.feasible))
    return mu, decisions
