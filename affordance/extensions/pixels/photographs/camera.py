"""Camera intrinsics from files of common programs.

The ray of a pixel (u, v), column and row, has the direction ((u - cx) / fx, (v - cy) / fy, 1). Camera matrices are
stored in row-major order by ROS and BOP, and in column-major order by Open3D and Record3D. The position of the
principal point, which is never zero, distinguishes both.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import BadValueError, show_value
from affordance.files.bounded import read_json, read_yaml

_MATRICES = ("cam_K", "K", "k", "intrinsic_matrix", "camera_matrix")
_DISTORTIONS = ("D", "d", "distortion", "distortion_coefficients", "dist_coeffs", "coeffs")
_WIDTHS, _HEIGHTS = ("width", "image_width", "w"), ("height", "image_height", "h")
_FORMS = "width, height, fx, fy, cx and cy; or a matrix K of ROS, BOP, Open3D or Record3D"
_FOCAL_MIN, _FOCAL_MAX = 50.0, 20_000.0
_TINY = 1e-9


class PinholeCamera(NamedTuple):
    """Pinhole camera without distortion; lengths are in pixels."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    depth_unit: float | None = None  # unit of depth images, [m]; None if unknown

    def compute_rays(self, columns: NDArray[Any], rows: NDArray[Any]) -> Array:
        """Computes ray directions of pixels in C with unit depth, (..., 3)."""
        x, y = (columns - self.cx) / self.fx, (rows - self.cy) / self.fy
        return np.stack([x, y, np.ones_like(x)], axis=-1)

    def project(self, p_C: Array) -> Array:
        """Projects points in C, (..., 3), to pixels, column and row, (..., 2)."""
        return np.stack(
            [
                self.fx * p_C[..., 0] / p_C[..., 2] + self.cx,
                self.fy * p_C[..., 1] / p_C[..., 2] + self.cy,
            ],
            axis=-1,
        )


def read_camera(path: Path, size: tuple[int, int], picture: str = "", *, is_cropped: bool = False) -> PinholeCamera:
    """Reads camera intrinsics.

    Args:
        path: JSON or YAML file.
        size: Width and height of the image, [pixels].
        picture: File name of the image, whose number selects an entry in a file with one entry per image (BOP).
        is_cropped: True to allow a principal point outside the middle third of the image.

    Raises:
        BadValueError: The file is unreadable, has an unknown format, is for another image size, or has distortion.
    """
    content = read_json(path) if path.suffix.lower() == ".json" else read_yaml(path)
    if not isinstance(content, Mapping) or not content:
        raise BadValueError(path, "", f"is no mapping, must have {_FORMS}")
    key = ""
    if all(str(each).isdigit() for each in content):
        key, content = _choose_entry(path, content, picture)
    _check_distortion(path, key, content)
    values = _read_values(path, key, content)
    width = _take_size(path, content, _WIDTHS, size[0])
    height = _take_size(path, content, _HEIGHTS, size[1])
    if (width, height) != size:
        problem = f"is of pictures of {width} x {height} pixels, but this one has {size[0]} x {size[1]}"
        raise BadValueError(path, key, f"{problem}; give the intrinsics of this resolution")
    for name, focal in zip(("fx", "fy"), values[:2], strict=True):
        if not _FOCAL_MIN <= focal <= _FOCAL_MAX:
            raise BadValueError(
                path, _join(key, name), f"is {focal:g}, must be from {_FOCAL_MIN:g} to {_FOCAL_MAX:g} pixels"
            )
    for name, centre, length in zip(("cx", "cy"), values[2:], size, strict=True):
        if not (0.0 <= centre <= length if is_cropped else length / 3.0 <= centre <= 2.0 * length / 3.0):
            problem = f"is {centre:g}, must be in the middle third of {length} pixels"
            hint = "the intrinsics of this resolution; --cropped for a picture that was cut"
            raise BadValueError(path, _join(key, name), f"{problem}: give {hint}")
    unit = content.get("depth_scale")
    depth_unit = None if unit is None else 1e-3 * _read_number(path, "depth_scale", unit)
    fx, fy, cx, cy = values
    return PinholeCamera(width, height, fx, fy, cx, cy, depth_unit)


def _choose_entry(path: Path, content: Mapping[Any, Any], picture: str) -> tuple[str, Mapping[str, Any]]:
    """Selects the entry with the number of the image in scene_camera.json of BOP."""
    numbers = re.findall(r"\d+", Path(picture).stem)
    by_number = {int(name): name for name in content}
    name = next(iter(content)) if len(content) == 1 else by_number.get(int(numbers[0]) if numbers else -1)
    if name is None or not isinstance(content[name], Mapping):
        problem = f"has {len(content)} entries by picture, none for {picture or 'this picture'}"
        raise BadValueError(path, "", f"{problem}: the picture must keep its number as its name, such as 000001.png")
    return str(name), content[name]


def _check_distortion(path: Path, key: str, content: Mapping[str, Any]) -> None:
    for name in _DISTORTIONS:
        found = content.get(name)
        found = found.get("data") if isinstance(found, Mapping) else found
        if isinstance(found, list) and any(isinstance(each, int | float) and abs(each) > _TINY for each in found):
            problem = "is not zero: undistort both pictures first (ROS image_proc, cv2.undistort), and give the"
            raise BadValueError(path, _join(key, name), f"{problem} intrinsics of the undistorted ones")


def _read_values(path: Path, key: str, content: Mapping[str, Any]) -> list[float]:
    """Reads fx, fy, cx and cy. The last two can have the names used by librealsense."""
    names = ("fx", "fy", "cx", "cy")
    content = {{"ppx": "cx", "ppy": "cy"}.get(name, name): value for name, value in content.items()}
    if all(name in content for name in names):
        return [_read_number(path, _join(key, name), content[name]) for name in names]
    for name in _MATRICES:
        if name in content:
            break
    else:
        missing = ", ".join(each for each in names if each not in content)
        raise BadValueError(path, key, f"has no {missing}; must have {_FORMS}")
    found = content[name]
    found = found.get("data") if isinstance(found, Mapping) else found
    try:
        K = np.array(found, dtype=float).reshape(3, 3)
    except (TypeError, ValueError):
        K = np.full((3, 3), np.nan)
    if abs(K[0, 2]) + abs(K[1, 2]) < _TINY:
        K = K.T  # column-major order
    pattern = np.array([[1, 0, 1], [0, 1, 1], [0, 0, 1]], dtype=bool)
    if not np.isfinite(K).all() or abs(K[~pattern]).max() > _TINY or abs(K[2, 2] - 1.0) > _TINY:
        problem = f"is {show_value(found)}, must be the nine numbers of [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"
        raise BadValueError(path, _join(key, name), problem)
    return [float(each) for each in (K[0, 0], K[1, 1], K[0, 2], K[1, 2])]


def _take_size(path: Path, content: Mapping[str, Any], names: tuple[str, ...], default: int) -> int:
    for name in names:
        if name in content:
            return round(_read_number(path, name, content[name]))
    return default


def _read_number(path: Path, key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value) or value <= 0.0:
        raise BadValueError(path, key, f"is {show_value(value)}, must be a number greater than 0")
    return float(value)


def _join(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name
