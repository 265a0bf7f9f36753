"""Compares methods with those of the workshop tools' authors, on their simulated records, noise and measures.

The error measures are the authors': the error of the mass relative to the mass; of the centre of mass relative to the
lengths of the bounding box, mean of three; of the rotational inertia about the sensor relative to that of a
homogeneous box, mean of six. The authors' program rounds errors of the centre of mass down to whole per cents; here
they are not rounded.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.exceptions import BadValueError
from affordance.files.bounded import MESH, read_text
from affordance.objects.inertia import build_inertia_map, build_transform_map, parameters_from_pseudo_inertia
from affordance.objects.tool import Tool
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import CAD_VOLUME_SD
from studies.tools.data_set import DataSet, TrueInertia, compute_central_inertia
from studies.tools.record_file import Recording, read_pickle, read_recording
from studies.tools.record_methods import (
    NOISES,
    Measured,
    Noise,
    PointParts,
    add_noise,
    infer_densities,
    solve_at_rest,
    solve_least_squares,
)

# Names of the noise levels in the authors' results.
_STORED_NOISES = {"none": "No", "low": "Low", "moderate": "Mod", "high": "High"}
# Largest variation of the tool's pose in the sensor's frame for which the tool counts as rigidly held.
_HELD = 1e-5
_NUM_SAMPLES = 2000
# Seeds of the independent draws of the noise.
SEEDS = (0, 1, 2)


class Errors(NamedTuple):
    """Errors of one estimate, as fractions, and 1 if the 90 % interval contains the true mass (NaN without one)."""

    mass: float
    com: float
    inertia: float
    coverage_mass: float


class Subject(NamedTuple):
    """Tool with its record."""

    recording: Recording  # record of the sensor
    pi: Array  # true parameters about So, expressed in S, shape (10,)
    box: Array  # lengths of the bounding box along Sx, Sy, Sz, shape (3,), [m]
    Phi: Array  # parameters of each material at 1 kg/m^3, from the drawing, shape (10, M)
    parts: PointParts  # parts as segmented by the authors


def load_subject(data: DataSet, name: str) -> Subject:
    """Loads a tool and its record."""
    recording = read_recording(data.find_simulation(name))
    X_SF = np.linalg.inv(recording.X_WS) @ recording.X_WF
    if np.abs(X_SF - X_SF[0]).max() > _HELD:
        raise BadValueError(data.find_simulation(name), "", "moves the tool in the hand, must hold it rigidly")
    p_FQ, volumes, part = read_parts(data.find_segmentation(name))
    box = np.abs(X_SF[0][:3, :3] @ (p_FQ.max(axis=0) - p_FQ.min(axis=0)))
    transform = build_transform_map(X_SF[0])
    parts = PointParts(p_FQ @ X_SF[0][:3, :3].T + X_SF[0][:3, 3], volumes, part)
    pi = transform @ _list_parameters(data.read_truth(name))
    return Subject(recording, pi, box, transform @ _map_materials(data.tools[name]), parts)


def compare_methods(
    data: DataSet, name: str, prior: Prior = DEFAULT_SETTINGS.prior
) -> dict[str, dict[str, list[Errors]]]:
    """Computes the errors of every method at every noise level for one tool, with one entry per draw of the noise."""
    subject = load_subject(data, name)
    found: dict[str, dict[str, list[Errors]]] = {}
    for noise_name, noise in NOISES.items():
        methods: dict[str, list[Errors]] = {}
        for seed in SEEDS:
            rng = np.random.default_rng([seed, *noise_name.encode(), *name.encode()])
            measured = add_noise(subject.recording, noise, rng)
            for method, errors in _apply_methods(subject, measured, noise, prior, rng).items():
                methods.setdefault(method, []).append(errors)
        found[noise_name] = methods
    return found


def measure_errors(pi: Array, subject: Subject, covered: float = float("nan")) -> Errors:
    """Computes the authors' error measures of estimated parameters, shape (10,)."""
    true = subject.pi
    com = np.abs(pi[1:4] / pi[0] - true[1:4] / true[0]) / subject.box
    a, b, c = subject.box
    squares = a**2 + b**2 + c**2
    box_inertia = true[0] / 12.0 * np.array([squares - a**2, squares - b**2, squares - c**2, a * b, a * c, b * c])
    inertia = np.abs(pi[4:] - true[4:]) / box_inertia
    return Errors(abs(float(pi[0] / true[0]) - 1.0), float(com.mean()), float(inertia.mean()), covered)


def read_stored(data: DataSet) -> dict[str, dict[str, Errors]]:
    """Reads the errors that the authors stored, by noise and method: means over the tools, as fractions.

    Raises:
        BadValueError: A file is missing, or contains something else.
    """
    path, rows = data.stored_results, read_pickle(data.stored_results)
    names = {name.replace(" ", "_") for name in data.tools}
    try:
        rows = [row for row in rows if row[0] in names]
        return {
            noise: {
                f"{method.lower()}_stored": _average_stored(
                    [row[4] for row in rows if row[1] == method and row[2] == stored]
                )
                for method in ("HPS", "OLS", "GEO")
            }
            for noise, stored in _STORED_NOISES.items()
        }
    except (TypeError, IndexError, ValueError) as error:
        raise BadValueError(path, "", f"is not a table of results: {error}") from error


def _average_stored(percentages: Sequence[Sequence[float]]) -> Errors:
    mass, com, inertia = np.mean(percentages, axis=0) / 100.0
    return Errors(mass, com, inertia, float("nan"))


def read_parts(path: Path) -> tuple[Array, Array, Array]:
    """Reads a point cloud: points (P, 3), [m], their volumes, (P,), [m^3], and the indices of their parts, (P,).

    Raises:
        BadValueError: The file cannot be read, or has no such columns.
    """
    header, _, body = read_text(path, MESH).partition("end_header\n")
    names = [line.split()[-1] for line in header.splitlines() if line.startswith("property")]
    missing = [name for name in ("x", "y", "z", "volume", "segmentation") if name not in names]
    if missing:
        raise BadValueError(path, "", f"has no property {missing[0]}, must be a point cloud with volumes and parts")
    try:
        table = np.array([line.split() for line in body.splitlines() if line.strip()], dtype=float)
        x, y, z, volume, part = (table[:, names.index(name)] for name in ("x", "y", "z", "volume", "segmentation"))
    except (ValueError, IndexError) as error:
        raise BadValueError(path, "", f"is not a table of numbers: {error}") from error
    return np.column_stack([x, y, z]), volume, part


def _apply_methods(
    subject: Subject, measured: Measured, noise: Noise, prior: Prior, rng: np.random.Generator
) -> Mapping[str, Errors]:
    of_parts = subject.parts.build_inertia_map()
    found = {
        "ols": measure_errors(solve_least_squares(measured), subject),
        "hps": measure_errors(solve_at_rest(measured, of_parts), subject),
    }
    for method, Phi in (("ours", subject.Phi), ("ours_hps_parts", of_parts)):
        belief = infer_densities(measured, Phi, noise, prior)
        masses = belief.draw_samples(rng, _NUM_SAMPLES) @ Phi[0]
        masses *= 1.0 + CAD_VOLUME_SD * rng.standard_normal(_NUM_SAMPLES)
        low, high = np.percentile(masses, [5.0, 95.0])
        found[method] = measure_errors(Phi @ belief.compute_mean(), subject, float(low <= subject.pi[0] <= high))
    return found


def _map_materials(tool: Tool) -> Array:
    """Computes the parameters of each material at 1 kg/m^3, in the frame of the tool's file, shape (10, M)."""
    names = list(dict.fromkeys(part.material.name for part in tool.components))
    return build_inertia_map(
        [part.shape for part in tool.components],
        [part.X_TE for part in tool.components],
        [names.index(part.material.name) for part in tool.components],
        len(names),
    )


def _list_parameters(truth: TrueInertia) -> Array:
    """Computes the ten parameters in the frame of the mesh, shape (10,)."""
    J = np.zeros((4, 4))
    J[:3, :3] = 0.5 * np.trace(truth.I_BBcm_F) * np.eye(3) - truth.I_BBcm_F
    J[3, 3] = truth.mass
    X = np.eye(4)
    X[:3, 3] = truth.p_FBcm
    pi: Array = parameters_from_pseudo_inertia(X @ J @ X.T)
    assert np.allclose(compute_central_inertia(pi), truth.I_BBcm_F)
    return pi
