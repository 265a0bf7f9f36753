"""Marginals of weighted samples of bodies: mass, centre of mass, and moments of inertia about it."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import compute_point_parameters

QUANTITIES = ("mass", "c_x", "c_y", "c_z", "I_xx", "I_yy", "I_zz", "I_xy", "I_xz", "I_yz")
UNITS = ("kg", *["m"] * 3, *["kg m^2"] * 6)
MASS, COM, MOMENTS, PRODUCTS = slice(0, 1), slice(1, 4), slice(4, 7), slice(7, 10)


class Marginals(NamedTuple):
    """Marginals of mass, centre of mass and moments of inertia about it, shape (10,) each.

    They are in the order of QUANTITIES, [kg, m, kg m^2]; products of inertia are -integral(x y dm).
    """

    mean: Array
    sd: Array
    low50: Array
    high50: Array
    low90: Array
    high90: Array


def describe_bodies(pi: Array) -> Array:
    """Computes mass, centre of mass and moments about it, in the order of QUANTITIES, from pi, (N, 10)."""
    m, c = pi[:, 0], pi[:, 1:4] / pi[:, :1]
    return np.column_stack([m, c, pi[:, 4:] - m[:, None] * compute_point_parameters(c)[:, 4:]])


def summarise(values: Array, weights: Array) -> Marginals:
    """Computes the marginals of weighted samples: values of shape (N, 10), weights of shape (N,)."""
    mean = weights @ values
    sd = np.sqrt(weights @ (values - mean) ** 2)
    order = np.argsort(values, axis=0)
    quantiles = np.empty((4, values.shape[1]))
    for i in range(values.shape[1]):
        share = weights[order[:, i]]
        # Each sample is placed at the middle of its share of the distribution.
        quantiles[:, i] = np.interp([0.05, 0.25, 0.75, 0.95], np.cumsum(share) - 0.5 * share, values[order[:, i], i])
    return Marginals(mean, sd, quantiles[1], quantiles[2], quantiles[0], quantiles[3])
