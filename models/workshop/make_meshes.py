"""Draws the meshes of this folder: three hammers and two kitchen tools nobody has seen before, all of our own making.

    python models/workshop/make_meshes.py

Each file holds one body after the other, which touch and do not overlap. Frame T as in ../README.md: Tx runs along
the handle to the free end, from the middle of the hand, Ty where a blow goes, Tz out of the plane in which the tool
lies flat; metres. Here all is drawn in millimetres.
"""

from pathlib import Path

import numpy as np
from manifold3d import CrossSection, Manifold

FOLDER = Path(__file__).parent / "meshes"
# Corners of a circle: more would not change a mass by a thousandth, and make the files larger.
ROUND = 32


def revolve_along_x(profile: list[tuple[float, float]]) -> Manifold:
    """The solid of revolution about Tx of a line of points (x, radius) from one end to the other."""
    start, end = profile[0][0], profile[-1][0]
    outline = [(r, x) for x, r in profile]
    section = CrossSection([[(0.0, start), *outline, (0.0, end)]])
    # It turns about the section's own upright, which becomes z.
    return section.revolve(ROUND).rotate((0.0, 90.0, 0.0))


def revolve_along_y(profile: list[tuple[float, float]], x: float) -> Manifold:
    """The same about a line along Ty through (x, 0, 0), of points (y, radius)."""
    return revolve_along_x(profile).rotate((0.0, 0.0, 90.0)).translate((x, 0.0, 0.0))


def make_handle(start: float, end: float, *, thick: float, slim: float, flatness: float = 0.75) -> Manifold:
    """A wooden handle from start to end: thick in the hand, slim before the head, flatter along Tz than along Ty."""
    along = np.linspace(0.0, 1.0, 9)
    radius = slim + (thick - slim) * np.array([0.75, 1.0, 0.95, 0.8, 0.55, 0.3, 0.12, 0.03, 0.0])
    profile = [(float(start + (end - start) * u), float(r)) for u, r in zip(along, radius, strict=True)]
    return revolve_along_x(profile).scale((1.0, 1.0, flatness))


def make_claw_hammer() -> list[Manifold]:
    """Handle of oak, head of cast steel with a poll of 26 mm and a claw."""
    handle = make_handle(-70.0, 262.0, thick=17.0, slim=11.0)
    outline = [(226, 30), (226, -16), (240, -22), (241, -34), (238, -52), (230, -73), (234, -76), (248, -58)]
    head = CrossSection([[*outline, (258, -38), (262, -18), (262, 30)]]).extrude(24.0).translate((0.0, 0.0, -12.0))
    poll = revolve_along_y([(30.0, 10.0), (38.0, 10.0), (42.0, 13.0), (62.0, 13.0)], 244.0)
    # The slit of the claw: widest at its end.
    slit = CrossSection([[(-90, 7), (-90, -7), (-28, -0.8), (-28, 0.8)]]).extrude(200.0)
    # Drawn over (y, z), pushed along x.
    slit = slit.rotate((90.0, 0.0, 90.0)).translate((100.0, 0.0, 0.0))
    return [handle, (head + poll) - slit - handle]


def make_machinist_hammer() -> list[Manifold]:
    """Handle of oak, ball-peen head of cast steel."""
    handle = make_handle(-70.0, 226.0, thick=14.0, slim=8.5)
    ball = [(-48.0 + 12.0 * (1.0 - np.cos(a)), max(12.0 * np.sin(a), 0.0)) for a in np.linspace(0.0, 2.1, 9)]
    profile = [*ball, (-22.0, 8.0), (-15.0, 13.0), (15.0, 13.0), (22.0, 9.5), (30.0, 9.5), (34.0, 12.5), (48.0, 12.5)]
    head = revolve_along_y([(float(y), float(r)) for y, r in profile], 214.0)
    return [handle, head - handle]


def make_mallet() -> list[Manifold]:
    """Handle of oak, head of rubber."""
    handle = make_handle(-80.0, 250.0, thick=15.0, slim=12.0, flatness=0.9)
    profile = [(-55.0, 27.0), (-52.0, 30.0), (-25.0, 32.5), (0.0, 33.5), (25.0, 32.5), (52.0, 30.0), (55.0, 27.0)]
    return [handle, revolve_along_y(profile, 220.0) - handle]


def make_stamper() -> list[Manifold]:
    """A rod of oak with a thick disc of stainless steel at one end and a ball of brass at the other."""
    rod = revolve_along_x([(-30.0, 9.0), (-10.0, 12.0), (40.0, 13.5), (90.0, 11.0), (170.0, 9.0)])
    disc = revolve_along_x([(158.0, 14.0), (168.0, 16.0), (172.0, 38.0), (182.0, 40.0), (186.0, 36.0)]) - rod
    turn = np.linspace(0.0, np.pi, 13)
    ball = revolve_along_x([(float(-48.0 - 24.0 * np.cos(a)), float(max(24.0 * np.sin(a), 0.0))) for a in turn]) - rod
    return [rod, disc, ball]


def make_bell() -> list[Manifold]:
    """A bell of stainless steel, open at its free end, with a knob of oak through which one cannot see that."""
    outer = [(40.0, 9.0), (70.0, 9.0), (85.0, 14.0), (110.0, 27.0), (150.0, 34.0), (185.0, 38.0)]
    hollow = revolve_along_x([(100.0, 3.0), (112.0, 22.0), (150.0, 29.0), (190.0, 33.5)])
    knob = revolve_along_x(
        [(-55.0, 8.0), (-48.0, 20.0), (-25.0, 25.0), (0.0, 22.0), (25.0, 13.0), (45.0, 11.0), (55.0, 10.0)]
    )
    return [revolve_along_x(outer) - hollow - knob, knob]


def write_bodies(name: str, bodies: list[Manifold]) -> None:
    """Writes bodies as one OBJ file, in metres."""
    lines, count = [f"# {name}, drawn by make_meshes.py; metres"], 0
    for number, body in enumerate(bodies):
        mesh = body.to_mesh64()
        lines.append(f"o {name}_{number}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in 1e-3 * np.array(mesh.vert_properties)[:, :3]]
        lines += [f"f {a} {b} {c}" for a, b, c in np.array(mesh.tri_verts) + 1 + count]
        count += len(mesh.vert_properties)
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{name}.obj").write_text("\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    write_bodies("claw_hammer", make_claw_hammer())
    write_bodies("machinist_hammer", make_machinist_hammer())
    write_bodies("mallet", make_mallet())
    write_bodies("stamper", make_stamper())
    write_bodies("bell", make_bell())
