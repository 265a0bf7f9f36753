"""Random payloads on a flange: two or three boxes in a row, from foam to steel."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import parameters_from_pseudo_inertia

# Edges across and along the row, [m], and densities, [kg/m^3], both log-uniform; offsets across the row, [m].
_LEAST_EDGES, _LARGEST_EDGES = (0.015, 0.015, 0.02), (0.15, 0.15, 0.18)
_DENSITIES = (300.0, 8000.0)
_OFFSET = 0.03
# A payload is drawn again until its mass differs from the drawn mass by at most a quarter.
_TOLERANCE = 0.25


class RandomPayload(NamedTuple):
    """Payload at the flange, whose z axis points outward."""

    parameters: Array  # inertial parameters, shape (10,)
    Phi: Array  # inertial parameters of each box at 1 kg/m^3, shape (10, M)
    low: Array  # lower corner of the bounding box, shape (3,), [m]
    high: Array  # upper corner of the bounding box, shape (3,), [m]


def draw_payload(rng: np.random.Generator, masses: tuple[float, float]) -> RandomPayload:
    """Draws a payload with a log-uniform mass between the given bounds, [kg]."""
    mass = np.exp(rng.uniform(np.log(masses[0]), np.log(masses[1])))
    while True:
        angle, z = rng.uniform(0.0, 2.0 * np.pi), 0.0
        R = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        columns, corners = [], []
        for _ in range(rng.integers(2, 4)):
            edges = np.exp(rng.uniform(np.log(_LEAST_EDGES), np.log(_LARGEST_EDGES)))
            centre = np.array([*rng.uniform(-_OFFSET, _OFFSET, 2), z + edges[2] / 2.0])
            columns.append(_build_column(edges, centre, R))
            reach = np.abs(R) @ (edges / 2.0)
            corners += [centre - reach, centre + reach]
            z += edges[2]
        Phi = np.column_stack(columns)
        rho = np.exp(rng.uniform(np.log(_DENSITIES[0]), np.log(_DENSITIES[1]), Phi.shape[1]))
        if abs(float(Phi[0] @ rho) / mass - 1.0) < _TOLERANCE:
            return RandomPayload(Phi @ rho, Phi, np.min(corners, axis=0), np.max(corners, axis=0))


def _build_column(edges: Array, centre: Array, R: Array) -> Array:
    """Computes the inertial parameters of a box at a density of 1 kg/m^3."""
    volume = float(np.prod(edges))
    J = np.zeros((4, 4))
    J[:3, :3] = volume * (R @ np.diag(edges**2 / 12.0) @ R.T + np.outer(centre, centre))
    J[:3, 3] = J[3, :3] = volume * centre
    J[3, 3] = volume
    return parameters_from_pseudo_inertia(J)
