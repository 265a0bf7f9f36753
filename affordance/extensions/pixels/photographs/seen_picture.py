"""Overlay of the measured outline, solids and table on an image."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.extensions.pixels.photographs.see import SeenObject
from affordance.extensions.pixels.photographs.superquadric import build_mesh
from affordance.files.atomic import write_atomic

_OUTLINE, _SOLID, _TABLE, _TEXT = (80, 255, 80), (255, 90, 40), (90, 170, 255), (255, 255, 255)
_LEAST_WIDTH = 960  # smallest width of the drawing, [pixels]
_GRID, _REACH = 0.05, 3  # distance between grid lines on the table, [m], and their number on each side
_RINGS = 7


def draw_seen(seen: SeenObject, colour: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Draws the outline (green), solids (orange), table (blue grid, 5 cm) and ends, (height, width, 3)."""
    scale = max(1, round(_LEAST_WIDTH / colour.shape[1]))
    picture = cv2.resize(colour, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)

    def draw(p_W: Array, shade: tuple[int, int, int], *, is_closed: bool = False) -> None:
        p_C = p_W @ seen.X_CW[:3, :3].T + seen.X_CW[:3, 3]
        if (p_C[:, 2] > 0.01).all():
            pixels = np.rint(scale * (seen.camera.project(p_C) + 0.5) - 0.5)
            corners = np.clip(pixels, -1e6, 1e6).astype(np.int32).reshape(-1, 1, 2)
            cv2.polylines(picture, [corners], is_closed, shade, scale, cv2.LINE_AA)

    reach = _GRID * _REACH
    for step in np.linspace(-reach, reach, 2 * _REACH + 1):
        draw(np.array([[step, -reach, 0.0], [step, reach, 0.0]]), _TABLE)
        draw(np.array([[-reach, step, 0.0], [reach, step, 0.0]]), _TABLE)
    large = cv2.resize(seen.mask.astype(np.uint8), None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)
    outlines, _ = cv2.findContours(large, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(picture, outlines, -1, _OUTLINE, scale)
    rows, columns = 33, 64
    for part in seen.parts:
        vertices, _ = build_mesh(part.solid, rows, columns)
        p_W = vertices @ part.solid.X_WS[:3, :3].T + part.solid.X_WS[:3, 3]
        rings = p_W[:-2].reshape(rows - 2, columns, 3)
        for number in np.linspace(0, rows - 3, _RINGS).round().astype(int):
            draw(rings[number], _SOLID, is_closed=True)
        for number in range(0, columns, columns // 8):
            draw(np.concatenate([p_W[-2:-1], rings[:, number], p_W[-1:]]), _SOLID)
    for name, side in (("A", -0.5), ("B", 0.5)):
        p_C = seen.X_CW[:3, :3] @ (seen.X_WT[:3, 3] + side * seen.length * seen.X_WT[:3, 0]) + seen.X_CW[:3, 3]
        u, v = scale * seen.camera.project(p_C)
        for shade, width in (((0, 0, 0), 3 * scale), (_TEXT, scale)):
            cv2.putText(
                picture, name, (int(u), int(v)), cv2.FONT_HERSHEY_SIMPLEX, 0.5 * scale, shade, width, cv2.LINE_AA
            )
    return np.asarray(picture, dtype=np.uint8)


def write_seen(path: Path, seen: SeenObject, colour: NDArray[np.uint8]) -> None:
    """Writes the drawing to a PNG file."""
    found = draw_seen(seen, colour)

    def write(temporary: Path) -> None:
        is_written, content = cv2.imencode(".png", found[:, :, ::-1])
        assert is_written
        temporary.write_bytes(content.tobytes())

    write_atomic(path, write)
