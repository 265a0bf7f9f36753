"""Files of colour and depth images. Their size is checked before they are decoded."""

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from affordance.arrays import Array, Mask
from affordance.exceptions import BadValueError
from affordance.files.bounded import read_bytes

# Largest size of an image file, [bytes], and smallest and largest width and height, [pixels].
_FILE, _SIDE_MIN, _SIDE_MAX = 100_000_000, 16, 8192
# Most common unit of integer depth images, [m].
USUAL_UNIT = 1e-3
_UNITS = (1e-3, 1e-4, 2e-4, 2.5e-4)
# Smallest and largest median depth of an image of hand-held objects, [m].
_NEAREST, _FARTHEST = 0.1, 5.0
_LEAST_READ = 0.1  # smallest fraction of pixels with a depth reading
_ALIGN = (
    "register depth to colour first: rs.align(rs.stream.color) of RealSense, depth_image_to_color_camera of Azure "
    "Kinect, depth_registration of OpenNI"
)


def read_colour(path: Path) -> NDArray[np.uint8]:
    """Reads a PNG, JPEG or TIFF file as RGB, (height, width, 3). Other files raise a BadValueError."""
    return np.asarray(_decode(path, ("PNG", "JPEG", "TIFF"), "RGB"), dtype=np.uint8)


def read_mask(path: Path, size: tuple[int, int]) -> Mask:
    """Reads a PNG mask, (height, width), in which only pixels of the object are not black.

    Raises:
        BadValueError: The mask has another size than (width, height), or is all black.
    """
    mask: Mask = np.asarray(_decode(path, ("PNG",), "L")) > 0
    _check_same_size(path, mask, size)
    if not mask.any():
        raise BadValueError(path, "", "is black, must be white where it shows the object")
    return mask


def read_depth(path: Path, size: tuple[int, int], unit: float | None = None) -> Array:
    """Reads depth along the optical axis, (height, width), [m], with NaN for missing readings.

    Args:
        path: PNG file with 16 bits, TIFF file with 32-bit floats in m, or NPY file with floats in m or integers.
        size: Width and height of the colour image, [pixels].
        unit: Unit of integers, [m]; None for 1 mm.

    Raises:
        BadValueError: The file is unreadable, has another size than the colour image, or has another unit.
    """
    suffix = path.suffix.lower()
    found = _load_array(path) if suffix == ".npy" else np.asarray(_decode(path, ("PNG", "TIFF")))
    if found.ndim != 2 or found.dtype.kind not in "uif" or found.dtype.itemsize < 2:
        problem = f"has {found.dtype} of shape {found.shape}, must have one number of 16 or 32 bits per pixel"
        raise BadValueError(path, "", f"{problem}: a picture of depth for the eye does not say how far things are")
    _check_same_size(path, found, size)
    scale = 1.0 if found.dtype.kind == "f" else (unit or USUAL_UNIT)
    depth = scale * found.astype(float)
    depth[~(np.isfinite(depth) & (depth > 0.0))] = np.nan
    if np.isfinite(depth).mean() < _LEAST_READ:
        share = 100.0 * np.isfinite(depth).mean()
        raise BadValueError(
            path, "", f"has readings in {share:.0f} % of its pixels, must have {100 * _LEAST_READ:.0f} %"
        )
    median = float(np.nanmedian(depth))
    if not _NEAREST <= median <= _FARTHEST:
        fitting = [f"{each:g}" for each in _UNITS if _NEAREST <= median / scale * each <= _FARTHEST]
        hint = f"; --depth-unit {' or '.join(fitting)} would fit" if fitting else ""
        if found.dtype.kind == "f":
            hint = "; numbers with decimals must be in m"
        problem = f"shows things {median:.3g} m away in the median, must be from {_NEAREST:g} to {_FARTHEST:g} m"
        raise BadValueError(path, "", problem + hint)
    return depth


def _decode(path: Path, formats: tuple[str, ...], mode: str = "") -> Image.Image:
    """Decodes an image of limited size. Any other file raises a BadValueError."""
    content = read_bytes(path, _FILE)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # sizes are checked below
            picture = Image.open(io.BytesIO(content), formats=formats)
        _check_sides(path, *picture.size)
        return picture.convert(mode) if mode else picture.copy()
    except BadValueError:
        raise
    except Exception as error:  # decoders raise various exceptions for corrupt files
        problem = f"is no readable picture, must be {' or '.join(formats)}: {error}"
        raise BadValueError(path, "", problem) from error


def _load_array(path: Path) -> NDArray[Any]:
    try:
        found = np.load(io.BytesIO(read_bytes(path, _FILE)), allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise BadValueError(path, "", f"is no array of numbers: {error}") from error
    if not isinstance(found, np.ndarray):
        raise BadValueError(path, "", "holds several arrays, must be one array")
    if found.ndim == 2:
        _check_sides(path, found.shape[1], found.shape[0])
    return found


def _check_sides(path: Path, width: int, height: int) -> None:
    if min(width, height) < _SIDE_MIN or max(width, height) > _SIDE_MAX:
        problem = f"has {width} x {height} pixels, must have from {_SIDE_MIN} to {_SIDE_MAX} along each side"
        raise BadValueError(path, "", problem)


def _check_same_size(path: Path, found: NDArray[Any], size: tuple[int, int]) -> None:
    height, width = found.shape
    if (width, height) != size:
        problem = f"has {width} x {height} pixels, the colour picture {size[0]} x {size[1]}, must be the same"
        raise BadValueError(path, "", f"{problem}; {_ALIGN}")
