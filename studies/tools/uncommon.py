"""The paper's figure 1 in simulation: two uncommon objects are seen, ranked for mashing, moved and held.

The prediction for each object, from two pictures and experience with other objects, is then compared with the
simulated motion, and with the torques measured when the arm holds the object.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import plan_choice
from affordance.choice.options import Option
from affordance.choice.ranking import RankedOption, rank_options
from affordance.choice.reach import Reach
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.objects.tool import Tool, list_densities
from affordance.proprioception.estimator import TorqueStatistics
from affordance.proprioception.torque_noise import NoiseModel, WeberNoise
from affordance.settings import Settings
from affordance.simulation.rollout import roll_out
from affordance.simulation.trial import TrialRunner
from affordance.vision.eye import observe
from affordance.vision.features import FeatureSource
from affordance.vision.systems import predict_object
from studies.tools.holds import feel

_NUM_SAMPLES = 4000
# Number of samples; few of them keep weight if a hold contradicts the pictures.
_NUM_DRAWN = 200_000
_PERCENTILES = (5.0, 50.0, 95.0)
# Duration of the hold, [s].
_HOLD = 3.0


class CheckedMotion(NamedTuple):
    """Predicted and simulated cost of a motion with one option."""

    object_name: str
    grip: str  # name of the grip
    p_best_before: float  # probability that it is the cheapest option, without experience
    p_best: float  # probability that it is the cheapest option, after experience with the same materials
    p_feasible: float  # probability that it respects the torque limits, after that experience
    # Predicted work over feasible samples, 5th percentile, median and 95th, (3,), [J]; NaN if there are none.
    work: tuple[float, ...]
    simulated: float  # work in simulation, [J]
    error: float  # largest distance of the free end from the path, [m]


class CheckedMass(NamedTuple):
    """Predicted mass of an object, and the result of holding it."""

    object_name: str
    mass: float  # true mass, [kg]
    seen: tuple[float, ...]  # mass predicted from pictures: 5th percentile, median and 95th, (3,), [kg]
    held: tuple[float, ...]  # mass after the hold: 5th percentile, median and 95th, (3,), [kg]
    rise: float  # largest displacement of the object's centre during the hold, positive upwards, [m]
    p_value: float  # p-value of the measured torques under the prediction


def check_motions(
    tools: Sequence[Tool],
    options: Sequence[Option],
    task: Reach,
    beliefs: Mapping[str, MaterialMemory],
    settings: Settings,
    seed: int,
) -> list[CheckedMotion]:
    """Ranks options by ``beliefs["before"]`` and ``beliefs["after"]``, and simulates the motion with each of them.

    Returns:
        Options in the order in which they are chosen after experience.
    """
    choice = plan_choice(options, task, settings)
    before, after = (
        rank_options(choice, beliefs[name], np.random.default_rng([seed, *name.encode()]), _NUM_SAMPLES)
        for name in ("before", "after")
    )
    p_before = {each.option.name: each.p_best for each in before.ranked}
    checked = []
    for entry in after.ranked:
        tool = next(each for each in tools if each.name == entry.option.object_name)
        held = tool.list_gripped()[entry.option.grip]
        done = roll_out(held, task, list_densities([tool]), settings)
        checked.append(
            CheckedMotion(
                entry.option.object_name,
                entry.option.grip,
                p_before[entry.option.name],
                entry.p_best,
                entry.p_feasible,
                _take_percentiles(entry),
                done.work,
                done.error,
            )
        )
    return checked


def check_mass(tool: Tool, memory: MaterialMemory, settings: Settings, seed: int) -> CheckedMass:
    """Predicts an object's mass from pictures, simulates a hold, and updates the prediction on the measured torques.

    Samples of densities and of errors of vision are weighted by the likelihood of the measured torques. The object
    has one grip.
    """
    runner = TrialRunner(replace(settings, feature_source=FeatureSource.PIXELS))
    trial_seed = (seed, *tool.name.encode())
    record = runner.run_hold(tool, memory, duration=_HOLD, seed=trial_seed)
    felt = feel(runner, tool, memory, duration=_HOLD, seed=trial_seed)
    # Equal seeds give the pictures that were taken before that hold.
    features = observe(tool, FeatureSource.PIXELS, settings.vision_error, np.random.default_rng([*trial_seed, 0]))
    rng = np.random.default_rng([*trial_seed, 1])
    pi = predict_object(features, memory, settings.prior).draw_parameters(rng, _NUM_DRAWN)
    weights = weigh(pi, felt, settings.noise)
    order = np.argsort(pi[:, 0])
    share = np.cumsum(weights[order]) / weights.sum()
    held = pi[order, 0][np.searchsorted(share, np.array(_PERCENTILES) / 100.0)]
    height = record.height_centre
    return CheckedMass(
        tool.name,
        tool.mass,
        tuple(map(float, np.percentile(pi[:, 0], _PERCENTILES))),
        tuple(map(float, held)),
        float(height[np.argmax(np.abs(height))]),
        record.p_value,
    )


def weigh(pi: Array, felt: TorqueStatistics, noise: NoiseModel) -> Array:
    """Computes the likelihood of the measured torques for S tools of parameters pi, (S, 10), up to a factor, (S,).

    Raises:
        NotImplementedError: The noise is not Weber noise.
    """
    if not isinstance(noise, WeberNoise):
        raise NotImplementedError(f"no weights for noise of type {type(noise).__name__}")
    n = len(felt.features) // (2 + NUM_PARAMETERS)
    tau, tau_arm = felt.features[:n], felt.features[n : 2 * n]
    predicted = tau_arm + pi @ felt.features[2 * n :].reshape(n, NUM_PARAMETERS).T
    sd = noise.compute_sd(predicted)
    logs = -0.5 * (((tau - predicted) / sd) ** 2).sum(axis=1) - np.log(sd).sum(axis=1)
    weights: Array = np.exp(logs - logs.max())
    return weights


def _take_percentiles(entry: RankedOption) -> tuple[float, ...]:
    works = entry.works[np.isfinite(entry.works)]
    return tuple(map(float, np.percentile(works, _PERCENTILES))) if len(works) else (float("nan"),) * 3
