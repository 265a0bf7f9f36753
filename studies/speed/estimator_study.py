"""Cost of the plug-in for density-dependent noise: distance from brute-force Bayes, and coverage of intervals.

Measurements are drawn from the noise of the joints (Weber fraction and threshold at the true torque), for the
experiment's third object held still. The estimator evaluates the standard deviation of the errors at its posterior
mean, the grid at every density. Offsets are in posterior standard deviations; coverage is of the true density.
"""

from collections.abc import Iterator

import numpy as np
from scipy.stats import norm, truncnorm

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import compute_posterior
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.torque_noise import WeberNoise
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.systems import predict_object

HEADER = [
    "w",
    "s0 (N m)",
    "true density (kg/m^3)",
    "mean offset of median",
    "mean offset, all percentiles",
    "99 % of offsets below",
    "50 % interval covers (grid)",
    "90 % interval covers (grid)",
]
NUM_PERCEPTS = 2000
GRID = np.linspace(0.0, 40_000.0, 20_001)[1:]
FRACTIONS = (0.05, 0.25, 0.5, 0.75, 0.95)


def compute_grid_percentiles(
    hold: StaticHold, unit_parameters: Array, tau: Array, noise: WeberNoise, prior: Prior
) -> Array:
    """Computes percentiles of the posterior by brute force, with errors at every density's own torque, (5,)."""
    predicted = hold.tau_arm + np.outer(GRID, hold.Y @ unit_parameters)
    sd = np.sqrt(noise.threshold**2 + (noise.weber_fraction * predicted) ** 2)
    logs = np.sum(norm.logpdf(tau, predicted, sd), axis=1)
    logs += norm.logpdf(GRID, prior.mode, np.hypot(prior.sd, prior.deviation_sd))
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    return np.interp(FRACTIONS, np.cumsum(weights) - 0.5 * weights, GRID)


def study(true_densities: Array, noise: WeberNoise, prior: Prior) -> tuple[Array, Array, Array]:
    """Compares estimator and grid over mean torques of objects of true densities, shape (N,).

    Returns: Offsets of the five percentiles, (N, 5); True where the estimator's and the grid's 50 and 90 % intervals
        cover the truth, (N, 2) each.
    """
    hold = StaticHold(load_arm())
    features = measure_features(load_hold_experiment("weight").tools[2], VisionError(), np.random.default_rng(0))
    belief = predict_object(features, MaterialMemory(), prior)
    offsets: list[Array] = []
    covered: list[list[bool]] = []
    covered_by_grid: list[list[bool]] = []
    for number, true in enumerate(true_densities):
        statistics = hold.measure(belief, np.array([true]), noise, (number,))
        posterior = compute_posterior(
            belief, statistics, len(hold.tau_arm), noise, prior.deviation_sd
        ).posterior.densities
        ours = posterior.compute_percentiles(FRACTIONS)[:, 0]
        tau = statistics.features[: len(hold.tau_arm)]
        grid = compute_grid_percentiles(hold, belief.geometry.Phi[:, 0], tau, noise, prior)
        offsets.append((ours - grid) / np.sqrt(posterior.covariance[0, 0]))
        for percentiles, verdicts in ((ours, covered), (grid, covered_by_grid)):
            verdicts.append([percentiles[low] <= true <= percentiles[high] for low, high in ((1, 3), (0, 4))])
    return np.array(offsets), np.array(covered), np.array(covered_by_grid)


def measure() -> Iterator[list[str]]:
    """Compares both for errors and densities of several sizes; yields rows of a table."""
    prior = DEFAULT_SETTINGS.prior
    sd = np.hypot(prior.sd, prior.deviation_sd)
    from_prior = truncnorm(-prior.mode / sd, np.inf, loc=prior.mode, scale=sd).rvs(
        NUM_PERCEPTS, random_state=np.random.default_rng(1)
    )
    for w, s0 in ((0.07, 0.097), (0.0, 0.097), (0.05, 0.05), (0.10, 0.097), (0.13, 0.097)):
        for label, truth in (("720", 720.0), ("8500", 8500.0), ("drawn from the prior", from_prior)):
            true_densities = np.broadcast_to(truth, NUM_PERCEPTS)
            offsets, ours, grid = study(true_densities, WeberNoise(w, s0), prior)
            coverage = zip(100 * ours.mean(axis=0), 100 * grid.mean(axis=0), strict=True)
            yield [
                f"{w:g}",
                f"{s0:g}",
                label,
                f"{offsets[:, 2].mean():+.2f}",
                f"{np.abs(offsets).mean():.2f}",
                f"{np.quantile(np.abs(offsets), 0.99):.2f}",
                *(f"{a:.1f} ({b:.1f})" for a, b in coverage),
            ]
