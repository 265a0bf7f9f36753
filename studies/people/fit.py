"""Fit of kappa to the two groups of Linear+ and Linear++, with its confidence interval.

The learned fraction f of each group is compared between people and simulated observers. Its error in people follows
from the published intervals; simulated means have an error too, which is included. With Gaussian errors

    log L(kappa) = -1/2 sum over groups (f_people - f(kappa))^2 / (se_people^2 + se(kappa)^2) - log of their roots

Only kappa is free, so this is its profile likelihood; the 95 % interval is where it is within 1.92 of its maximum.
Between the simulated values of kappa, f and its error are interpolated linearly.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2
from scipy.stats import t as student_t

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.protocols.people_tables import Published, PublishedTable
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings

# Protocols of the groups.
GROUPS = ("linear_plus", "linear_plus_plus")
# Names of the groups in figures and tables.
TITLES = ("Linear+", "Linear++")
_CONFIDENCE = 0.95
# Log likelihood at the ends of the interval, relative to its maximum.
THRESHOLD = -0.5 * float(chi2.ppf(_CONFIDENCE, 1))
# Step of kappa at which the interpolated likelihood is evaluated.
_STEP = 0.001


class Fraction(NamedTuple):
    """Learned fraction of a group."""

    mean: float  # estimate of f
    se: float  # standard error of the estimate
    low: float  # lower end of the 95 % interval
    high: float  # upper end of the 95 % interval


def estimate_people_fraction(people: PublishedTable) -> Fraction:
    """Estimates the learned fraction of people, with its error to first order for independent forces.

    Means and 95 % intervals by Student's t are published; the covariance of the two forces over people is not.

    Raises:
        BadValueError: The table lacks a row that is needed.
    """
    end, family, weight = (people.get(name) for name in ("end_N", "family_N", "weight_N"))
    quantile = float(student_t.ppf(0.5 + _CONFIDENCE / 2.0, people.get("num_people").value - 1.0))
    scale = weight.value - family.value
    fraction = (end.value - family.value) / scale
    se = math.hypot(_estimate_se(end, quantile), (1.0 - fraction) * _estimate_se(family, quantile)) / scale
    return Fraction(fraction, se, fraction - quantile * se, fraction + quantile * se)


def _estimate_se(published: Published, quantile: float) -> float:
    """Computes the standard error behind a published interval."""
    return 0.5 * (published.high - published.low) / quantile


class KappaFit(NamedTuple):
    """Estimate of kappa from the two groups, for one learner."""

    kappas: Array  # simulated values of kappa, (K,), increasing
    fractions: Array  # mean learned fraction of simulated observers, (K, groups)
    fraction_ses: Array  # standard errors of these means, (K, groups)
    grid: Array  # values of kappa at which the likelihood was computed, (N,)
    log_likelihood: Array  # Log-likelihood on the grid, minus its maximum, (N,)
    kappa: float  # Maximum-likelihood estimate
    low: float  # lower end of the 95 % interval; the smallest simulated value if the likelihood does not bound it
    high: float  # upper end of the 95 % interval; the largest simulated value if the likelihood does not bound it

    @property
    def is_bounded(self) -> bool:
        """True if both ends of the interval lie within the simulated values."""
        return bool(self.low > self.grid[0] and self.high < self.grid[-1])


def simulate_fraction(
    experiment: PresentationExperiment, learner: Learner, kappa: float, *, repeats: int, jobs: int
) -> tuple[float, float]:
    """Mean learned fraction of simulated observers, at least 2, and its standard error."""
    experiment = replace(experiment.with_learners([learner]), kappa=kappa)
    tasks = [partial(experiment.run_observer, None, None, repeat) for repeat in range(repeats)]
    rows = run_tasks(tasks, jobs=jobs, description=f"kappa {kappa:.3f}")
    arrays = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    fractions = experiment.compute_of_observers(arrays)[learner]["f"]
    return float(fractions.mean()), float(fractions.std(ddof=1) / math.sqrt(repeats))


def load_groups(models: Path, seed: int, settings: Settings) -> list[PresentationExperiment]:
    """Loads the experiment of each group.

    A protocol that is wrong raises a BadValueError.
    """
    return [load_hold_experiment(name, models, seed, settings) for name in GROUPS]


def load_people(experiment: PresentationExperiment) -> PublishedTable:
    """The published values of a group."""
    assert experiment.people.table is not None  # the shipped protocols name one
    return experiment.people.table


def fit_kappa(kappas: Array, fractions: Array, fraction_ses: Array, people: list[Fraction]) -> KappaFit:
    """Finds kappa and its interval from increasing simulated values, (K,), and learned fractions, (K, groups).

    The latter are means of observers with their standard errors; those of people are given for each group.
    """
    grid = np.arange(kappas[0], kappas[-1] + 0.5 * _STEP, _STEP)
    log_likelihood = np.zeros(len(grid))
    for group, found in enumerate(people):
        mean = np.interp(grid, kappas, fractions[:, group])
        variance = found.se**2 + np.interp(grid, kappas, fraction_ses[:, group]) ** 2
        log_likelihood -= 0.5 * ((found.mean - mean) ** 2 / variance + np.log(variance))
    log_likelihood -= log_likelihood.max()
    inside = grid[log_likelihood >= THRESHOLD]
    best = float(grid[log_likelihood.argmax()])
    return KappaFit(kappas, fractions, fraction_ses, grid, log_likelihood, best, float(inside[0]), float(inside[-1]))


def simulate_and_fit(
    learner: Learner,
    kappas: Array,
    people: list[Fraction],
    experiments: Sequence[PresentationExperiment],
    *,
    repeats: int,
    jobs: int,
) -> KappaFit:
    """Simulates both groups at each kappa, and fits it; arguments are those of the functions above."""
    simulate = partial(simulate_fraction, learner=learner, repeats=repeats, jobs=jobs)
    found = np.array([[simulate(experiment, kappa=float(kappa)) for experiment in experiments] for kappa in kappas])
    return fit_kappa(kappas, found[..., 0], found[..., 1], people)
