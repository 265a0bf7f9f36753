"""Simulation of participants with known learners, and fits of all learners to their pushes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.belief.learner_file import load_learner
from affordance.belief.learners import DENSITY, KINDS_DRAWN
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.lifts import Design, lift
from affordance.extensions.people.fit import Question, score_ahead
from affordance.extensions.people.likelihood import list_free, set_learner
from affordance.extensions.people.participant import LiftSettings, Participant, with_participant
from affordance.extensions.people.pushes import Lifts, Person
from affordance.extensions.people.rivals import OWN_AND_SHARED, OWN_MEMORY
from affordance.objects.tool import Tool

# Push error of simulated and fitted participants.
PUSH_ERROR = 0.2
GROUP = "linear_plus_plus"
_FORGETTING = Path(__file__).parents[2] / "examples" / "forgetting.py"


@dataclass(frozen=True)
class Recovery:
    """Configuration of the study.

    Attributes:
        seed: Root seed.
        draws: Number of parameter vectors for each learner.
        particles: Number of particles for each parameter vector.
        lifts: Numbers of lifts after which learners are compared; the last is the total number of lifts.
    """

    seed: int
    draws: int
    particles: int
    lifts: tuple[int, ...]


def list_rivals() -> list[Learner]:
    """Lists the compared learners."""
    return [DENSITY, OWN_MEMORY, OWN_AND_SHARED, KINDS_DRAWN, load_learner(f"{_FORGETTING}:Forgetting")]


def recover(config: Recovery, number: int) -> Mapping[str, NDArray[np.float64]]:
    """Simulates one participant, and evaluates all learners on the pushes.

    The learner of the participant is assigned in turn.

    Returns:
        One-step-ahead log ``score`` and ``bic``, (learners, numbers of lifts) each; true ``log_kappa``, and its
        posterior ``mean`` and ``sd`` for each number of lifts, NaN for learners without kinds.
    """
    rivals = list_rivals()
    learner = rivals[number % len(rivals)]
    person, tools, true = simulate(config, learner, number)
    setup = Setup(seed=config.seed)
    ends = np.array(config.lifts) - 1
    score, bic = np.zeros((2, len(rivals), len(ends)))
    known = Participant(push_error=PUSH_ERROR)
    ask = partial(Question, Lifts((person,), tools), draws=config.draws, particles=config.particles, seed=config.seed)
    for row, rival in enumerate(rivals):
        question = ask(rival, setup.settings, list_free(rival, Participant()))
        parts = question.compute(0, question.draw_prior())
        score[row] = np.cumsum(score_ahead(parts))[ends]
        best = np.cumsum(parts, axis=1)[:, ends].max(axis=0)
        bic[row] = len(question.free) * np.log(config.lifts) - 2.0 * best
    mean, sd = np.full((2, len(ends)), np.nan)
    if learner is KINDS_DRAWN:
        question = ask(
            learner,
            replace(with_participant(setup.settings), participant=known),
            list_free(learner, known, ["kappa"]),
        )
        normal = question.draw_prior()
        mean, sd = weigh(
            np.log(question.convert(normal)[:, 0]), np.cumsum(question.compute(0, normal), axis=1)[:, ends]
        )
    return {"score": score, "bic": bic, "log_kappa": np.array(np.log(true)), "mean": mean, "sd": sd}


def simulate(config: Recovery, learner: Learner, number: int) -> tuple[Person, tuple[Tool, ...], float]:
    """Simulates lifts of a participant with parameters drawn from the prior.

    Returns: Lifts, objects, and kappa, which is NaN for learners without kinds.
    """
    known = Participant(push_error=PUSH_ERROR)
    free = list_free(learner, known, learner.fitted)
    normal = np.random.default_rng([config.seed, number]).standard_normal((1, len(free)))
    values = np.column_stack([normal[:, :0], *(each.convert(normal[:, i]) for i, each in enumerate(free))])
    own = set_learner(learner, free, values)
    own = own.change(**{each.name: float(values[0, i]) for i, each in enumerate(free)})
    settings = LiftSettings(learner=own, participant=known)
    person = simulate_pushes(f"{learner.name} {number}", settings, config.seed + 1 + number, linear.design)
    first = slice(config.lifts[-1])
    shorter = Person(person.name, person.objects[first], person.pushes[first], person.teaches[first])
    return shorter, tuple(linear.make_objects(GROUP)), float(getattr(own.parameters, "kappa", np.nan))


def simulate_pushes(name: str, settings: LiftSettings, seed: int, design: Design) -> Person:
    """Simulates the lifts of one participant. The seed determines order, measurements and pushes."""
    tools = tuple(linear.make_objects(GROUP))
    names = [tool.name for tool in tools]
    data = lift(Setup(seed=seed, settings=settings), tools, design, [0])[0]
    objects = np.array([names.index(each) for each in data.object.values])
    return Person(name, objects, data.force.values, np.ones(len(objects), dtype=bool))


def weigh(values: Array, log_likelihoods: Array) -> tuple[Array, Array]:
    """Computes posterior means and SDs, (K,) each, by weighting prior draws, (D,), with log likelihoods, (D, K)."""
    weights = np.exp(log_likelihoods - logsumexp(log_likelihoods, axis=0))
    mean = values @ weights
    return mean, np.sqrt(np.maximum(values**2 @ weights - mean**2, 0.0))
