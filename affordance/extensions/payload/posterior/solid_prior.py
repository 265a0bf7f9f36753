"""Prior of an unseen held body: any solid that a hand can hold.

The prior is a mixture of four normal distributions of log-Cholesky coordinates. Each is fitted to random solids of
one kind.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.posterior.log_cholesky import parameters_from_theta, theta_from_parameters, thicken
from affordance.objects.inertia import parameters_from_pseudo_inertia

# Sizes and densities are log-uniform, orientations uniform:
# - assemblies of one to three boxes, with edges of 1 to 30 cm and densities of 100 to 8000 kg/m^3 (foam to steel, a
# pen to a drawer), within 15 cm (one SD) of the tip and 7 cm of one another;
# - compact boxes with edges of 2 to 20 cm, within 10 cm of the tip;
# - rods of 8 to 80 cm, 3 to 25 mm in radius, held anywhere along their length within 4 cm of the tip;
# - handles of 8 to 50 cm with a head that has any share of the mass and edges of 1 to 30 cm, held in the half away
# from the head: hammers, ladles, pans and brushes.
_ASSEMBLY_EDGES, _DENSITIES = (0.01, 0.30), (100.0, 8000.0)
_REACH_SD, _SPREAD_SD = 0.15, 0.07
_COMPACT_EDGES, _COMPACT_SD = (0.02, 0.20), 0.10
_ROD_LENGTHS, _ROD_RADII, _HELD_SD = (0.08, 0.80), (0.003, 0.025), 0.04
_HANDLE_LENGTHS, _HANDLE_RADII, _HEAD_EDGES = (0.08, 0.50), (0.005, 0.02), (0.01, 0.30)
# Range of masses, from a pencil case to the payload of a large robot, [kg].
_MASSES = (0.02, 10.0)
_NUM_SOLIDS = 4000  # number of random solids of each kind


@dataclass(frozen=True)
class Normals:
    """K normal distributions of a vector with D entries."""

    means: Array  # means, shape (K, D)
    covariances: Array  # covariances, shape (K, D, D)

    @cached_property
    def roots(self) -> Array:
        """Lower triangular square roots L of the covariances L L^T, shape (K, D, D)."""
        return np.linalg.cholesky(self.covariances)

    @cached_property
    def precisions(self) -> Array:
        """Inverses of the covariances, shape (K, D, D)."""
        inverse = np.linalg.inv(self.covariances)
        precisions: Array = 0.5 * (inverse + inverse.swapaxes(-1, -2))
        return precisions

    @cached_property
    def log_scales(self) -> Array:
        """Log densities at the means, shape (K,), without powers of 2 pi."""
        scales: Array = -np.log(np.diagonal(self.roots, axis1=1, axis2=2)).sum(axis=1)
        return scales

    @cached_property
    def _whitening(self) -> tuple[Array, Array]:
        """Inverse roots of all distributions, concatenated, (D, K D), and whitened means, (K D,)."""
        num, size = self.means.shape
        inverse = np.linalg.inv(self.roots)
        return inverse.reshape(num * size, size).T, (inverse @ self.means[..., None]).ravel()

    def measure_squares(self, points: Array) -> Array:
        """Computes squared Mahalanobis distances, (N, K), of points, (N, D)."""
        num, size = self.means.shape
        whitening, origin = self._whitening
        away = points @ whitening - origin
        away = away.reshape(len(points), num, size)
        squares: Array = np.einsum("nkd,nkd->nk", away, away)
        return squares


def add_logs(logs: Array) -> Array:
    """Computes log-sum-exp over K terms, (N, K) to (N,), several times faster than NumPy."""
    most = logs.max(axis=1)
    total: Array = most + np.log(np.exp(logs - most[:, None]).sum(axis=1))
    return total


@dataclass(frozen=True)
class SolidPrior:
    """Mixture of normal distributions of theta (see log_cholesky). All samples are physically consistent."""

    kinds: Normals  # distribution of theta for each of K kinds of solids
    shares: Array  # probability of each kind, shape (K,); they sum to one

    @classmethod
    @cache
    def for_hand(cls) -> "SolidPrior":
        """Returns the prior of any solid that a hand can hold."""
        return cls.from_samples(*_draw_random_solids(np.random.default_rng(0)))

    @classmethod
    def from_samples(cls, *kinds: Array) -> "SolidPrior":
        """Fits the prior to samples of equally probable kinds of bodies, (N, 10) each, with N much larger than 10.

        Raises:
            numpy.linalg.LinAlgError: A body is not physically consistent.
        """
        thetas = [theta_from_parameters(pi) for pi in kinds]
        means = np.array([theta.mean(axis=0) for theta in thetas])
        return cls(
            Normals(means, np.array([np.cov(theta.T) for theta in thetas])), np.full(len(kinds), 1 / len(kinds))
        )

    def with_mass(self, mass: float, sd: float) -> "SolidPrior":
        """Conditions the prior on a weighed mass, [kg], with a standard deviation, [kg]."""
        means, C = self.kinds.means, self.kinds.covariances
        away, variance = np.log(mass) - means[:, 0], C[:, 0, 0]
        gain = C[:, 0] / variance[:, None]
        less = ((sd / mass) ** 2 - variance)[:, None, None]
        kinds = Normals(means + gain * away[:, None], C + gain[:, :, None] * gain[:, None, :] * less)
        shares = self.shares * np.exp(-0.5 * away**2 / variance) / np.sqrt(variance)
        return SolidPrior(kinds, shares / shares.sum())

    def with_common_factor(self, sd: float) -> "SolidPrior":
        """Multiplies the body by an unknown factor, whose log is normal with the given SD."""
        covariances = np.array(self.kinds.covariances)
        covariances[:, 0, 0] += sd**2
        return SolidPrior(Normals(self.kinds.means, covariances), self.shares)

    def remove_common_factor(self, pi: Array, sd: float, rng: np.random.Generator) -> Array:
        """Draws bodies without the unknown common factor, given bodies with it, (N, 10)."""
        if sd == 0.0:
            return pi
        widened = self.with_common_factor(sd)
        theta = theta_from_parameters(thicken(pi))
        log_densities = widened.compute_log_densities(theta)
        # The Gumbel trick draws each kind with its posterior probability.
        kind = np.argmax(log_densities + rng.gumbel(size=log_densities.shape), axis=1)
        share = sd**2 * widened.kinds.precisions[:, 0]  # fraction of a deviation that the factor explains, (K, 10)
        mean = np.einsum("nd,nd->n", theta - widened.kinds.means[kind], share[kind])
        spread = np.sqrt(np.maximum(sd**2 * (1.0 - share[:, 0]), 0.0))[kind]
        factor = np.exp(mean + spread * rng.standard_normal(len(pi)))
        body: Array = pi / factor[:, None]
        return body

    @cached_property
    def mean(self) -> Array:
        """Mean of theta, shape (10,)."""
        mean: Array = self.shares @ self.kinds.means
        return mean

    @cached_property
    def covariance(self) -> Array:
        """Covariance of theta, shape (10, 10)."""
        away = self.kinds.means - self.mean
        within = np.einsum("k,kij->ij", self.shares, self.kinds.covariances)
        covariance: Array = within + (away.T * self.shares) @ away
        return covariance

    @cached_property
    def precision(self) -> Array:
        """Inverse of the covariance, shape (10, 10)."""
        inverse = np.linalg.inv(self.covariance)
        return 0.5 * (inverse + inverse.T)

    def compute_log_density(self, theta: Array) -> Array:
        """Computes the log density, (N,), of theta, (N, 10), up to a constant."""
        return add_logs(self.compute_log_densities(theta))

    def compute_log_densities(self, theta: Array) -> Array:
        """Computes the log density of each kind times its probability, (N, K), up to a common constant."""
        squares = self.kinds.measure_squares(theta)
        log_densities: Array = np.log(self.shares) + self.kinds.log_scales - 0.5 * squares
        return log_densities

    def draw_theta(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws bodies as log-Cholesky coordinates, shape (num_samples, 10)."""
        kind = rng.choice(len(self.shares), size=num_samples, p=self.shares)
        normal = rng.standard_normal((num_samples, self.kinds.means.shape[1]))
        theta: Array = self.kinds.means[kind] + np.einsum("nij,nj->ni", self.kinds.roots[kind], normal)
        return theta

    def draw_parameters(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws bodies, shape (num_samples, 10)."""
        return parameters_from_theta(self.draw_theta(rng, num_samples))


def _draw_random_solids(rng: np.random.Generator) -> tuple[Array, ...]:
    """Draws random solids of each kind, (N, 10) each: assemblies, compact boxes, rods, and handles with a head."""
    return _draw_assemblies(rng), _draw_compact(rng), _draw_rods(rng), _draw_handled(rng)


def _draw_assemblies(rng: np.random.Generator) -> Array:
    """Draws the ten parameters of assemblies of one to three boxes, (N, 10)."""
    shape = (_NUM_SOLIDS, 3)
    edges = _draw_log_uniform(rng, _ASSEMBLY_EDGES, (*shape, 3))
    present = np.arange(3) < rng.integers(1, 4, _NUM_SOLIDS)[:, None]
    masses = present * edges.prod(axis=2) * _draw_log_uniform(rng, _DENSITIES, shape)
    centres = _REACH_SD * rng.standard_normal((_NUM_SOLIDS, 1, 3)) + _SPREAD_SD * rng.standard_normal((*shape, 3))
    R, _ = np.linalg.qr(rng.standard_normal((*shape, 3, 3)))
    second = R * (edges**2 / 12.0)[..., None, :] @ R.swapaxes(-1, -2)
    return _assemble(rng, masses, centres, second)


def _draw_compact(rng: np.random.Generator) -> Array:
    """Draws the ten parameters of boxes, (N, 10)."""
    edges = _draw_log_uniform(rng, _COMPACT_EDGES, (_NUM_SOLIDS, 1, 3))
    centres = _COMPACT_SD * rng.standard_normal((_NUM_SOLIDS, 1, 3))
    return _turn(rng, np.ones((_NUM_SOLIDS, 1)), np.zeros_like(centres), edges**2 / 12.0, centres)


def _draw_rods(rng: np.random.Generator) -> Array:
    """Draws the ten parameters of randomly turned rods, (N, 10)."""
    length = _draw_log_uniform(rng, _ROD_LENGTHS, (_NUM_SOLIDS, 1))
    second = _measure_cylinder(length, _draw_log_uniform(rng, _ROD_RADII, (_NUM_SOLIDS, 1)))
    along = rng.uniform(-0.5, 0.5, (_NUM_SOLIDS, 1)) * length
    held = _HELD_SD * rng.standard_normal((_NUM_SOLIDS, 1, 3))
    return _turn(rng, np.ones((_NUM_SOLIDS, 1)), along[..., None] * np.eye(3)[0], second, held)


def _draw_handled(rng: np.random.Generator) -> Array:
    """Draws the ten parameters of randomly turned handles with a head, (N, 10)."""
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
    """Computes mean squared coordinates of cylinders along x, (N, 1, 3). Lengths and radii are (N, 1)."""
    return np.stack([length**2 / 12.0, radius**2 / 4.0, radius**2 / 4.0], axis=-1)


def _turn(rng: np.random.Generator, masses: Array, centres: Array, squares: Array, held: Array) -> Array:
    """Turns solids with P parts at random and places them in the hand (see ``_assemble``).

    ``squares`` contains the mean squared coordinates of each part about its centre, (N, P, 3), [m^2]. ``held`` is the
    position of the solid's origin in the tip frame, (N, 1, 3), [m].
    """
    R, _ = np.linalg.qr(rng.standard_normal((_NUM_SOLIDS, 1, 3, 3)))
    second = R * squares[..., None, :] @ R.swapaxes(-1, -2)
    return _assemble(rng, masses, (R @ centres[..., None])[..., 0] + held, second)


def _assemble(rng: np.random.Generator, masses: Array, centres: Array, second: Array) -> Array:
    """Draws the masses of solids with P parts, and computes their ten parameters, shape (N, 10).

    ``masses`` contains relative masses, (N, P), and ``centres`` positions, (N, P, 3), [m]. ``second`` contains second
    moments about the centres divided by mass, (N, P, 3, 3), [m^2].
    """
    masses = masses * (_draw_log_uniform(rng, _MASSES, (_NUM_SOLIDS,)) / masses.sum(axis=1))[:, None]
    J = np.zeros((_NUM_SOLIDS, 4, 4))
    J[:, :3, :3] = np.einsum("np,npij->nij", masses, second + centres[..., :, None] * centres[..., None, :])
    J[:, :3, 3] = J[:, 3, :3] = np.einsum("np,npi->ni", masses, centres)
    J[:, 3, 3] = masses.sum(axis=1)
    return parameters_from_pseudo_inertia(J)


def _draw_log_uniform(rng: np.random.Generator, bounds: tuple[float, float], shape: tuple[int, ...]) -> Array:
    return np.exp(rng.uniform(np.log(bounds[0]), np.log(bounds[1]), shape))
