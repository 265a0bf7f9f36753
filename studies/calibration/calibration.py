"""Simulation-based calibration of an observer's posterior (Talts et al. 2018, arXiv:1804.06788).

Mean densities of two materials are drawn from the truncated prior, and densities of an object are drawn around these
means. An inexperienced observer holds the object in Drake, or measures it at rest. The rank of the true mean
densities among samples of the posterior is recorded. If the implementation is correct, ranks are uniform, and
intervals have nominal coverage.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chisquare, norm, truncnorm

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import compute_posterior
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.torque_noise import NoiseModel, WeberNoise, WhiteNoise
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.trial import get_runner
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object
from studies.calibration.cramer_rao import compute_bound, feel_along, feel_at_rest
from studies.random_streams import StudyStream
from studies.study import run_kept

# Typical accuracy of torque sensors in robots: one hundredth of the torque limit of the strongest joint, [N m].
WHITE = WhiteNoise(0.7)
# Names of the calibrations in metrics.json and in figures.
WEBER, WHITE_NOISE = "Weber, held in Drake", "white, held in Drake"
AT_REST, CONSTANT = "Weber, felt at rest", "constant errors, felt at rest"
LOOPS = (WEBER, WHITE_NOISE)  # calibrations of the complete loop; others measure errors of approximations
EXACT, IGNORING = "Weber, at rest, exact Bayes on a grid", "Weber, in Drake, positivity ignored"

NUM_DRAWS = 1000
DURATION = 3.0  # duration of a hold, as in all experiments, [s]
COVERAGES = (0.5, 0.8, 0.9)
NUM_BINS = 20
# Ranks are from 0 to 999, with fifty ranks per bin.
NUM_SAMPLES = 999
# Grid for exact Bayesian inference, up to the 1 - 10^-6 quantile of the prior. Steps are much smaller than the width
# of any posterior.
_GRID = np.arange(25.0, 20_500.0, 50.0)


@dataclass(frozen=True)
class CalibrationConfig:
    """Configuration of a calibration."""

    settings: Settings  # settings of the simulation, including the noise model
    tool: Tool  # object of two materials, whose densities are replaced
    moves: bool  # True to hold the object in Drake, False to measure it at rest
    seed: int = 0  # root seed


class Calibration(NamedTuple):
    """Calibration of posteriors over N draws of M densities."""

    positions: Array  # posterior cumulative probability of each true density, (N, M)
    p_value: float  # chi-squared test of uniform positions: smallest p-value over densities, times M (Bonferroni)
    coverage: Array  # fraction of true densities in the central intervals of COVERAGES


@functools.cache
def get_hold(arm: Path) -> StaticHold:
    """Loads the static hold of an arm."""
    return StaticHold(load_arm(arm))


@functools.cache
def get_model(arm: Path) -> ArmModel:
    """Loads the internal model of an arm."""
    return ArmModel(load_arm(arm))


def load_stick() -> Tool:
    """Loads the novel object of Simulation III, whose two parts have the same shape."""
    return load_tools(MODELS / "tools" / "novel.yaml", load_materials(MODELS / "materials.yaml"))[0]


def build_config(noise: NoiseModel, *, moves: bool) -> CalibrationConfig:
    """Builds a configuration with the stick, the default settings, and a noise model."""
    tool = load_stick()
    return CalibrationConfig(replace(DEFAULT_SETTINGS, noise=noise), tool.gripped_by(tool.grips[0]), moves)


def draw_truth(config: CalibrationConfig, number: int) -> tuple[Array, Array]:
    """Draws positive mean densities and densities of the object, (M,) each, [kg/m^3].

    Draws with the same number are equal for all noise models, so that noise models can be compared pairwise.
    """
    prior = config.settings.prior
    rng = np.random.default_rng([config.seed, number, StudyStream.CALIBRATION_TRUTH])
    size = len(config.tool.components)
    mean = truncnorm(-prior.mode / prior.sd, np.inf, loc=prior.mode, scale=prior.sd).rvs(size, random_state=rng)
    own = truncnorm(-1.0 / prior.deviation, np.inf, loc=mean, scale=prior.deviation * mean).rvs(
        size, random_state=rng
    )
    return mean, own


class Learned(NamedTuple):
    """Posterior of an inexperienced observer after one trial."""

    belief: DensityBelief  # belief about the materials
    p_value: float  # predictive p-value of the measurements under the prior
    # Cramer-Rao bounds on the variances of the belief before truncation at zero, (M,), [(kg/m^3)^2].
    bound: Array


def learn(config: CalibrationConfig, own: Array, number: int) -> Learned:
    """Simulates one trial of an inexperienced observer.

    Args:
        config: Configuration.
        own: True densities of the object, (M,), [kg/m^3].
        number: Number of the draw.
    """
    settings = config.settings
    noise, prior = settings.noise, settings.prior
    colours = [part.looks_like.colour for part in config.tool.components]
    tool = config.tool.with_densities(dict(zip(colours, own, strict=True)))
    memory = MaterialMemory().add_colours(colours, prior)
    prediction = predict_object(measure_features(tool, VisionError(), np.random.default_rng(0)), memory, prior)
    Phi = prediction.geometry.Phi
    if config.moves:
        record = get_runner(settings).run_hold(tool, memory, duration=DURATION, seed=(config.seed, number))
        felt = feel_along(record, get_model(settings.arm), settings)
        bound = compute_bound(felt, Phi, own, noise, prior)
        return Learned(record.memory.belief, record.p_value, bound)
    hold = get_hold(settings.arm)
    statistics = hold.measure(prediction, own, noise, (config.seed, number, 1))  # same noise as in a simulated trial
    found = compute_posterior(prediction, statistics, len(hold.tau_arm), noise, prior.deviation)
    bound = compute_bound(feel_at_rest(hold.tau_arm, hold.Y, statistics.num_samples), Phi, own, noise, prior)
    return Learned(found.posterior.memory.belief, found.p_value, bound)


def run_draw(config: CalibrationConfig, number: int) -> dict[str, NDArray[Any]]:
    """Draws true densities, and computes their ranks in the posterior.

    Returns: Arrays by name, (M,) each except ``p_value``: ``mean``, true mean densities; ``own``, true densities of
        the object; ``rank``, ranks of the mean densities among NUM_SAMPLES samples of the posterior; ``sample_mean``,
        mean of these samples; ``centre`` and ``variance``, mean and variance of the posterior before truncation at
        zero; ``bound``, Cramer-Rao bound on this variance.
    """
    mean, own = draw_truth(config, number)
    belief, p_value, bound = learn(config, own, number)
    samples = belief.draw_samples(
        np.random.default_rng([config.seed, number, StudyStream.CALIBRATION_RANK]), NUM_SAMPLES
    )
    return {
        "mean": mean,
        "own": own,
        "rank": (samples < mean).sum(axis=0),
        "sample_mean": samples.mean(axis=0),
        "centre": belief.untruncated_mean,
        "variance": np.diag(belief.covariance),
        "bound": bound,
        "p_value": np.array(p_value),
    }


def assess(positions: Array) -> Calibration:
    """Computes coverage, and tests uniformity, given posterior cumulative probabilities of true densities, (N, M)."""
    counts = np.array([np.histogram(column, NUM_BINS, (0.0, 1.0))[0] for column in positions.T])
    p_value = min(1.0, len(counts) * min(float(chisquare(row).pvalue) for row in counts))
    covered = [(np.abs(positions - 0.5) <= 0.5 * coverage).mean() for coverage in COVERAGES]
    return Calibration(positions, p_value, np.array(covered))


def find_positions(arrays: Mapping[str, NDArray[Any]]) -> Array:
    """Converts ranks of the true densities to cumulative probabilities, (N, M)."""
    positions: Array = (arrays["rank"] + 0.5) / (NUM_SAMPLES + 1)
    return positions


def find_unrestricted_positions(arrays: Mapping[str, NDArray[Any]]) -> Array:
    """Computes cumulative probabilities of the true densities in posteriors without truncation at zero, (N, M)."""
    return np.asarray(norm.cdf(arrays["mean"], arrays["centre"], np.sqrt(arrays["variance"])))


def find_exact_positions(config: CalibrationConfig, draws: int) -> Array:
    """Computes cumulative probabilities of an object's densities in exact posteriors at rest, (draws, 2).

    The posterior is computed on a grid, with the noise variance at the torque of each grid point. Deviations of the
    object from the mean densities of its materials are neglected.

    Raises:
        ValueError: The noise is not Weber noise.
    """
    noise, prior = config.settings.noise, config.settings.prior
    if not isinstance(noise, WeberNoise):
        raise ValueError(f"noise is {noise}, must be a WeberNoise")
    hold = get_hold(config.settings.arm)
    memory = MaterialMemory().add_colours([part.looks_like.colour for part in config.tool.components], prior)
    features = measure_features(config.tool, VisionError(), np.random.default_rng(0))
    belief = predict_object(features, memory, prior)
    H = hold.Y @ belief.geometry.Phi  # (num_joints, 2)
    one, other = np.meshgrid(_GRID, _GRID, indexing="ij")
    predicted = hold.tau_arm[:, None, None] + H[:, :1, None] * one + H[:, 1:, None] * other
    variance = noise.threshold**2 + (noise.weber_fraction * predicted) ** 2
    log_prior = norm.logpdf(_GRID, prior.mode, np.hypot(prior.sd, prior.deviation * np.hypot(prior.mode, prior.sd)))
    constant = log_prior[:, None] + log_prior[None] - 0.5 * np.log(variance).sum(axis=0)
    half_step = 0.5 * (_GRID[1] - _GRID[0])
    positions = np.empty((draws, 2))
    for number in range(draws):
        _, own = draw_truth(config, number)
        statistics = hold.measure(belief, own, noise, (config.seed, number, 1))
        tau = statistics.features[: len(hold.tau_arm)]
        logs = constant - 0.5 * ((tau[:, None, None] - predicted) ** 2 / variance).sum(axis=0)
        weights = np.exp(logs - logs.max())
        for axis in range(2):
            marginal = weights.sum(axis=1 - axis)
            cumulative = np.concatenate([[0.0], np.cumsum(marginal)]) / marginal.sum()
            edges = np.concatenate([[_GRID[0] - half_step], _GRID + half_step])
            positions[number, axis] = np.interp(own[axis], edges, cumulative)
    return positions


def measure(folder: Path, *, draws: int = NUM_DRAWS, jobs: int) -> tuple[dict[str, Calibration], dict[str, Any]]:
    """Calibrates the loop for each noise model, and measures errors of approximations.

    Returns: Calibrations by name, and metrics.
    """
    settings = DEFAULT_SETTINGS
    arrays: dict[str, dict[str, NDArray[Any]]] = {}
    configs = {
        WEBER: build_config(settings.noise, moves=True),
        WHITE_NOISE: build_config(WHITE, moves=True),
        AT_REST: build_config(settings.noise, moves=False),
        CONSTANT: build_config(WeberNoise(0.0, WHITE.sd), moves=False),
    }
    for name, config in configs.items():
        arrays[name] = run_kept(config, run_draw, folder, MODELS, repeats=draws, jobs=jobs, description=name)
    positions = {name: find_positions(arrays[name]) for name in configs}
    positions[EXACT] = find_exact_positions(configs[AT_REST], draws)
    positions[IGNORING] = find_unrestricted_positions(arrays[WEBER])
    calibrations = {name: assess(each) for name, each in positions.items()}
    efficiency, against_error = {}, {}
    for name in configs:
        bounds = arrays[name]["bound"].mean(axis=0)
        efficiency[name] = float((bounds / arrays[name]["variance"].mean(axis=0)).mean())
        error = ((arrays[name]["sample_mean"] - arrays[name]["mean"]) ** 2).mean(axis=0)
        against_error[name] = float((bounds / error).mean())
    numbers = {
        # Both noise models together: smaller p-value times two (Bonferroni), and mean coverages.
        "sbc_p_value": min(1.0, 2.0 * min(calibrations[name].p_value for name in LOOPS)),
        **{
            f"coverage{round(100 * coverage)}": float(np.mean([calibrations[name].coverage[i] for name in LOOPS]))
            for i, coverage in enumerate(COVERAGES)
        },
        # Ratio that is further from 1 among both noise models.
        "efficiency_vs_cramer_rao": max((efficiency[name] for name in LOOPS), key=lambda ratio: abs(ratio - 1.0)),
        "calibration": {
            name: {"p_value": found.p_value, "coverage": found.coverage} for name, found in calibrations.items()
        },
        "efficiency": efficiency,
        "efficiency_of_squared_error": against_error,
        "position_shift_by_moving": float(np.abs(positions[WEBER] - positions[AT_REST]).max()),
        "improbable_by_chance": {name: int((arrays[name]["p_value"] < 1e-3).sum()) for name in LOOPS},
        "sbc_draws": draws,
    }
    return calibrations, numbers
