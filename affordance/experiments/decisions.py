"""How often observers choose the cheaper grip of an object they never held: what simulations III and IV share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import joblib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance import figures, metrics
from affordance.arm import ARM, load_arm
from affordance.belief import Point
from affordance.choice import NO_OPTION, TIE, Choice, Chosen, Demand, list_options, pick_cheapest
from affordance.estimator import infer
from affordance.exceptions import BadValueError
from affordance.experience import Experience, ExperienceConfig, draw_order
from affordance.experiments.com import load_objects
from affordance.experiments.preparation import check_tools_are_honest, check_tools_can_be_held
from affordance.memory import MaterialMemory
from affordance.metrics import Estimate
from affordance.noise import WeberNoise
from affordance.settings import Settings, Sight
from affordance.static_hold import StaticHold
from affordance.tools import Colour, Tool, list_densities, load_materials, load_tools
from affordance.trajectories import Labelled
from affordance.vision import observe
from affordance.visual_prior import predict_object

Array = NDArray[np.float64]

# Choices before any experience are all drawn from the one prior (design 6).
NUM_PRIOR_CHOICES = 10_000
# Observers of the study of sensitivity, at most.
MAX_STUDIED = 200
# Densities over which Bayes' rule averages the work of each option.
NUM_BAYES_SAMPLES = 2_000
# Lengths of an object in two grips that differ by less are equal, [m].
_SAME_LENGTH = 1e-9
# Stand for choices and for the sensitivity study in seeds, beside the trials, which count from 0.
_PAPER, _BAYES, _PRIOR, _STATIC = 10**6 + 1, 10**6 + 2, 10**6 + 3, 10**6 + 4


@dataclass(frozen=True)
class NovelObjects:
    """The objects that are chosen about and never held.

    Attributes:
        plain: Its shape says nothing about which end to hold.
        headed: Its shape does; it is run beside the other.
    """

    plain: Tool
    headed: Tool


def load_novel_objects(models: Path, experience: ExperienceConfig) -> NovelObjects:
    """Reads the novel objects from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make these experiments.
    """
    path = models / "tools" / "novel.yaml"
    tools = load_tools(path, load_materials(models / "materials.yaml"))
    if len(tools) != 2:
        raise BadValueError(path, "tools", f"has {len(tools)} entries, must have 2: a plain object and a headed one")
    for tool in tools:
        if len(tool.grips) != 2:
            raise BadValueError(path, f"tools: {tool.name}.grips", f"has {len(tool.grips)} entries, must have 2")
        unknown = {part.looks_like.name for part in tool.components if part.looks_like.colour not in experience.looks}
        if unknown:
            problem = f"looks like {', '.join(sorted(unknown))}, must look like what com.yaml is made of"
            raise BadValueError(path, f"tools: {tool.name}", problem)
        lengths = [float(tool.hold_by(grip).p_TTfree[0]) for grip in tool.grips]
        if abs(lengths[0] - lengths[1]) > _SAME_LENGTH:
            problem = f"reach {lengths[0]:g} and {lengths[1]:g} m beyond the hand, must reach equally far"
            raise BadValueError(path, f"tools: {tool.name}.grips", problem)
    check_tools_are_honest(path, tools)
    plain, headed = tools
    if [grip.name for grip in plain.grips] != [grip.name for grip in headed.grips]:
        raise BadValueError(path, "tools", "have grips of different names, must have the same in the same order")
    return NovelObjects(plain, headed)


def load_subjects(models: Path, seed: int, sight: Sight) -> tuple[ExperienceConfig, NovelObjects]:
    """Reads arm and objects from a folder of models: those that are held, and those that are chosen about.

    Raises:
        BadValueError: A file is wrong, or the objects do not make these experiments.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    *honest, _ = load_objects(models)
    settings = Settings(arm=models / ARM.name, sight=sight)
    experience = ExperienceConfig(tuple(honest), seed, settings)
    novel = load_novel_objects(models, experience)
    check_tools_can_be_held(models / "tools" / "com.yaml", honest, settings)
    held = [tool.hold_by(grip) for tool in (novel.plain, novel.headed) for grip in tool.grips]
    check_tools_can_be_held(models / "tools" / "novel.yaml", held, settings)
    return experience, novel


def check_one_grip_is_cheaper(models: Path, tool: Tool, works: Sequence[float]) -> None:
    """Refuses objects of whose grips none is the correct one.

    Raises:
        BadValueError: The least works are equal.
    """
    cheaper, dearer = sorted(works)
    if dearer <= cheaper * (1.0 + TIE):
        problem = f"costs {cheaper:g} J in both grips, must have a cheaper one"
        raise BadValueError(models / "tools" / "novel.yaml", f"tools: {tool.name}", problem)


class Choices(NamedTuple):
    """The choices of a grip for the plain and the headed object."""

    plain: Choice
    headed: Choice


def plan_choices(novel: NovelObjects, task: Demand, settings: Settings, seed: int) -> Choices:
    """Plans a task with each grip of each object; one look at an object, drawn from the seed, serves all observers.

    Raises:
        AffordanceError: It cannot be planned.
    """
    return Choices(
        *(
            Choice(list_options(tool, seed=seed, sight=settings.sight), task, settings)
            for tool in (novel.plain, novel.headed)
        )
    )


def choose_before_experience(choice: Choice, looks: tuple[Colour, ...], seed: int) -> Chosen:
    """Chooses by the paper's rule for many densities drawn from the prior, (NUM_PRIOR_CHOICES,)."""
    rng = np.random.default_rng([seed, _PRIOR])
    memory = MaterialMemory().meet(looks, choice.settings.prior)
    return pick_cheapest(choice.compute_costs(choice.draw_parameters(memory, rng, NUM_PRIOR_CHOICES)), rng)


def choose_by_sample(choice: Choice, experience: Experience, seed: int, repeat: int) -> Chosen:
    """Chooses by the paper's rule, one density drawn a choice, before the first and after each trial, (K + 1,)."""
    parameters = []
    for trial in range(experience.num_trials + 1):
        rng = np.random.default_rng([seed, repeat, trial, _PAPER])
        parameters.append(choice.draw_parameters(experience.recall(repeat, trial), rng, 1))
    rng = np.random.default_rng([seed, repeat, _PAPER])
    return pick_cheapest(choice.compute_costs(np.concatenate(parameters, axis=1)), rng)


def choose_by_expectation(
    choice: Choice, experience: Experience, seed: int, repeat: int
) -> tuple[Chosen, NDArray[np.bool_]]:
    """Chooses by least expected work, before the first and after each trial.

    Returns: The choices, and whether the least expected integral of |tau|^2 would choose otherwise, (K + 1,) each.
    """
    chosen, flips = [], []
    for trial in range(experience.num_trials + 1):
        rng = np.random.default_rng([seed, repeat, trial, _BAYES])
        ranking = choice.rank(experience.recall(repeat, trial), rng, NUM_BAYES_SAMPLES)
        usable = ranking.num_usable > 0
        chosen.append(choice.options.index(ranking.best.option) if usable else NO_OPTION)
        flips.append(ranking.flips)
    return np.array(chosen), np.array(flips)


def run_repeat(choices: Choices, experience: Experience, seed: int, repeat: int) -> dict[str, NDArray[Any]]:
    """Lets an observer choose before the first and after each trial.

    Returns: Index of the grip chosen, (K + 1,) each: ``paper`` and ``bayes`` for the plain object by both rules,
        ``headed`` for the headed one by the paper's; and ``flips``, whether the second would choose otherwise by the
        least integral of |tau|^2.
    """
    bayes, flips = choose_by_expectation(choices.plain, experience, seed, repeat)
    return {
        "paper": choose_by_sample(choices.plain, experience, seed, repeat),
        "bayes": bayes,
        "flips": flips,
        "headed": choose_by_sample(choices.headed, experience, seed, repeat),
    }


def compute_proportions(
    choices: Choices,
    arrays: Mapping[str, NDArray[Any]],
    experience: ExperienceConfig,
    correct: int,
    correct_headed: int,
) -> dict[str, Any]:
    """Computes the proportions of correct choices of the results contract.

    Args:
        choices: The choices of a grip.
        arrays: Choices of all observers, (repeats, K + 1) each; see ``run_repeat``.
        experience: How experience was gained.
        correct: Index of the correct grip of the plain object.
        correct_headed: The same of the headed one.
    """
    looks, seed = experience.looks, experience.seed
    before, before_headed = (choose_before_experience(choice, looks, seed) for choice in choices)
    paper = estimate_correct(arrays["paper"], before, correct)
    bayes = estimate_correct(arrays["bayes"], None, correct)
    of_headed = estimate_correct(arrays["headed"], before_headed, correct_headed)
    return {
        "p_correct": paper.mean,
        "p_correct_ci95": paper.ci95,
        "p_correct_bayes": bayes.mean,
        "p_correct_bayes_ci95": bayes.ci95,
        "p_correct_headed_tool": of_headed.mean,
        "p_correct_headed_tool_ci95": of_headed.ci95,
        "effort_flips": arrays["flips"].mean(axis=0),
    }


def draw_proportions(novel: NovelObjects, numbers: Mapping[str, Any], title: str) -> Figure:
    """Draws the proportions of correct choices, figures 8 and 10."""
    curves = {
        f"{novel.plain.name}, one density drawn (paper)": "p_correct",
        f"{novel.plain.name}, least expected work": "p_correct_bayes",
        f"{novel.headed.name}, one density drawn": "p_correct_headed_tool",
    }
    return figures.draw_choices(
        {label: Estimate(numbers[key], *np.moveaxis(numbers[f"{key}_ci95"], -1, 0)) for label, key in curves.items()},
        title=title,
    )


def label_choices(arrays: Mapping[str, NDArray[Any]]) -> dict[str, Labelled]:
    """Labels the choices of all observers for the file of trajectories."""
    rules = {
        "paper": "one density drawn",
        "bayes": "least expected work",
        "headed": "headed object, one density drawn",
    }
    return {
        f"chosen_{rule}": Labelled(
            ("repeat", "moment"), arrays[rule].astype(float), "1", f"grip chosen, -1 if none can be used: {meaning}"
        )
        for rule, meaning in rules.items()
    }


def find_grip_of_densest(tool: Tool, *, at_hand: bool) -> str:
    """Names the grip that has the densest material next to the hand, or farthest from it."""

    def measure(held: Tool) -> float:
        densest = max(held.components, key=lambda part: part.material.density)
        return float(np.linalg.norm(densest.X_TE[:3, 3]))

    distances = {grip.name: measure(tool.hold_by(grip)) for grip in tool.grips}
    return (min if at_hand else max)(distances, key=distances.__getitem__)


def count_correct(chosen: Chosen, correct: int) -> Array:
    """Adds correct choices over the first axis; where no option was usable the observer guesses: a half."""
    guesses = 0.5 * (chosen == NO_OPTION)
    counted: Array = ((chosen == correct) + guesses).sum(axis=0)
    return counted


def estimate_correct(chosen: Chosen, before: Chosen | None, correct: int) -> Estimate:
    """Estimates the proportion of correct choices.

    Args:
        chosen: Choices of all observers, (repeats, K + 1).
        before: Choices drawn from the prior, (N,), that stand in for those before the first trial; None to count
            the observers' own.
        correct: Index of the correct option.

    Returns: Proportions with Wilson's interval, each (K + 1,).
    """
    estimate = metrics.estimate_proportion(count_correct(chosen, correct), len(chosen))
    if before is None:
        return estimate
    first = metrics.estimate_proportion(count_correct(before, correct), len(before))
    return Estimate(*(np.concatenate([[a], b[1:]]) for a, b in zip(first, estimate, strict=True)))


@dataclass(frozen=True)
class Assumption:
    """One point of the sensitivity study.

    Attributes:
        panel: What is varied.
        label: Its value.
        settings: All settings.
        point: Which density stands for the belief in the choice.
    """

    panel: str
    label: str
    settings: Settings
    point: Point = Point.SAMPLE


# Marks the setting that all simulations use.
BASELINE = "(used)"


def list_assumptions(settings: Settings) -> list[Assumption]:
    """The settings with noise, prior and point of the belief varied one at a time."""
    noise, prior = settings.noise, settings.prior
    assumptions = []
    if isinstance(noise, WeberNoise):
        for w in (0.5, 1.0, 2.0):
            varied = replace(noise, weber_fraction=w * noise.weber_fraction)
            assumptions.append(
                _vary("Weber fraction", f"{varied.weber_fraction:g}", w, replace(settings, noise=varied))
            )
        for s in (0.5, 1.0, 2.0):
            varied = replace(noise, threshold=s * noise.threshold)
            assumptions.append(_vary("threshold (N m)", f"{varied.threshold:g}", s, replace(settings, noise=varied)))
    for width in (0.5, 1.0, 2.0):
        wide = prior._replace(sd=width * prior.sd)
        assumptions.append(_vary("SD of the prior (kg/m³)", f"{wide.sd:g}", width, replace(settings, prior=wide)))
    for point in Point:
        label = f"{point.value} {BASELINE}" if point is Point.SAMPLE else point.value
        assumptions.append(Assumption("point of the belief", label, settings, point))
    return assumptions


def _vary(panel: str, label: str, factor: float, settings: Settings) -> Assumption:
    return Assumption(panel, f"{label} {BASELINE}" if factor == 1.0 else label, settings)


def study_sensitivity(
    experience: ExperienceConfig, choice: Choice, correct: int, *, repeats: int, jobs: int
) -> dict[str, dict[str, Array]]:
    """Computes how the proportion of correct choices depends on what is assumed.

    Observers feel the objects at rest, without simulating the holds (static_hold.py); motions are those of the
    settings in use, as neither noise nor prior moves them.

    Args:
        experience: How experience is gained.
        choice: The choice.
        correct: Index of the correct option.
        repeats: Observers for each assumption.
        jobs: Processes.

    Returns: Panels of curves by label, (K + 1,) each.
    """
    assumptions = list_assumptions(experience.settings)
    parallel = joblib.Parallel(n_jobs=min(jobs, len(assumptions)))  # joblib starts as many as it is told
    found = parallel(joblib.delayed(_learn_under)(experience, assumption, repeats) for assumption in assumptions)
    panels: dict[str, dict[str, Array]] = {}
    for assumption, observers in zip(assumptions, found, strict=True):
        costs = choice.compute_costs(
            np.concatenate([choice.compute_parameters(memory, rho[None]) for memory, rho in observers], axis=1)
        )
        chosen = pick_cheapest(costs, np.random.default_rng([experience.seed, _STATIC])).reshape(repeats, -1)
        panels.setdefault(assumption.panel, {})[assumption.label] = count_correct(chosen, correct) / repeats
    return panels


def _learn_under(
    experience: ExperienceConfig, assumption: Assumption, repeats: int
) -> list[tuple[MaterialMemory, Array]]:
    """Memories of all observers before the first and after each trial, and the densities chosen by, (M,)."""
    settings = assumption.settings
    arm = load_arm(settings.arm)
    hold = StaticHold(arm)
    unknown = MaterialMemory().meet(experience.looks, settings.prior)
    densities = list_densities(experience.tools)
    true = np.array([densities[look] for look in experience.looks])
    moments = []
    for repeat in range(repeats):
        seed = (experience.seed, repeat, _STATIC)
        rng = np.random.default_rng(seed)
        memory = unknown
        moments.append((memory, _choose_densities(memory, assumption, rng)))
        for trial, index in enumerate(draw_order(experience, repeat)):
            features = observe(experience.tools[index], settings.vision_error, rng)
            belief = predict_object(features, memory, settings.prior)
            # From 1, as a seed that ends in 0 gives the numbers of the same seed without it.
            percept = hold.feel(belief, true, settings.noise, (*seed, 1 + trial))
            inference = infer(belief, percept, arm.num_joints, settings.noise, settings.prior.deviation_sd)
            memory = inference.posterior.memory
            moments.append((memory, _choose_densities(memory, assumption, rng)))
    return moments


def _choose_densities(memory: MaterialMemory, assumption: Assumption, rng: np.random.Generator) -> Array:
    object_belief = memory.belief.spread(assumption.settings.prior.deviation_sd)
    return object_belief.choose(assumption.point, rng)
