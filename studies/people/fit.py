"""Maximum likelihood estimate of kappa from the groups of Linear+ and Linear++.

The learned fraction f of simulated observers is compared with the learned fraction of humans in each group. Standard
errors of humans follow from published intervals. The log likelihood for normally distributed errors is

    log L(kappa) = sum over groups of -1/2 (f_people - f(kappa))^2 / s^2 - log s,  s^2 = se_people^2 + se(kappa)^2

The 95 % interval contains all kappa whose log likelihood is within 1.92 of the maximum. Between simulated values of
kappa, f and its standard error are interpolated linearly.
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2
from scipy.stats import t as student_t

from affordance.arrays import Array
from affordance.experiments.shared.holds import compute_volume
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.lifts import lift
from affordance.extensions.people.experiments.linear import Group, Published
from affordance.objects.tool import Tool
from affordance.runs.repeats import run_tasks

_CONFIDENCE = 0.95
# Log likelihood at the ends of the interval, relative to its maximum.
THRESHOLD = -0.5 * float(chi2.ppf(_CONFIDENCE, 1))
# Step of kappa for evaluating the interpolated likelihood.
_STEP = 0.001


class Fraction(NamedTuple):
    """Learned fraction of a group."""

    mean: float  # estimate of f
    se: float  # standard error of the estimate
    low: float  # lower end of the 95 % interval
    high: float  # upper end of the 95 % interval


def estimate_people_fraction(group: Group) -> Fraction:
    """Estimates the learned fraction of humans from published means and 95 % intervals (Student's t).

    Errors are propagated to first order. Two forces are assumed to be independent, because their covariance is not
    published.
    """
    end, family, weight = (group.people[name] for name in ("end_N", "family_N", "weight_N"))
    quantile = float(student_t.ppf(0.5 + _CONFIDENCE / 2.0, group.num_people - 1.0))
    scale = weight.value - family.value
    fraction = (end.value - family.value) / scale
    se = math.hypot(_estimate_se(end, quantile), (1.0 - fraction) * _estimate_se(family, quantile)) / scale
    return Fraction(fraction, se, fraction - quantile * se, fraction + quantile * se)


def _estimate_se(published: Published, quantile: float) -> float:
    """Computes the standard error from a published interval."""
    return 0.5 * (published.high - published.low) / quantile


class KappaFit(NamedTuple):
    """Estimate of kappa from two groups, for one learner."""

    kappas: Array  # simulated values of kappa, (K,), increasing
    fractions: Array  # mean learned fraction of simulated observers, (K, groups)
    fraction_ses: Array  # standard errors of these means, (K, groups)
    grid: Array  # values of kappa at which the likelihood was computed, (N,)
    log_likelihood: Array  # log likelihood on the grid, minus its maximum, (N,)
    kappa: float  # maximum likelihood estimate
    low: float  # lower end of the 95 % interval; the smallest simulated value if the likelihood does not bound it
    high: float  # upper end of the 95 % interval; the largest simulated value if the likelihood does not bound it

    @property
    def is_bounded(self) -> bool:
        """True if both ends of the interval are within the range of simulated values."""
        return bool(self.low > self.grid[0] and self.high < self.grid[-1])


def simulate_fraction(setup: Setup, tools: Sequence[Tool], kappa: float) -> tuple[float, float]:
    """Computes the mean learned fraction of at least two observers, and its standard error."""
    changed = setup.change(learner=setup.settings.learner.change(kappa=kappa))
    fractions = simulate_fractions(changed, tools, f"kappa {kappa:.3f}")
    return float(fractions.mean()), float(fractions.std(ddof=1) / math.sqrt(setup.observers))


def simulate_fractions(setup: Setup, tools: Sequence[Tool], what: str) -> Array:
    """Computes the learned fractions of all observers, (observers,). ``what`` is the label of the progress bar."""
    parts = [part.tolist() for part in np.array_split(np.arange(setup.observers), setup.jobs) if len(part)]
    tasks = [partial(find_fractions, setup, tools, part) for part in parts]
    return np.concatenate(run_tasks(tasks, jobs=setup.jobs, description=what))


def find_fractions(setup: Setup, tools: Sequence[Tool], observers: Sequence[int]) -> list[float]:
    """Computes the learned fractions of some observers."""
    sizes = {tool.name: compute_volume(tool) for tool in tools}
    fractions = []
    for data in lift(setup, tools, linear.design, observers):
        lifts = data.to_dataframe()
        fractions.append(float(linear.measure(lifts.assign(size=lifts["object"].map(sizes)))["f"]))
    return fractions


def fit_kappa(kappas: Array, fractions: Array, fraction_ses: Array, people: list[Fraction]) -> KappaFit:
    """Estimates kappa and its interval.

    Args:
        kappas: Simulated values of kappa, increasing, (K,).
        fractions: Mean learned fractions of simulated observers, (K, groups).
        fraction_ses: Standard errors of these means, (K, groups).
        people: Learned fraction of humans in each group.
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


def simulate_and_fit(setup: Setup, kappas: Array, people: list[Fraction]) -> KappaFit:
    """Simulates both groups for each kappa with the learner of the setup, and fits kappa to human data."""
    groups = [linear.make_objects(name) for name in linear.GROUPS]
    found = np.array([[simulate_fraction(setup, tools, float(kappa)) for tools in groups] for kappa in kappas])
    return fit_kappa(kappas, found[..., 0], found[..., 1], people)
