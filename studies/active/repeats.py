"""Calibration of the belief about a material after one object made of it was held repeatedly.

The study of active choice reports ``repeat_z`` and its relatives for each material. They are root mean squares of z,
the error of the believed mean density divided by its standard deviation, over observers that hold one piece of stock
ten times. 1 is exact calibration; 2 means intervals of half the required width. ``repeat_z`` is for a lasting memory,
and ``repeat_z_observers`` for observers in a simulation, by their learner. ``repeat_z_anew`` is a control: the
observer forgets each object after its hold, and so counts its deviation from its material again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.belief.density_belief import DensityBelief
from affordance.belief.learner import Learner
from affordance.belief.learners import DENSITY, LEARNERS
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.files.model_folder import MODELS
from affordance.memory.evidence_sums import sum_trials
from affordance.memory.trial_evidence import TrialEvidence
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import TorqueStatistics, condition_on_torques
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.eye import measure_drawing
from affordance.vision.features import ComponentFeatures
from affordance.vision.systems import predict_object
from studies.active.world import deviate, make_stock

# Function that takes all holds of one object, and returns the belief about its material.
type _Learn = Callable[[Sequence[TrialEvidence], Sequence[ComponentFeatures], Settings], DensityBelief]


@dataclass(frozen=True)
class RepeatsConfig:
    """Configuration of observers that hold one piece repeatedly."""

    num_observers: int = 100  # number of observers in a block
    num_holds: int = 10  # number of holds for each observer
    seed: int = 0  # root of every random draw


def run_block(config: RepeatsConfig, block: int) -> dict[str, NDArray[Any]]:
    """Runs a block of observers; returns each learner's errors divided by their SDs, (observers, materials)."""
    settings = DEFAULT_SETTINGS
    static = StaticHold(load_arm(settings.arm))
    pieces = load_stock()
    found = {name: np.zeros((config.num_observers, len(pieces))) for name in _LEARNERS}
    for number, piece in enumerate(pieces):
        material, features = piece.components[0].material, measure_drawing(piece)
        for observer in range(config.num_observers):
            rng = np.random.default_rng([config.seed, number, config.num_observers * block + observer, 41])
            (rho,) = deviate([material.density], settings.prior.deviation, rng)
            trials = hold(piece, float(rho), static, settings, config.num_holds, rng)
            for name, learn in _LEARNERS.items():
                belief = learn(trials, features, settings)
                sd = np.sqrt(belief.covariance[0, 0])
                found[name][observer, number] = (belief.untruncated_mean[0] - material.density) / sd
    return found


def describe_repeats(found: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Computes the root mean square over all blocks for each material, and its extremes except for the control."""
    names = [piece.components[0].material.name for piece in load_stock()]
    z = {
        name: dict(zip(names, np.sqrt(np.mean(values**2, axis=(0, 1))).tolist(), strict=True))
        for name, values in found.items()
    }
    observers = {learner.name: z[learner.name] for learner in LEARNERS.values()}
    values = [value for each in (z["repeat_z"], *observers.values()) for value in each.values()]
    return {
        "repeat_z": z["repeat_z"],
        "repeat_z_observers": observers,
        "repeat_z_anew": z["repeat_z_anew"],
        "repeat_z_least": min(values),
        "repeat_z_largest": max(values),
    }


def load_stock() -> tuple[Tool, ...]:
    """Loads one piece of each material: the workshop's stock, and rods of the materials that are missing there."""
    materials = load_materials()
    stock = load_tools(MODELS / "workshop" / "blanks.yaml", materials)
    shown = {part.material.name for piece in stock for part in piece.components}
    others = [each for name, each in materials.items() if name not in shown]
    return (*stock, *(make_stock(stock[1], "rod", each) for each in others))


def hold(
    piece: Tool, rho: float, static: StaticHold, settings: Settings, num_holds: int, rng: np.random.Generator
) -> list[TrialEvidence]:
    """Holds a piece of one material with density rho, [kg/m^3], at rest, with new errors in each hold."""
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


def _sum_up(
    trials: Sequence[TrialEvidence], features: Sequence[ComponentFeatures], settings: Settings
) -> DensityBelief:
    return sum_trials(trials, settings.prior).build_belief()


def _observe(
    learner: Learner,
    remembers_objects: bool,
    trials: Sequence[TrialEvidence],
    features: Sequence[ComponentFeatures],
    settings: Settings,
) -> DensityBelief:
    memory = start_memory(learner)
    for trial in trials:
        belief = predict_object(features, memory, settings.prior)
        statistics = TorqueStatistics(trial.features, trial.num_samples)
        posterior, _ = condition_on_torques(
            belief, statistics, trial.num_joints, settings.noise, settings.prior.deviation
        )
        memory = posterior.memory
        if not remembers_objects:
            memory = MaterialMemory.from_belief(memory.colours, memory.belief)
    return memory.belief


_LEARNERS: Mapping[str, _Learn] = {
    "repeat_z": _sum_up,
    **{learner.name: partial(_observe, learner, True) for learner in LEARNERS.values()},
    "repeat_z_anew": partial(_observe, DENSITY, False),
}
