"""Meshes for tests."""

import numpy as np

CUBE_FACES = np.array(
    [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ]
)  # fmt: skip


def make_box(low, high):
    """Corners, (8, 3), and faces, (12, 3), of a box, wound outwards."""
    low, high = np.array(low, float), np.array(high, float)
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
    return low + bits * (high - low), CUBE_FACES.copy()


def join(*meshes):
    """Several meshes one after the other."""
    vertices, faces, count = [], [], 0
    for v, f in meshes:
        vertices.append(v)
        faces.append(f + count)
        count += len(v)
    return np.concatenate(vertices), np.concatenate(faces)


def write_obj(path, vertices, faces):
    """Writes a mesh as OBJ."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    path.write_text("\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]) + "\n")
    return path
