"""Calibration of what is believed of a material after one object of it was held again and again.

``measure_repeats()`` returns the numbers ``repeat_z`` and ``repeat_z_anew`` of the study of active choice, each by
material: the root mean square of z, the error of the believed mean density over its standard deviation, over
observers who hold one piece of stock ten times. 1 is right; 2 is an interval of half the width that it should have.
``repeat_z`` is that of a lasting memory, which sums the likelihoods of an object before its deviation from its
material is marginalised, once; ``repeat_z_anew`` that of an observer within a simulation, who counts the deviation
anew at each hold.
"""

from collections.abc import Callable, Sequence

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.files.model_folder import MODELS
from affordance.memory.evidence_sums import sum_objects
from affordance.memory.trial_evidence import TrialEvidence
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import TorqueStatistics, condition_on_torques
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.eye import measure_drawing
from affordance.vision.systems import predict_object

# A deviation leaves at least this share of a density.
_LEAST = 0.3
# Function from all holds of one object to the belief about its material.
type _Learn = Callable[[Sequence[TrialEvidence], Tool, Settings], DensityBelief]


def measure_repeats(num_observers: int = 2000, num_holds: int = 10, seed: int = 0) -> dict[str, dict[str, float]]:
    """Measures the calibration after a number of holds of one piece, for each material of our stock.

    Returns: ``repeat_z`` and ``repeat_z_anew``, each a mapping from names of materials to the root mean square of z.
    """
    settings = DEFAULT_SETTINGS
    static = StaticHold(load_arm(settings.arm))
    found: dict[str, dict[str, float]] = {"repeat_z": {}, "repeat_z_anew": {}}
    learners: dict[str, _Learn] = {"repeat_z": _learn_once, "repeat_z_anew": _learn_anew}
    for number, piece in enumerate(load_tools(MODELS / "workshop" / "blanks.yaml", load_materials())):
        material = piece.components[0].material
        squares = dict.fromkeys(learners, 0.0)
        for observer in range(num_observers):
            rng = np.random.default_rng([seed, number, observer, 41])
            rho = material.density + settings.prior.deviation_sd * rng.standard_normal()
            trials = hold(piece, max(rho, _LEAST * material.density), static, settings, num_holds, rng)
            for name, learn in learners.items():
                belief = learn(trials, piece, settings)
                z = (belief.untruncated_mean[0] - material.density) / np.sqrt(belief.covariance[0, 0])
                squares[name] += float(z) ** 2
        for name, total in squares.items():
            found[name][material.name] = float(np.sqrt(total / num_observers))
    return found


def hold(
    piece: Tool, rho: float, static: StaticHold, settings: Settings, num_holds: int, rng: np.random.Generator
) -> list[TrialEvidence]:
    """Holds a piece of one material and density rho, [kg/m^3], at rest, each time with errors of its own."""
    features = measure_drawing(piece)
    belief = predict_object(features, MaterialMemory(), settings.prior)
    parts = tuple(part.appearance for part in features)
    trials = []
    for _ in range(num_holds):
        seed = (int(rng.integers(2**31)),)
        felt = static.measure(belief, np.array([rho]), settings.noise, seed)
        trials.append(
            TrialEvidence(
                piece.name,
                parts,
                belief.geometry,
                settings.noise,
                felt.features,
                felt.num_samples,
                len(static.tau_arm),
                "arm",
            )
        )
    return trials


def _learn_once(trials: Sequence[TrialEvidence], piece: Tool, settings: Settings) -> DensityBelief:
    return sum_objects([trials], settings.prior).build_belief()


def _learn_anew(trials: Sequence[TrialEvidence], piece: Tool, settings: Settings) -> DensityBelief:
    belief = predict_object(measure_drawing(piece), MaterialMemory(), settings.prior)
    for trial in trials:
        statistics = TorqueStatistics(trial.features, trial.num_samples)
        deviation_sd = settings.prior.deviation_sd
        posterior, _ = condition_on_torques(belief, statistics, trial.num_joints, settings.noise, deviation_sd)
        belief = predict_object(measure_drawing(piece), posterior.memory, settings.prior)
    return belief.memory.belief
