"""Observers' own objects: hammers, mallets and kitchen tools of random sizes, to test intervals of predicted masses.

Five tools shared by all observers would be only five draws of the error of vision. Each observer therefore gets its
own hammer, mallet, pan and one more kitchen tool, with sizes as shops list them (``recorded/solids``). As in real
tools, heads contain the end of their handle, which no picture shows; pans and beakers are open and thin.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from manifold3d import CrossSection, Manifold

from affordance.objects.array_solids import TriangleMesh
from affordance.objects.materials import Material
from affordance.objects.tool import Component, Tool

_ROUND = 32  # number of corners with which a circle is approximated
_STEEL = 7850.0  # density from which the size of a hammer's head is computed, [kg/m^3]
_MM = 1e3


def draw_things(rng: np.random.Generator, materials: Mapping[str, Material]) -> list[Tool]:
    """Draws a hammer, a mallet, a pan and a beaker, stamper or rolling pin; all lie flat, along Tx from the hand."""
    drawn = {
        "hammer": _draw_hammer(rng),
        "mallet": _draw_mallet(rng),
        "pan": _draw_pan(rng),
        **[_draw_beaker, _draw_stamper, _draw_pin][rng.integers(3)](rng),
    }
    return [_build(name, bodies, materials) for name, bodies in drawn.items()]


type _Bodies = Sequence[tuple[Manifold, str]]


def _draw_hammer(rng: np.random.Generator) -> _Bodies:
    """Draws a hammer: handle of 25 to 38 cm, head of 0.15 to 1 kg and 8 to 14 cm."""
    length, mass, width = rng.uniform(0.25, 0.38), rng.uniform(0.15, 1.0), rng.uniform(0.08, 0.14)
    return _put_on_handle(
        length, rng.uniform(0.010, 0.015), np.sqrt(mass / (_STEEL * width * np.pi)), width, "cast_steel"
    )


def _draw_mallet(rng: np.random.Generator) -> _Bodies:
    """Draws a mallet: handle of 25 to 38 cm, head of 5 to 8 cm by 8 to 14 cm."""
    length, radius, width = rng.uniform(0.25, 0.38), rng.uniform(0.025, 0.04), rng.uniform(0.08, 0.14)
    return _put_on_handle(length, rng.uniform(0.010, 0.015), radius, width, "rubber")


def _draw_pan(rng: np.random.Generator) -> _Bodies:
    """Draws a pan: 16 to 28 cm wide, wall of 2 to 5 mm, rim of 3 to 6 cm, handle of 15 to 22 cm."""
    radius, wall, rim = rng.uniform(0.08, 0.14), rng.uniform(0.002, 0.005), rng.uniform(0.03, 0.06)
    length, thick = rng.uniform(0.15, 0.22), rng.uniform(0.008, 0.013)
    bowl = _stand([(0.0, radius), (rim, radius)]) - _stand([(wall, radius - wall), (rim, radius - wall)])
    handle = _lie([(0.0, thick), (length, thick)]).translate((0.0, 0.0, _MM * 0.6 * rim))
    bowl = bowl.translate((_MM * (length + radius - wall), 0.0, 0.0))
    return [(handle - bowl, "oak"), (bowl, str(rng.choice(["stainless_steel", "aluminium"])))]


def _draw_beaker(rng: np.random.Generator) -> dict[str, _Bodies]:
    """Draws an open beaker: 6 to 10 cm by 8 to 14 cm, wall of 2 to 4 mm."""
    radius, height, wall = rng.uniform(0.03, 0.05), rng.uniform(0.08, 0.14), rng.uniform(0.002, 0.004)
    inside = _lie([(wall, radius - wall), (height, radius - wall)])
    return {"beaker": [(_lie([(0.0, radius), (height, radius)]) - inside, "stainless_steel")]}


def _draw_stamper(rng: np.random.Generator) -> dict[str, _Bodies]:
    """Draws a stamper: rod of 15 to 25 cm, whose end is in a disc of 6 to 10 cm by 1 to 2 cm."""
    length, thick = rng.uniform(0.15, 0.25), rng.uniform(0.010, 0.015)
    radius, width = rng.uniform(0.03, 0.05), rng.uniform(0.01, 0.02)
    rod = _lie([(0.0, thick), (length, thick)])
    disc = _lie([(length - 0.5 * width, radius), (length + 0.5 * width, radius)]) - rod
    return {"stamper": [(rod, "oak"), (disc, "stainless_steel")]}


def _draw_pin(rng: np.random.Generator) -> dict[str, _Bodies]:
    """Draws a rolling pin: 30 to 45 cm long, with a roller of 4 to 7 cm."""
    length, radius, thick = rng.uniform(0.3, 0.45), rng.uniform(0.02, 0.035), rng.uniform(0.008, 0.014)
    grip = 0.25 * length
    profile = [(0.0, thick), (grip, thick), (grip, radius), (length - grip, radius), (length - grip, thick)]
    return {"rolling pin": [(_lie([*profile, (length, thick)]), "oak")]}


def _put_on_handle(length: float, thick: float, radius: float, width: float, material: str) -> _Bodies:
    """Puts a round head across the end of a handle that passes through it."""
    handle = _lie([(0.0, thick), (length, min(thick, 0.7 * radius))])
    head = _lie([(-0.5 * width, radius), (0.5 * width, radius)]).rotate((0.0, 0.0, 90.0))
    return [(handle, "oak"), (head.translate((_MM * (length - radius), 0.0, 0.0)) - handle, material)]


def _lie(profile: Sequence[tuple[float, float]]) -> Manifold:
    """Builds a solid of revolution about Tx from the points of its profile (distance along the axis, radius), [m]."""
    return _stand(profile).rotate((0.0, 90.0, 0.0))


def _stand(profile: Sequence[tuple[float, float]]) -> Manifold:
    """Builds a solid of revolution about Tz, in millimetres, because the library's tolerances are meant for them."""
    outline = [(r, x) for x, r in profile]
    outline = [(0.0, profile[0][0]), *outline, (0.0, profile[-1][0])]
    return CrossSection([[(_MM * r, _MM * x) for r, x in outline]]).revolve(_ROUND)


def _build(name: str, bodies: _Bodies, materials: Mapping[str, Material]) -> Tool:
    """Builds a tool from bodies; the frame of each body is at its centroid."""
    parts = []
    for body, material in bodies:
        mesh = body.to_mesh64()
        solid, p_TE = TriangleMesh(np.array(mesh.vert_properties)[:, :3] / _MM, np.array(mesh.tri_verts)).centre()
        X_TE = np.eye(4)
        X_TE[:3, 3] = p_TE
        parts.append(Component(solid, X_TE, materials[material], materials[material]))
    return Tool(name, tuple(parts))
