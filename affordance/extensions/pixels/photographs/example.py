"""Synthetic example images: a full can, a larger can, an empty decoy that looks like it, and a hammer."""

import json
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from affordance.exceptions import describe_choice
from affordance.extensions.pixels.photographs.camera import PinholeCamera
from affordance.extensions.pixels.photographs.ray_scene import (
    ScenePart,
    box_gauge,
    cast_scene,
    cylinder_gauge,
    look_at,
    spoil,
)
from affordance.extensions.pixels.rgbd import Picture
from affordance.files.atomic import write_atomic, write_text
from affordance.objects.colour import Colour
from affordance.objects.tool_entries import build_pose

# Intrinsics similar to the colour camera of a RealSense D435 at this resolution, [pixels].
_CAMERA = PinholeCamera(640, 480, 610.0, 610.0, 321.5, 238.0)
_YELLOW, _RED, _WOOD, _GREY = (0.85, 0.70, 0.15), (0.70, 0.18, 0.15), (0.72, 0.52, 0.30), (0.45, 0.46, 0.48)
# Radius and height, [m], and mass, [kg], of the can in each image.
CANS = {"can": (0.037, 0.105, 0.46), "large_can": (0.045, 0.125, 0.80), "decoy": (0.045, 0.125, 0.09)}
# Hammer on the table: half length and radius of the handle, half lengths of the head, [m].
_HANDLE, _HEAD = (0.11, 0.013), (0.018, 0.05, 0.018)
NAMES = (*CANS, "hammer")


def cast_example(name: str) -> tuple[Picture, PinholeCamera]:
    """Renders the example image with one of the ``NAMES``, including camera errors.

    Raises:
        ValueError: The name is unknown.
    """
    if name not in NAMES:
        raise ValueError(describe_choice(name, NAMES))
    number = NAMES.index(name)
    parts = list(_build_hammer() if name == "hammer" else _build_can(*CANS[name][:2], _YELLOW))
    if name in CANS:  # box behind the can
        X = build_pose([0.17, 0.12, 0.06], (0.0, 0.0, 25.0))
        parts.append(ScenePart(box_gauge([0.05, 0.03, 0.06], X), X[:3, 3], 0.09, _RED))
    picture, shown = cast_scene(parts, _CAMERA, look_at(0.75, np.radians(42.0), np.radians(6.0 * number)))
    return spoil(picture, shown, _CAMERA, np.random.default_rng(number)), _CAMERA


def write_examples(folder: Path) -> list[Path]:
    """Writes NAME.png, NAME_depth.png in mm, and camera.json, and returns the paths of the colour images."""
    paths = []
    for name in NAMES:
        picture, camera = cast_example(name)
        depth = np.rint(1e3 * np.nan_to_num(picture.depth)).astype(np.uint16)
        for path, array in ((folder / f"{name}.png", picture.colour), (folder / f"{name}_depth.png", depth)):
            write_atomic(path, partial(Image.fromarray(array).save, format="PNG"))
        paths.append(folder / f"{name}.png")
    values = {key: value for key, value in camera._asdict().items() if value is not None}
    write_text(folder / "camera.json", json.dumps(values) + "\n")
    return paths


def _build_can(radius: float, height: float, colour: Colour) -> list[ScenePart]:
    X = build_pose([0.0, 0.0, 0.5 * height])
    return [ScenePart(cylinder_gauge(radius, 0.5 * height, X), X[:3, 3], float(np.hypot(radius, height)), colour)]


def _build_hammer() -> list[ScenePart]:
    (half, radius), head = _HANDLE, np.array(_HEAD)
    X_handle = build_pose([-0.02, 0.0, head[2]], (0.0, 90.0, 0.0))
    X_head = build_pose([half + head[0] - 0.02, 0.0, head[2]])
    return [
        ScenePart(cylinder_gauge(radius, half, X_handle), X_handle[:3, 3], 1.2 * half, _WOOD),
        ScenePart(box_gauge(_HEAD, X_head), X_head[:3, 3], 1.1 * float(np.linalg.norm(head)), _GREY),
    ]
