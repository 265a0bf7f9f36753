"""What is known of a tool's geometry before it is touched: its drawing, or pictures of it."""

import enum
from collections.abc import Sequence

import numpy as np

from affordance.objects.tool import Tool
from affordance.vision.drawing import measure_drawing
from affordance.vision.features import ComponentFeatures
from affordance.vision.pixels.seen_tool import Method, detect_tool
from affordance.vision.pixels.turning_stand import TurningStand


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
