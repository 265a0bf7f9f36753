"""How the proportion of correct choices depends on what is assumed: noise, prior, and what stands for a belief."""

from dataclasses import dataclass, replace
from pathlib import Path

import joblib
import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import PointEstimate
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory import Memory
from affordance.choice.ranking import Choice, pick_cheapest
from affordance.experiments.shared.decisions import count_correct
from affordance.experiments.shared.experience import ExperienceConfig, draw_order
from affordance.objects.tool import list_densities
from affordance.plant.arm import load_arm
from affordance.proprioception.estimator import compute_posterior
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.torque_noise import WeberNoise
from affordance.random_streams import Stream
from affordance.reporting import figures
from affordance.reporting.report import Picture
from affordance.settings import Settings
from affordance.vision.features import measure_features
from affordance.vision.visual_prior import predict_object

NAME = "sensitivity"
PICTURE = Picture(
    f"{NAME}.png",
    "How correct choices depend on what is assumed, one thing at a time: noise, prior, and the density that stands "
    "for the belief. Observers here feel objects at rest and without a fault; black is what all simulations use.",
)
# Observers of the study, at most.
MAX_STUDIED = 200


@dataclass(frozen=True)
class Assumption:
    """One point of the sensitivity study.

    Attributes:
        panel: What is varied.
        label: Its value.
        settings: All settings.
        point_estimate: Which density stands for the belief in the choice.
    """

    panel: str
    label: str
    settings: Settings
    point_estimate: PointEstimate = PointEstimate.SAMPLE


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
    for point_estimate in PointEstimate:
        label = (
            f"{point_estimate.value} {BASELINE}" if point_estimate is PointEstimate.SAMPLE else point_estimate.value
        )
        assumptions.append(Assumption("point of the belief", label, settings, point_estimate))
    return assumptions


def _vary(panel: str, label: str, factor: float, settings: Settings) -> Assumption:
    return Assumption(panel, f"{label} {BASELINE}" if factor == 1.0 else label, settings)


def study(
    experience: ExperienceConfig, choice: Choice, correct: int, *, repeats: int, jobs: int
) -> dict[str, dict[str, Array]]:
    """Computes how the proportion of correct choices depends on what is assumed.

    Observers feel the objects at rest, without simulating the holds (static_hold.py); motions are those of the
    settings in use, as neither noise nor prior moves them.

    Args:
        experience: How experience is gained.
        choice: The choice.
        correct: Index of the correct option.
        repeats: Observers of the experiment; so many for each assumption, but MAX_STUDIED at most.
        jobs: Processes.

    Returns: Panels of curves by label, (K + 1,) each.
    """
    repeats, assumptions = min(repeats, MAX_STUDIED), list_assumptions(experience.settings)
    parallel = joblib.Parallel(n_jobs=min(jobs, len(assumptions)))  # joblib starts as many as it is told
    found = parallel(joblib.delayed(_learn_under)(experience, assumption, repeats) for assumption in assumptions)
    panels: dict[str, dict[str, Array]] = {}
    for assumption, observers in zip(assumptions, found, strict=True):
        costs = choice.compute_costs(
            np.concatenate([choice.compute_parameters(memory, rho[None]) for memory, rho in observers], axis=1)
        )
        chosen = pick_cheapest(costs, np.random.default_rng([experience.seed, Stream.STATIC])).reshape(repeats, -1)
        panels.setdefault(assumption.panel, {})[assumption.label] = count_correct(chosen, correct) / repeats
    return panels


def _learn_under(experience: ExperienceConfig, assumption: Assumption, repeats: int) -> list[tuple[Memory, Array]]:
    """Memories of all observers before the first and after each trial, and the densities chosen by, (M,)."""
    settings = assumption.settings
    arm = load_arm(settings.arm)
    hold = StaticHold(arm)
    unknown: Memory = MaterialMemory().add_colours(experience.colours, settings.prior)
    densities = list_densities(experience.tools)
    true = np.array([densities[look] for look in experience.colours])
    moments: list[tuple[Memory, Array]] = []
    for repeat in range(repeats):
        seed = (experience.seed, repeat, Stream.STATIC)
        rng = np.random.default_rng(seed)
        memory = unknown
        moments.append((memory, _choose_densities(memory, assumption, rng)))
        for trial, index in enumerate(draw_order(experience, repeat)):
            features = measure_features(experience.tools[index], settings.vision_error, rng)
            belief = predict_object(features, memory, settings.prior)
            # From 1, as a seed that ends in 0 gives the numbers of the same seed without it.
            statistics = hold.measure(belief, true, settings.noise, (*seed, 1 + trial))
            inference = compute_posterior(
                belief, statistics, arm.num_joints, settings.noise, settings.prior.deviation_sd
            )
            memory = inference.posterior.memory
            moments.append((memory, _choose_densities(memory, assumption, rng)))
    return moments


def _choose_densities(memory: Memory, assumption: Assumption, rng: np.random.Generator) -> Array:
    object_belief = memory.belief.add_object_variation(assumption.settings.prior.deviation_sd)
    return object_belief.compute_point_estimate(assumption.point_estimate, rng)


def save_drawing(panels: dict[str, dict[str, Array]], folder: Path, repeats: int) -> None:
    """Draws what the study found into a folder.

    Args:
        panels: See ``study``.
        folder: Receives ``sensitivity.png`` and ``sensitivity.svg``.
        repeats: Observers of the experiment.
    """
    figure = figures.draw_sensitivity(panels, baseline=BASELINE, num_repeats=min(repeats, MAX_STUDIED))
    figures.save_figure(figure, folder, NAME)
