"""Geometry of a tool before it is touched, from its drawing or from pictures."""

import enum
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures, VisionError, measure_features
from affordance.vision.pixels.seen_tool import Method, detect_tool
from affordance.vision.pixels.turning_stand import TurningStand

# Standard deviations of drawings: masses agree within 0.3 %, centres of mass within 0.15 mm, on all twenty tools
# (docs/tools.md says which comparisons are blind).
CAD_VOLUME_SD, CAD_PLACE_SD = 4e-3, 2e-4


class Source(enum.Enum):
    """Source of the geometry."""

    CAD = "cad"
    TWO_VIEWS = "two_views"
    ONE_VIEW = "one_view"
    ELLIPSOID = "ellipsoid"


_METHODS = {
    Source.TWO_VIEWS: Method.TWO_VIEWS,
    Source.ONE_VIEW: Method.ONE_VIEW,
    Source.ELLIPSOID: Method.ELLIPSOIDS,
}


def measure_all(
    tool: Tool, stand: TurningStand, rng: np.random.Generator, sources: Sequence[Source]
) -> dict[Source, tuple[ComponentFeatures, ...]]:
    """Measures a held tool by each source; all sources of sight share the same pictures.

    Args:
        tool: Tool in one grip, without further choice of grips.
        stand: Stand that takes the pictures.
        rng: Generator of the noise of the pictures.
        sources: Sources to measure by.

    Raises:
        SeeingError: The features cannot be extracted from the pictures.
    """
    found = {Source.CAD: measure_drawing(tool)} if Source.CAD in sources else {}
    if any(source in sources for source in _METHODS):
        photographs = stand.take_pictures(tool, rng)
        one, both = (detect_tool(used, stand.rig, stand.noise) for used in (photographs[:1], photographs))
        for source, method in _METHODS.items():
            if source in sources:
                seen = both if method is Method.TWO_VIEWS else one
                found[source] = seen.compute_features(method, np.eye(4))
    return found


def measure_drawing(tool: Tool) -> tuple[ComponentFeatures, ...]:
    """Measures a tool by its drawing, with errors of a part's volume and of its position along each axis."""
    features = []
    for part in measure_features(tool, VisionError(), np.random.default_rng(0)):
        deformations = np.zeros((4, 4, 4))
        strain = CAD_VOLUME_SD / 3.0
        deformations[0, :3, :3] = strain * np.eye(3)
        deformations[0, :3, 3] = -strain * part.X_TE[:3, 3]
        deformations[1:, :3, 3] = CAD_PLACE_SD * np.eye(3)
        features.append(replace(part, deformations=deformations))
    return tuple(features)
