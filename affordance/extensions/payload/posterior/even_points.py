"""Evenly spread points of a unit cube, which give integrals smaller errors than independent points do.

They are Sobol points with the direction numbers of Joe & Kuo (2008, SIAM J. Sci. Comput. 30:2635). SciPy draws the
same points, but its statistics package takes half a second to import.
"""

import numpy as np

from affordance.arrays import Array

# Inner coefficients of the primitive polynomial, and first direction numbers, of each dimension after the first.
_POLYNOMIALS = (
    (0, (1,)),
    (1, (1, 3)),
    (1, (1, 3, 1)),
    (2, (1, 1, 1)),
    (1, (1, 1, 3, 3)),
    (4, (1, 3, 5, 13)),
    (2, (1, 1, 5, 5, 17)),
    (4, (1, 1, 5, 5, 5)),
    (7, (1, 1, 7, 11, 19)),
    (11, (1, 1, 5, 1, 1)),
)
MAX_DIMENSION = len(_POLYNOMIALS) + 1
_BITS = 30
_POWERS = 1 << np.arange(_BITS - 1, -1, -1)


def draw_even_points(rng: np.random.Generator, num_points: int, size: int) -> Array:
    """Draws points of the open unit cube, shape (num_points, size), each of which is uniformly distributed.

    Binary digits are multiplied by a random triangular matrix and shifted (Matousek 1998, J. Complexity 14:527).
    There may be fewer than 2^30 points, with up to ``MAX_DIMENSION`` coordinates.
    """
    points = np.empty((num_points, size))
    for dimension in range(size):
        matrix = np.tril(rng.integers(0, 2, (_BITS, _BITS)), -1) + np.eye(_BITS, dtype=int)
        digits = np.array(list_directions(dimension))[:, None] // _POWERS % 2
        values = rng.integers(0, 2**_BITS, 1)
        for direction in digits @ matrix.T % 2 @ _POWERS:
            if len(values) >= num_points:
                break
            values = np.concatenate([values, values ^ direction])
        points[:, dimension] = (values[:num_points] + 0.5) / 2.0**_BITS
    return points


def list_directions(dimension: int) -> list[int]:
    """Lists the direction numbers of a dimension, counted from 0, in multiples of 2^-30."""
    inner, first = _POLYNOMIALS[dimension - 1] if dimension else (0, (1,) * _BITS)
    degree = len(first)
    directions = [m << (_BITS - 1 - i) for i, m in enumerate(first)]
    for i in range(degree, _BITS):
        new = directions[i - degree] ^ (directions[i - degree] >> degree)
        for k in range(1, degree):
            if inner >> (degree - 1 - k) & 1:
                new ^= directions[i - k]
        directions.append(new)
    return directions
