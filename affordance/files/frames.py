"""Saves pictures in which no features were found."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import SeeingError
from affordance.files.atomic import write_atomic


def save_frame(error: SeeingError, folder: Path, name: str) -> SeeingError:
    """Saves the picture of an error, and returns the error with the file's path.

    NAME.npz contains the arrays ``colour`` and ``depth``. NAME.png shows them side by side, with near points bright
    and distant points dark.
    """
    path = folder / f"{name}.npz"
    write_atomic(path, lambda temporary: np.savez_compressed(temporary, colour=error.colour, depth=error.depth))
    if error.colour.ndim == 3 and error.colour.shape[:2] == error.depth.shape and error.colour.shape[2] == 3:
        image = np.hstack([error.colour[:, :, ::-1].astype(np.uint8), _show_depth(error.depth)])
        write_atomic(path.with_suffix(".png"), lambda temporary: cv2.imwrite(str(temporary), image))
    return type(error)(error.reason, error.colour, error.depth, str(path))


def _show_depth(depth: Array) -> NDArray[np.uint8]:
    """Converts depth to shades of grey, (height, width, 3). Pixels without a reading are black."""
    read = np.isfinite(depth) & (depth > 0.0)
    grey = np.zeros((*depth.shape, 1), dtype=np.uint8)
    if read.any():
        low, high = depth[read].min(), depth[read].max()
        grey[read, 0] = np.rint(255.0 - 205.0 * (depth[read] - low) / max(high - low, 1e-6)).astype(np.uint8)
    return np.repeat(grey, 3, axis=2)
