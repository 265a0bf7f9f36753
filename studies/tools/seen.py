"""What is seen of a tool before it is touched: its geometry, and its materials.

A tool's materials are recognised if it is detected at all, and at least four fifths of its pixels lie in areas that
show mostly the material they show, by the renderer's label of every pixel: as many as in the least pure area that the
segmentation for ellipsoids accepts.
"""

import enum
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.belief.colour_recognition import CERTAIN, compute_colour_probabilities
from affordance.exceptions import SeeingError
from affordance.objects.colour import Colour
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.vision.eye import measure_drawing
from affordance.vision.features import ComponentFeatures
from affordance.vision.pixels.camera_sensor import CameraSensor, find_presented_pose
from affordance.vision.pixels.looks import COLOUR_SD, Look
from affordance.vision.pixels.seen_tool import Method, detect_tool


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
    tool: Tool, stand: CameraSensor, rng: np.random.Generator, sources: Sequence[Source]
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
                found[source] = seen.compute_features(method, find_presented_pose(tool))
    return found


MIN_PURITY = 0.8
# Least probability of a material that is listed as a candidate for an appearance.
_WORTH_NAMING = 0.05


class Outcome(NamedTuple):
    """Result of looking at a tool.

    Attributes:
        purity: Fraction of its pixels that lie in areas which show mostly their own material.
        unsure: Candidate materials of each appearance that is not identified with certainty.
        problem: Reason for which the tool was not detected; empty if it was.
    """

    purity: float
    unsure: tuple[tuple[str, ...], ...] = ()
    problem: str = ""

    @property
    def made_out(self) -> bool:
        """True if the tool was detected with sufficient purity."""
        return not self.problem and self.purity >= MIN_PURITY


def examine(tool: Tool, stand: CameraSensor, materials: Mapping[str, Material], rng: np.random.Generator) -> Outcome:
    """Takes two pictures of a tool, and compares the detected materials with the true ones."""
    photographs = stand.take_pictures(tool, rng)
    try:
        seen = detect_tool(photographs, stand.rig, stand.noise)
    except SeeingError as error:
        return Outcome(0.0, problem=error.reason)
    names = np.array([part.looks_like.name for part in tool.components])
    own = total = 0
    for view, labels in zip(seen.views, stand.render_labels(tool), strict=True):
        column, row = view.surface.corner.astype(int)
        height, width = view.labels.shape
        bodies = labels[row : row + height, column : column + width]
        total += int((labels >= 0).sum())
        both = (bodies >= 0) & (view.labels >= 0)
        for number in np.unique(view.labels[both]):
            shown = names[bodies[both & (view.labels == number)]]
            own += int(np.unique(shown, return_counts=True)[1].max())
    candidates = [list_candidates(look, materials) for look in seen.looks]
    return Outcome(own / total, tuple(each for each in candidates if len(each) > 1))


def list_candidates(look: Look, materials: Mapping[str, Material]) -> tuple[str, ...]:
    """Lists the candidate materials of an appearance, the most probable first; a single one if it is certain."""
    colours = [material.colour for material in materials.values()]
    probabilities = compute_colour_probabilities(look.colour, COLOUR_SD, colours, look.lightness_sd)
    names = [*materials, "one never seen"]
    order = np.argsort(probabilities)[::-1]
    if probabilities[order[0]] >= CERTAIN:
        return (names[order[0]],)
    return tuple(names[index] for index in order if probabilities[index] >= _WORTH_NAMING)


def paint(tool: Tool, colours: Sequence[Colour | None]) -> Tool:
    """Recolours each part of a tool; None keeps the colour of its own material.

    The materials keep their names, by which areas are compared.
    """
    parts = []
    for part, colour in zip(tool.components, colours, strict=True):
        shown = part.looks_like if colour is None else replace(part.looks_like, colour=colour)
        parts.append(replace(part, looks_like=shown))
    return replace(tool, components=tuple(parts))
