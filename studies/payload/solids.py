"""Objects from a workshop and a kitchen, for tests of the prior of solids.

No object was used to build this prior. Sizes and materials come from listings of shops. Each object is held at its
handle, or anywhere along its length, in any orientation.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import parameters_from_pseudo_inertia

_STEEL, _ALUMINIUM, _WOOD, _PLASTIC = 7850.0, 2700.0, 700.0, 1100.0
_HELD_SD, _PLACED_SD = 0.03, 0.06  # SD of the position of handles and boxes at the tip, along each axis, [m]


class _Part(NamedTuple):
    """Part of an object: mass, [kg], centre, [m], and mean squared coordinates about the centre, [m^2].

    Centre and axes are expressed in the object's frame.
    """

    mass: float
    centre: tuple[float, float, float]
    squares: Sequence[float] | Array


def draw_box(rng: np.random.Generator) -> Array:
    """Draws the parameters, (10,), of a compact box, tin or camera of 3 to 15 cm and 0.05 to 4 kg."""
    edges = rng.uniform(0.03, 0.15, 3)
    mass = float(np.clip(edges.prod() * np.exp(rng.uniform(np.log(200.0), np.log(3000.0))), 0.05, 4.0))
    return _hold(rng, [_Part(mass, (0.0, 0.0, 0.0), edges**2 / 12.0)], _PLACED_SD)


def draw_hammer(rng: np.random.Generator) -> Array:
    """Draws the parameters, (10,), of a hammer with a wooden or fibre handle and a head of 0.15 to 1 kg."""
    length, head, width = rng.uniform(0.25, 0.38), rng.uniform(0.15, 1.0), rng.uniform(0.08, 0.14)
    radius = np.sqrt(head / (_STEEL * width * np.pi))
    grip = rng.uniform(0.04, 0.12)
    handle = length * np.pi * 0.014**2 * rng.choice([_WOOD, 2500.0])
    across = [radius**2 / 4.0, width**2 / 12.0, radius**2 / 4.0]
    parts = [_build_rod(handle, length, 0.014, 0.5 * length - grip), _Part(head, (length - grip, 0.0, 0.0), across)]
    return _hold(rng, parts, _HELD_SD)


def draw_pan(rng: np.random.Generator) -> Array:
    """Draws the parameters, (10,), of an aluminium or steel frying pan, 16 to 28 cm wide."""
    width, thickness = rng.uniform(0.16, 0.28), rng.uniform(0.002, 0.005)
    bowl = 1.3 * np.pi * width**2 / 4.0 * thickness * rng.choice([_ALUMINIUM, _STEEL])  # factor 1.3 for the rim
    length, handle, grip = rng.uniform(0.15, 0.22), rng.uniform(0.08, 0.25), rng.uniform(0.04, 0.10)
    flat = [width**2 / 16.0, width**2 / 16.0, 3e-4]
    parts = [
        _build_rod(handle, length, 0.012, 0.5 * length - grip),
        _Part(bowl, (length - grip + 0.5 * width, 0.0, 0.0), flat),
    ]
    return _hold(rng, parts, _HELD_SD)


def draw_rod(rng: np.random.Generator) -> Array:
    """Draws the parameters, (10,), of a wooden, plastic or metal rod, 12 to 60 cm long."""
    length, radius = rng.uniform(0.12, 0.60), rng.uniform(0.005, 0.020)
    mass = np.pi * radius**2 * length * rng.choice([_WOOD, _PLASTIC, _ALUMINIUM, _STEEL])
    return _hold(rng, [_build_rod(max(mass, 0.03), length, radius, rng.uniform(-0.35, 0.35) * length)], _HELD_SD)


CLASSES: dict[str, Callable[[np.random.Generator], Array]] = {
    "box": draw_box,
    "hammer": draw_hammer,
    "pan": draw_pan,
    "rod": draw_rod,
}


def _build_rod(mass: float, length: float, radius: float, along: float) -> _Part:
    return _Part(mass, (along, 0.0, 0.0), [length**2 / 12.0, radius**2 / 4.0, radius**2 / 4.0])


def _hold(rng: np.random.Generator, parts: Sequence[_Part], held_sd: float) -> Array:
    """Rotates an object randomly and places it near the tip. Returns its parameters, (10,)."""
    J = np.zeros((4, 4))
    for mass, centre, squares in parts:
        place = np.array(centre)
        J[:3, :3] += mass * (np.diag(squares) + np.outer(place, place))
        J[:3, 3] += mass * place
        J[3, 3] += mass
    J[3, :3] = J[:3, 3]
    X = np.eye(4)
    X[:3, :3], _ = np.linalg.qr(rng.standard_normal((3, 3)))
    X[:3, 3] = held_sd * rng.standard_normal(3)
    return parameters_from_pseudo_inertia(X @ J @ X.T)
