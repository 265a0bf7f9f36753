"""Other ways to a solid than that of observers: mirrored behind one view, and an ellipsoid of equal moments."""

import numpy as np

from affordance.arrays import Array
from affordance.objects.array_solids import ColumnSolid
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool_entries import build_pose
from affordance.vision.pixels.columns import View, collect_columns, find_sheets
from affordance.vision.pixels.segmentation import spread_nearest

# Percentile of the surface's height that stands for the object's height, for some of the object may protrude, [%].
_HEIGHT_PERCENTILE = 75.0


def build_mirrored_columns(above: View, stand_height: float) -> dict[int, ColumnSolid]:
    """Builds the solid of each look behind one view, as if the far side were the mirror image of the near one.

    The near side is mirrored at half of the object's height. Nothing is below the stand, whose top is at
    stand_height along Pz, [m], and every column reaches at least half of the way down to it: low parts lie on the
    stand, high parts may be supported by others.
    """
    x, y, (sheet,) = find_sheets([above])
    top = spread_nearest(sheet.height, sheet.there)
    height = float(np.percentile(top[sheet.there], _HEIGHT_PERCENTILE)) - stand_height
    halfway = 0.5 * (top + stand_height)
    bottom = np.clip(2.0 * stand_height + height - top, stand_height, np.maximum(halfway, stand_height))
    label = spread_nearest(sheet.label, sheet.there)
    return collect_columns(x, y, share=sheet.there.astype(float), bottom=bottom, top=top, labels=[label, label])


def find_equal_ellipsoid(solid: ColumnSolid, p_PEo: Array) -> tuple[Ellipsoid, Array]:
    """Finds the ellipsoid with the second moments of a solid about its centroid p_PEo, and its pose X_PE, (4, 4).

    The second moments of a solid ellipsoid are m a^2 / 5. Its volume is not that of the solid: this is the error of
    an observer who assumes ellipsoids. Axes of the solid are along those of P.
    """
    J = solid.unit_pseudo_inertia()
    squares, axes = np.linalg.eigh(J[:3, :3] / J[3, 3])
    a, b, c = (float(size) for size in np.sqrt(5.0 * squares[::-1]))
    X_PE = build_pose(p_PEo)
    X_PE[:3, :3] = axes[:, ::-1]
    X_PE[:3, 2] *= np.sign(np.linalg.det(axes[:, ::-1]))
    return Ellipsoid((a, b, c)), X_PE
