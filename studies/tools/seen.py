"""Geometry and materials of a tool as they are seen before it is touched.

A tool's materials are recognised if it is detected at all, and at least four fifths of its pixels lie in areas that
show mostly the material they show, by the renderer's label of every pixel: as many as in the least pure area that the
segmentation for ellipsoids accepts.
"""

import enum
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.colour_recognition import CERTAIN, compute_colour_probabilities
from affordance.exceptions import SeeingError
from affordance.objects.colour import Colour
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.objects.tool_entries import build_pose
from affordance.vision.eye import measure_drawing
from affordance.vision.features import ComponentFeatures
from affordance.vision.pixels.camera_sensor import CameraSensor, Photograph, find_presented_pose, present
from affordance.vision.pixels.columns import build_columns
from affordance.vision.pixels.looks import COLOUR_SD, Look
from affordance.vision.pixels.seen_tool import ERROR, SolidError, describe_solid, detect_tool
from studies.tools.forms import build_mirrored_columns, find_equal_ellipsoid
from studies.tools.labels import render_labels


class Source(enum.Enum):
    """Source of the geometry."""

    CAD = "cad"
    TWO_VIEWS = "two_views"
    ONE_VIEW = "one_view"
    ELLIPSOID = "ellipsoid"


# Errors over the ten learning tools at their true densities; two views are as wrong as the six of observers.
ERRORS: Mapping[Source, SolidError] = {
    Source.TWO_VIEWS: ERROR,
    Source.ONE_VIEW: SolidError(bias=0.36, log_volume_sd=0.36, place_sd=0.056),
    Source.ELLIPSOID: SolidError(bias=1.11, log_volume_sd=0.83, place_sd=0.05),
}


def measure_all(
    tool: Tool, stand: CameraSensor, rng: np.random.Generator, sources: Sequence[Source]
) -> dict[Source, tuple[ComponentFeatures, ...]]:
    """Measures a tool, held in its only grip, by each source; all sources of sight share the same pictures.

    Raises:
        SeeingError: The features cannot be extracted from the pictures.
    """
    found = {Source.CAD: measure_drawing(tool)} if Source.CAD in sources else {}
    if any(source in sources for source in ERRORS):
        photographs = stand.take_pictures(tool, rng)
        for source in ERRORS:
            if source in sources:
                found[source] = measure_form(photographs, stand, source, find_presented_pose(tool))
    return found


def measure_form(
    photographs: Sequence[Photograph], stand: CameraSensor, source: Source, X_TP: Array
) -> tuple[ComponentFeatures, ...]:
    """Measures the form of a tool that was presented at X_TP, (4, 4), by a source of sight.

    Columns stand between both sides, or behind one; with an ellipsoid per look these are of its moments.
    """
    error, is_mirrored = ERRORS[source], source is not Source.TWO_VIEWS
    seen = detect_tool(photographs[:1] if is_mirrored else photographs, stand.rig, stand.noise)
    stand_height = float(photographs[0].X_PC[2, 3]) - stand.rig.height
    solids = build_mirrored_columns(seen.views[0], stand_height) if is_mirrored else build_columns(*seen.views)
    parts = []
    for look, solid, p_PEo in seen.centre(solids, error):
        if source is Source.ELLIPSOID:
            parts.append(describe_solid(look, *find_equal_ellipsoid(solid, p_PEo), X_TP, error))
        else:
            parts.append(describe_solid(look, solid, build_pose(p_PEo), X_TP, error))
    return tuple(parts)


MIN_PURITY = 0.8
# Least probability of a material that is listed as a candidate for an appearance.
_WORTH_NAMING = 0.05


class Outcome(NamedTuple):
    """Result of looking at a tool."""

    purity: float  # fraction of its pixels that lie in areas which show mostly their own material
    # Candidate materials of each appearance that is not identified with certainty.
    unsure: tuple[tuple[str, ...], ...] = ()
    problem: str = ""  # reason for which the tool was not detected; empty if it was

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
    for view, side in zip(seen.views, present(tool), strict=True):
        labels = render_labels(side, stand.rig)
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
