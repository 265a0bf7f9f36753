"""Panel of ``affordance watch``, a rectangle with a picture in the scene, and the camera that sees it and the arm."""

from typing import NamedTuple

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh

from affordance.arrays import Array

# Width and height of the panel, as shares of the distance from base to hand.
_PANEL = np.array([1.15, 0.575])
# Tangent of half the camera's vertical angle of view, 75 degrees. In a window of this width and height, [px], arm and
# panel are wholly seen to the left of the open controls, which have the given width.
_TANGENT = np.tan(np.deg2rad(37.5))
_WINDOW, _CONTROLS = np.array([1000.0, 700.0]), 245.0


class Panel(NamedTuple):
    """Rectangle in the world: its lower left corner, its edges and the direction towards the camera, (3,), [m]."""

    corner: Array
    right: Array
    up: Array
    front: Array

    def place(self, shares: Array, lift: float) -> Array:
        """Places points given by shares of the edges, (N, 2), lifted off the panel, [m]; returns (N, 3)."""
        place: Array = self.corner + shares @ np.array([self.right, self.up]) + lift * self.front
        return place

    def build_mesh(self, image: bytes) -> Mesh:
        """Builds the rectangle with a picture, PNG, on it, which shines by itself, as bright in any light."""
        corners = self.place(np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), 0.0)
        lines = ["mtllib panel.mtl", *("v {} {} {}".format(*corner) for corner in corners)]
        lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "vn {} {} {}".format(*self.front)]
        lines += ["usemtl panel", "f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1"]
        paint = "newmtl panel\nKa 0 0 0\nKd 0 0 0\nKs 0 0 0\nKe 1.3 1.3 1.3\nmap_Ke panel.png\n"
        files = {
            "panel.mtl": MemoryFile(paint.encode(), ".mtl", "panel.mtl"),
            "panel.png": MemoryFile(image, ".png", "panel.png"),
        }
        text = MemoryFile("\n".join(lines).encode(), ".obj", "panel.obj")
        return Mesh(InMemoryMesh(mesh_file=text, supporting_files=files))


def place_panel(p_WF: Array) -> Panel:
    """Places the panel over an arm, given by its frames from base to hand, for a camera at its side."""
    p_WB, p_WH = p_WF[0], p_WF[-1]
    out = (p_WH - p_WB) * [1.0, 1.0, 0.0]
    reach = float(np.linalg.norm(p_WH - p_WB))
    right, up = out / np.linalg.norm(out), np.array([0.0, 0.0, 1.0])
    front = -np.cross(up, right)
    wide, high = reach * _PANEL
    above = p_WF[:, 2].max() - p_WB[2] + 0.12 * reach
    corner = p_WB + 0.1 * reach * right + above * up - 0.1 * reach * front
    return Panel(corner, wide * right, high * up, front)


def place_camera(p_WF: Array, panel: Panel) -> tuple[Array, Array]:
    """Places the camera so that open controls cover neither arm nor object nor panel; returns place and target."""
    reach = float(np.linalg.norm(p_WF[-1] - p_WF[0]))
    low, high = p_WF[:, 2].min() - 0.45 * reach, panel.corner[2] + panel.up[2]
    right = panel.right / np.linalg.norm(panel.right)
    wide = 1.5 * reach
    free = 1.0 - _CONTROLS / _WINDOW[0]
    far = max(0.82 * (high - low), 0.5 * wide * _WINDOW[1] / _WINDOW[0] / _TANGENT / free + 0.1 * reach)
    shift = _CONTROLS / _WINDOW[1] * _TANGENT * far
    target = p_WF[0] + (0.65 * reach + shift) * right
    target[2] = 0.5 * (low + high)
    return target + far * panel.front + [0.0, 0.0, 0.15 * far], target
