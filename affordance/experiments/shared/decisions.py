"""Proportions with which observers choose the cheaper grip of a tool never held, for Simulations III and IV."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice
from affordance.choice.ranking import NO_OPTION, Chosen, pick_cheapest, rank_options
from affordance.experiments.shared.experience import Experience
from affordance.files.netcdf import LabelledArray
from affordance.objects.colour import Colour
from affordance.reporting.statistics import Estimate, estimate_proportion
from affordance.runs.random_streams import Stream

# Number of choices before any experience, all drawn from the one prior.
NUM_PRIOR_CHOICES = 10_000
# Number of densities over which the work of each option is averaged.
NUM_BAYES_SAMPLES = 2_000


def choose_before_experience(
    choice: Choice, colours: tuple[Colour, ...], seed: int, num_choices: int = NUM_PRIOR_CHOICES
) -> Chosen:
    """Chooses by the paper's rule under many densities drawn from the prior, (num_choices,)."""
    rng = np.random.default_rng([seed, Stream.PRIOR])
    memory = MaterialMemory().add_colours(colours, choice.settings.prior)
    return pick_cheapest(choice.compute_costs(choice.draw_parameters(memory, rng, num_choices)), rng)


def choose_by_sample(
    choice: Choice, experience: Experience, seed: int, repeat: int, moments: Sequence[int] | None = None
) -> Chosen:
    """Chooses by the paper's rule, one density per choice, after some numbers of trials.

    Args:
        choice: Options of the choice.
        experience: Memories of observers.
        seed: Root of every random draw.
        repeat: Number of the observer.
        moments: Numbers of trials after which a choice is made, in order; 0 to K if None.
    """
    parameters = []
    for trial in range(experience.num_trials + 1) if moments is None else moments:
        rng = np.random.default_rng([seed, repeat, trial, Stream.PAPER])
        parameters.append(choice.draw_parameters(experience.recall(repeat, trial), rng, 1))
    rng = np.random.default_rng([seed, repeat, Stream.PAPER])
    return pick_cheapest(choice.compute_costs(np.concatenate(parameters, axis=1)), rng)


def choose_by_expectation(
    choice: Choice, experience: Experience, seed: int, repeat: int
) -> tuple[Chosen, NDArray[np.bool_]]:
    """Chooses by least expected absolute work, before the first and after each trial.

    Returns: Choices, and True where the least expected integral of |tau|^2 would choose otherwise, (K + 1,) each.
    """
    chosen, flips = [], []
    for trial in range(experience.num_trials + 1):
        rng = np.random.default_rng([seed, repeat, trial, Stream.BAYES])
        ranking = rank_options(choice, experience.recall(repeat, trial), rng, NUM_BAYES_SAMPLES)
        usable = ranking.num_usable > 0
        chosen.append(choice.options.index(ranking.best.option) if usable else NO_OPTION)
        flips.append(ranking.flips)
    return np.array(chosen), np.array(flips)


def let_observer_choose(
    choices: Sequence[Choice], experience: Experience, seed: int, repeat: int
) -> dict[str, NDArray[Any]]:
    """Lets an observer choose a grip of each of G tools before the first and after each of K trials.

    Returns: Indices of the chosen grips: ``paper`` by the paper's rule, (G, K + 1), and ``bayes`` for the first tool
        by least expected work, (K + 1,); and ``flips``, True where the least expected integral of |tau|^2 would
        choose otherwise, (K + 1,).
    """
    bayes, flips = choose_by_expectation(choices[0], experience, seed, repeat)
    paper = np.stack([choose_by_sample(choice, experience, seed, repeat) for choice in choices])
    return {"paper": paper, "bayes": bayes, "flips": flips}


def count_correct(chosen: Chosen, correct: int) -> Array:
    """Counts correct choices over the first axis; a choice without a usable option counts a half, as a guess."""
    guesses = 0.5 * (chosen == NO_OPTION)
    counted: Array = ((chosen == correct) + guesses).sum(axis=0)
    return counted


def estimate_correct(chosen: Chosen, before: Chosen | None, correct: int) -> Estimate:
    """Estimates the proportion of correct choices.

    Args:
        chosen: Choices of all observers, (repeats, K + 1).
        before: Choices drawn from the prior, (N,), that replace those before the first trial; None counts the
            observers' own.
        correct: Index of the correct option.

    Returns: Proportions with Wilson intervals, each (K + 1,).
    """
    estimate = estimate_proportion(count_correct(chosen, correct), len(chosen))
    if before is None:
        return estimate
    first = estimate_proportion(count_correct(before, correct), len(before))
    return Estimate(*(np.concatenate([[a], b[1:]]) for a, b in zip(first, estimate, strict=True)))


def label_choices(arrays: Mapping[str, NDArray[Any]]) -> dict[str, LabelledArray]:
    """Labels the choices of all observers for the file of trajectories."""
    meaning = "index of the grip chosen, -1 if none can be used"
    return {
        "chosen": LabelledArray(
            ("repeat", "tool", "moment"), arrays["paper"], "1", f"{meaning}; one density drawn a choice"
        ),
        "chosen_by_expectation": LabelledArray(
            ("repeat", "moment"), arrays["bayes"], "1", f"{meaning}; least expected absolute work, first tool"
        ),
    }
