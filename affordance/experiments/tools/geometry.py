"""What is known of a tool's geometry before it is touched: its drawing, or pictures of it."""

import enum
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures, VisionError, measure_features
from affordance.vision.pixels.seen_tool import Method, detect_tool
from affordance.vision.pixels.turning_stand import TurningStand

# What drawings are off by: parity of mass within 0.3 %, of centres of mass within 0.15 mm, as on all
# twenty tools (docs/tools.md says what is blind and what is not).
CAD_VOLUME_SD, CAD_PLACE_SD = 4e-3, 2e-4


class Source(enum.Enum):
    """Where the geometry comes from."""

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
    """Measures a tool as it is held, by each source; all that see look at the same pictures.

    Args:
        tool: The tool in one grip, and no choice of grip any more.
        stand: Where it is looked at.
        rng: Draws the noise of the pictures.
        sources: What is asked for.

    Raises:
        SeeingError: The pictures do not show what is needed.
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
    """The tool as it was drawn, with what a drawing is off by: a part's volume, and its place along each axis."""
    features = []
    for part in measure_features(tool, VisionError(), np.random.default_rng(0)):
        deformations = np.zeros((4, 4, 4))
        strain = CAD_VOLUME_SD / 3.0
        deformations[0, :3, :3] = strain * np.eye(3)
        deformations[0, :3, 3] = -strain * part.X_TE[:3, 3]
        deformations[1:, :3, 3] = CAD_PLACE_SD * np.eye(3)
        features.append(replace(part, deformations=deformations))
    return tuple(features)
