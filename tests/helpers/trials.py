"""Trials of simple objects, as a ledger keeps them: point masses of some colours, held by an imaginary arm."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Quadratic
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.memory.trial_evidence import PayloadQuadratic, TrialEvidence, pack
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import is_colour, parse_colour
from affordance.objects.inertia import Geometry, compute_point_parameters
from affordance.objects.materials import load_materials
from affordance.proprioception.torque_noise import NoiseModel, WeberNoise

WOOD, STEEL, BRASS = (0.7, 0.5, 0.3), (0.5, 0.5, 0.5), (0.8, 0.6, 0.1)
# One absolute error for all torques, with which everything is linear and normal.
PLAIN = WeberNoise(weber_fraction=0.0, threshold=0.1)
_VOLUME = 1e-3
_Y = np.random.default_rng(7).standard_normal((7, 10))
TAU_ARM = np.linspace(2.0, 30.0, 7)


def build_geometry(num_parts: int, num_errors: int = 0) -> Geometry:
    """Builds the geometry of parts of equal volume along x, each of whose sizes may err by a tenth."""
    centres = np.array([[0.1 + 0.1 * i, 0.02 * i, 0.0] for i in range(num_parts)])
    Phi = _VOLUME * compute_point_parameters(centres).T
    errors = np.zeros((num_errors, 10, num_parts))
    for i in range(num_errors):
        errors[i, :, i % num_parts] = 0.1 * Phi[:, i % num_parts]
    return Geometry(Phi, errors)


def hold(
    name: str,
    colours: Sequence[tuple[float, float, float]],
    rho: Sequence[float],
    seed: int,
    *,
    model: NoiseModel = PLAIN,
    num_errors: int = 0,
    robot: str = "arm",
) -> TrialEvidence:
    """Simulates a trial with an object of parts of these colours and true densities, at the second of its seed."""
    geometry = build_geometry(len(colours), num_errors)
    rng = np.random.default_rng([11, seed])
    tau = TAU_ARM + _Y @ geometry.Phi @ np.array(rho)
    tau = tau + model.compute_sd(tau) * rng.standard_normal(7)
    parts = tuple(
        PartAppearance(colour, (0.05, 0.05, 0.05), (0.1 + 0.1 * i, 0.02 * i, 0.0)) for i, colour in enumerate(colours)
    )
    return TrialEvidence(
        object_name=name,
        parts=parts,
        geometry=geometry,
        model=model,
        features=model.compute_features(tau, TAU_ARM, _Y),
        num_samples=1,
        num_joints=7,
        robot=robot,
        fingerprint=f"{robot} 1",
        time=f"2026-01-{1 + seed // 86400:02d}T{seed // 3600 % 24:02d}:{seed // 60 % 60:02d}:{seed % 60:02d}Z",
        source="simulated",
    )


def hold_workshop(count: int) -> list[TrialEvidence]:
    """Simulates trials with three things, one after the other."""
    things = (("bar", (WOOD,), (600.0,)), ("rod", (STEEL,), (7800.0,)), ("hammer", (WOOD, STEEL), (650.0, 7700.0)))
    return [hold(*things[i % 3], seed=i, robot="arm" if i % 2 else "other") for i in range(count)]


def get_regressor() -> Array:
    """Returns the payload regressor of all trials, shape (7, 10)."""
    return _Y


def write_known(path: Path, densities: Mapping[str, float], *, name: str = "stock", things: int = 100) -> Path:
    """Writes the lasting memory of an observer who held many things of each material, each weighed to 1 kg/m^3.

    Keys of the densities are names of materials or colours as "#b07a45"; what is in the memory stays.
    """
    trials = []
    for key, rho in densities.items():
        colour = parse_colour(key) if is_colour(key) else load_materials()[key].colour
        geometry = build_geometry(1)
        inverse = np.linalg.pinv(geometry.Phi)
        H = inverse.T @ inverse  # a precision of 1 (kg/m^3)^-2
        features = pack(Quadratic(H, H @ geometry.Phi @ [rho]))
        for number in range(things):
            part = PartAppearance(colour, (1.0 + 0.01 * number,), (0.0, 0.0, 0.0))
            thing = f"{name} {number}" if number else name
            trials.append(TrialEvidence(thing, (part,), geometry, PayloadQuadratic(), features, 1, 1, "arm"))
    with open_memory(path) as ledger:
        ledger.append(trials)
    return path
