"""Photographs with hand-drawn object masks, kinds and published masses, and true volumes from published surfaces."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import scipy

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.pixels.photographs.camera import PinholeCamera
from affordance.extensions.pixels.photographs.pictures import read_colour, read_depth
from affordance.extensions.pixels.photographs.see import SeenObject, see
from affordance.extensions.pixels.photographs.seen_picture import write_seen
from affordance.files.bounded import read_yaml

LABELS = Path(__file__).with_name("pictures.yaml")
# Folders of images and surfaces in a clone of github.com/yuxng/PoseCNN.
_IMAGES, _SURFACES = Path("data") / "demo_images", Path("data") / "LOV" / "models"
# Voxel size and radius of the morphological closing for concave objects, [m].
_GRID, _CLOSING = 3e-3, 0.012


class Reading(NamedTuple):
    """Measurement of an object in an image, with its true volume and mass."""

    picture: str
    name: str
    seen: SeenObject
    volume: float  # true outer volume, [m^3]
    mass: float  # published mass, [kg]
    kind: str | None  # kind of object, as a user would name it; None if unknown


def check_data(data: Path) -> Path:
    """Checks that a folder is a clone of PoseCNN. Otherwise a BadValueError is raised."""
    if not (data / _IMAGES).is_dir():
        problem = f"has no {_IMAGES}, must be a clone of github.com/yuxng/PoseCNN"
        raise BadValueError(data, "", problem)
    return data


def read_all(data: Path, out: Path) -> Iterator[Reading]:
    """Measures all objects in all images, and writes a drawing of each to a folder."""
    labels: dict[str, Any] = read_yaml(LABELS)
    camera = PinholeCamera(**labels["camera"])
    for picture, outlines in labels["pictures"].items():
        colour = read_colour(data / _IMAGES / f"{picture}-color.png")
        depth = read_depth(
            data / _IMAGES / f"{picture}-depth.png", (camera.width, camera.height), labels["depth_unit"]
        )
        for name, corners in outlines.items():
            thing = labels["objects"][name]
            mask = cv2.fillPoly(np.zeros(depth.shape, np.uint8), [np.array(corners).reshape(-1, 1, 2)], (1,)) > 0
            seen = see(colour, depth, camera, mask=mask)
            write_seen(out / f"{picture}_{name}.png", seen, colour)
            points = np.loadtxt(data / _SURFACES / name / "points.xyz")
            volume = measure_volume(points, is_concave=thing.get("concave", False))
            yield Reading(picture, name, seen, volume, thing["mass"], thing.get("holds"))


def measure_volume(points: Array, *, is_concave: bool) -> float:
    """Computes the volume, [m^3], inside surface points, (n, 3), [m].

    It is the volume of their convex hull or, for concave objects, of their morphological closing.
    """
    if not is_concave:
        return float(scipy.spatial.ConvexHull(points).volume)
    low = points.min(axis=0) - 3.0 * _CLOSING
    cells = ((points - low) / _GRID).astype(int)
    away = np.ones(cells.max(axis=0) + int(3.0 * _CLOSING / _GRID) + 2, dtype=bool)
    away[tuple(cells.T)] = False
    grown = scipy.ndimage.binary_fill_holes(scipy.ndimage.distance_transform_edt(away) * _GRID <= _CLOSING)
    return float((scipy.ndimage.distance_transform_edt(grown) * _GRID > _CLOSING).sum() * _GRID**3)
