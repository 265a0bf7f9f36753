"""Random solids that a hand could hold, of four kinds, from which the prior of held bodies is made."""

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import parameters_from_pseudo_inertia

# All sizes and densities log-uniform, all directions alike:
# - assemblies of one to three boxes, each edge from 1 to 30 cm and each density from 100 to 8000 kg/m^3: from foam to
#   steel, from a pen to a drawer; within 15 cm (one SD) of the tip and 7 cm of one another;
# - compact boxes with edges of 2 to 20 cm, within 10 cm;
# - rods of 8 to 80 cm, 3 to 25 mm thick, held anywhere within 4 cm of the tip;
# - handles of 8 to 50 cm with a head of any share of the mass, edges of 1 to 30 cm, held in the nearer half: hammers,
#   ladles, pans and brushes.
_ASSEMBLY_EDGES, _DENSITIES = (0.01, 0.30), (100.0, 8000.0)
_REACH_SD, _SPREAD_SD = 0.15, 0.07
_COMPACT_EDGES, _COMPACT_SD = (0.02, 0.20), 0.10
_ROD_LENGTHS, _ROD_RADII, _HELD_SD = (0.08, 0.80), (0.003, 0.025), 0.04
_HANDLE_LENGTHS, _HANDLE_RADII, _HEAD_EDGES = (0.08, 0.50), (0.005, 0.02), (0.01, 0.30)
# Masses from a pencil case to the payload of a large robot, [kg].
_MASSES = (0.02, 10.0)
_NUM_SOLIDS = 4000  # of each kind


def draw_random_solids(rng: np.random.Generator) -> tuple[Array, ...]:
    """Draws solids of each kind: assemblies, compact boxes, rods, and handles with a head; (N, 10) each."""
    return _draw_assemblies(rng), _draw_compact(rng), _draw_rods(rng), _draw_handled(rng)


def _draw_assemblies(rng: np.random.Generator) -> Array:
    """Draws assemblies of one to three boxes, ten parameters each, (N, 10)."""
    shape = (_NUM_SOLIDS, 3)
    edges = _draw_log_uniform(rng, _ASSEMBLY_EDGES, (*shape, 3))
    present = np.arange(3) < rng.integers(1, 4, _NUM_SOLIDS)[:, None]
    masses = present * edges.prod(axis=2) * _draw_log_uniform(rng, _DENSITIES, shape)
    centres = _REACH_SD * rng.standard_normal((_NUM_SOLIDS, 1, 3)) + _SPREAD_SD * rng.standard_normal((*shape, 3))
    R, _ = np.linalg.qr(rng.standard_normal((*shape, 3, 3)))
    second = R * (edges**2 / 12.0)[..., None, :] @ R.swapaxes(-1, -2)
    return _assemble(rng, masses, centres, second)


def _draw_compact(rng: np.random.Generator) -> Array:
    """Draws boxes, ten parameters each, (N, 10)."""
    edges = _draw_log_uniform(rng, _COMPACT_EDGES, (_NUM_SOLIDS, 1, 3))
    centres = _COMPACT_SD * rng.standard_normal((_NUM_SOLIDS, 1, 3))
    return _turn(rng, np.ones((_NUM_SOLIDS, 1)), np.zeros_like(centres), edges**2 / 12.0, centres)


def _draw_rods(rng: np.random.Generator) -> Array:
    """Draws rods along x before they are turned, ten parameters each, (N, 10)."""
    length = _draw_log_uniform(rng, _ROD_LENGTHS, (_NUM_SOLIDS, 1))
    second = _measure_cylinder(length, _draw_log_uniform(rng, _ROD_RADII, (_NUM_SOLIDS, 1)))
    along = rng.uniform(-0.5, 0.5, (_NUM_SOLIDS, 1)) * length
    held = _HELD_SD * rng.standard_normal((_NUM_SOLIDS, 1, 3))
    return _turn(rng, np.ones((_NUM_SOLIDS, 1)), along[..., None] * np.eye(3)[0], second, held)


def _draw_handled(rng: np.random.Generator) -> Array:
    """Draws handles along x with a head at their end before they are turned, ten parameters each, (N, 10)."""
    shape = (_NUM_SOLIDS, 1)
    length = _draw_log_uniform(rng, _HANDLE_LENGTHS, shape)
    handle = _measure_cylinder(length, _draw_log_uniform(rng, _HANDLE_RADII, shape))
    edges = _draw_log_uniform(rng, _HEAD_EDGES, (*shape, 3))
    grip = rng.uniform(0.0, 0.5, shape) * length
    along = np.concatenate([0.5 * length - grip, length - grip + 0.5 * edges[..., 0]], axis=1)
    head = rng.uniform(0.0, 1.0, shape)
    second = np.concatenate([handle, edges**2 / 12.0], axis=1)
    held = _HELD_SD * rng.standard_normal((*shape, 3))
    return _turn(rng, np.hstack([1.0 - head, head]), along[..., None] * np.eye(3)[0], second, held)


def _measure_cylinder(length: Array, radius: Array) -> Array:
    """Computes the mean squares of the coordinates of a cylinder along x, shape (N, 1, 3), from (N, 1) each."""
    return np.stack([length**2 / 12.0, radius**2 / 4.0, radius**2 / 4.0], axis=-1)


def _turn(rng: np.random.Generator, masses: Array, centres: Array, squares: Array, held: Array) -> Array:
    """Turns solids of P parts along common axes, and holds them; see ``_assemble``.

    Mean squares of the coordinates of each part about its centre are (N, P, 3), [m^2], the place of the solid's
    origin in the tip is (N, 1, 3), [m].
    """
    R, _ = np.linalg.qr(rng.standard_normal((_NUM_SOLIDS, 1, 3, 3)))
    second = R * squares[..., None, :] @ R.swapaxes(-1, -2)
    return _assemble(rng, masses, (R @ centres[..., None])[..., 0] + held, second)


def _assemble(rng: np.random.Generator, masses: Array, centres: Array, second: Array) -> Array:
    """Builds the ten parameters of solids of P parts, and draws their masses, shape (N, 10).

    Relative masses are (N, P), centres (N, P, 3), [m], second moments about them over the mass (N, P, 3, 3), [m^2].
    """
    masses = masses * (_draw_log_uniform(rng, _MASSES, (_NUM_SOLIDS,)) / masses.sum(axis=1))[:, None]
    J = np.zeros((_NUM_SOLIDS, 4, 4))
    J[:, :3, :3] = np.einsum("np,npij->nij", masses, second + centres[..., :, None] * centres[..., None, :])
    J[:, :3, 3] = J[:, 3, :3] = np.einsum("np,npi->ni", masses, centres)
    J[:, 3, 3] = masses.sum(axis=1)
    return parameters_from_pseudo_inertia(J)


def _draw_log_uniform(rng: np.random.Generator, bounds: tuple[float, float], shape: tuple[int, ...]) -> Array:
    return np.exp(rng.uniform(np.log(bounds[0]), np.log(bounds[1]), shape))
