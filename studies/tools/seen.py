"""Geometry and materials of a tool as seen before it is touched.

The materials of a tool count as recognised if the tool is detected, and if at least four fifths of its pixels lie in
areas that mostly show the same material as the pixel itself, by the renderer's labels. Four fifths is the purity of
the least pure area that the segmentation for ellipsoids accepts.
"""

import enum
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.colour_recognition import CERTAIN, compute_colour_probabilities
from affordance.exceptions import SeeingError
from affordance.objects.array_solids import ColumnSolid
from affordance.objects.colour import Colour
from affordance.objects.inertia import Ellipsoid
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.objects.tool_entries import build_pose
from affordance.vision.eye import measure_drawing
from affordance.vision.features import ComponentFeatures
from affordance.vision.pixels.camera_sensor import CameraSensor, Photograph, find_presented_pose, present
from affordance.vision.pixels.columns import View, build_columns, collect_columns, find_sheets
from affordance.vision.pixels.looks import COLOUR_SD, Look
from affordance.vision.pixels.rgbd import Labels
from affordance.vision.pixels.rig import DEFAULT_RIG, Rig, render_images
from affordance.vision.pixels.seen_tool import ERROR, SolidError, describe_solid, detect_tool
from affordance.vision.pixels.segmentation import spread_nearest


class Source(enum.Enum):
    """Source of the geometry."""

    CAD = "cad"
    TWO_VIEWS = "two_views"
    ONE_VIEW = "one_view"
    ELLIPSOID = "ellipsoid"


# Errors over the ten learning tools at their true densities; two views are as accurate as the six of observers.
ERRORS: Mapping[Source, SolidError] = {
    Source.TWO_VIEWS: ERROR,
    Source.ONE_VIEW: SolidError(bias=0.36, log_volume_sd=0.36, place_sd=0.056),
    Source.ELLIPSOID: SolidError(bias=1.11, log_volume_sd=0.83, place_sd=0.05),
}

# Percentile of the surface's height that counts as the object's height, because a small part may protrude, [%].
_HEIGHT_PERCENTILE = 75.0
MIN_PURITY = 0.8
# Least probability for which a material is listed as a candidate for an appearance.
_WORTH_NAMING = 0.05


def measure_all(
    tool: Tool, stand: CameraSensor, rng: np.random.Generator, sources: Sequence[Source]
) -> dict[Source, tuple[ComponentFeatures, ...]]:
    """Measures a tool, held in its only grip, from each source; all sources that see share the same pictures.

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
    """Measures the form of a tool that was presented at X_TP, (4, 4), from a source that sees.

    Columns are built between two views or behind one; a source of ellipsoids replaces each solid with the ellipsoid
    of the same moments.
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


def build_mirrored_columns(above: View, stand_height: float) -> dict[int, ColumnSolid]:
    """Builds the solid of each look behind one view, as if the far side were the mirror image of the near one.

    The near side is mirrored at half of the object's height. Nothing is below the stand, whose top is at stand_height
    along Pz, [m], and every column reaches at least half of the way down to it: low parts rest on the stand, and high
    parts may rest on others.
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

    The second moments of a solid ellipsoid are m a^2 / 5. Its volume differs from that of the solid, which is the
    error of an observer that assumes ellipsoids. Axes of the solid are along those of P.
    """
    J = solid.unit_pseudo_inertia()
    squares, axes = np.linalg.eigh(J[:3, :3] / J[3, 3])
    a, b, c = (float(size) for size in np.sqrt(5.0 * squares[::-1]))
    X_PE = build_pose(p_PEo)
    X_PE[:3, :3] = axes[:, ::-1]
    X_PE[:3, 2] *= np.sign(np.linalg.det(axes[:, ::-1]))
    return Ellipsoid((a, b, c)), X_PE


class Outcome(NamedTuple):
    """Result of looking at a tool in pictures."""

    purity: float  # fraction of the tool's pixels that lie in areas which mostly show the pixel's own material
    # Candidate materials of each appearance that does not determine its material.
    unsure: tuple[tuple[str, ...], ...] = ()
    problem: str = ""  # reason why the tool was not detected; empty if it was

    @property
    def made_out(self) -> bool:
        """True if the tool was detected with sufficient purity."""
        return not self.problem and self.purity >= MIN_PURITY


def render_labels(tool: Tool, rig: Rig = DEFAULT_RIG) -> Labels:
    """Renders the index of the part that each pixel shows, -1 for none, (height, width)."""
    (labels,) = render_images(tool, rig, ("labels",))
    labels = labels[:, :, 0].astype(np.int32)
    labels[(labels < 0) | (labels >= len(tool.components))] = -1
    return labels


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
    """Lists the candidate materials of an appearance, the most probable first; only one if it is certain."""
    colours = [material.colour for material in materials.values()]
    probabilities = compute_colour_probabilities(look.colour, COLOUR_SD, colours, look.lightness_sd)
    names = [*materials, "one never seen"]
    order = np.argsort(probabilities)[::-1]
    if probabilities[order[0]] >= CERTAIN:
        return (names[order[0]],)
    return tuple(names[index] for index in order if probabilities[index] >= _WORTH_NAMING)


def paint(tool: Tool, colours: Sequence[Colour | None]) -> Tool:
    """Recolours each part of a tool; None keeps the colour of its own material.

    Materials keep their names, because areas are compared by these.
    """
    parts = []
    for part, colour in zip(tool.components, colours, strict=True):
        shown = part.looks_like if colour is None else replace(part.looks_like, colour=colour)
        parts.append(replace(part, looks_like=shown))
    return replace(tool, components=tuple(parts))
