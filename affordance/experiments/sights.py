"""What an experiment's objects looked like to the camera, for its section of the report."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from affordance import figures
from affordance.eye import get_eye
from affordance.report import Picture, Section
from affordance.seed_streams import Stream
from affordance.settings import Settings, Sight
from affordance.sight_drawings import Look, draw_sights
from affordance.tools import Tool


def show_sights(section: Section, folder: Path, tools: Sequence[Tool], settings: Settings, seed: int) -> Section:
    """Adds a picture of what was seen of each object to a section, if features come from pictures at all.

    Args:
        section: What the experiment reports.
        folder: Receives ``seen.png`` and ``seen.svg``.
        tools: The objects.
        settings: Say where features come from.
        seed: Root of every random draw.
    """
    if settings.sight is Sight.FEATURES:
        return section
    eye = get_eye()
    sights = []
    for index, tool in enumerate(tools):
        picture = eye.take_picture(tool, np.random.default_rng([seed, Stream.SHOWN, index]))
        sights.append(Look(tool.name, picture, eye.see(picture)))
    figures.save_figure(draw_sights(sights, eye.rig.camera), folder, "seen")
    caption = (
        "What the camera saw of each object before the hand took it: colour, depth (white where nothing was read), "
        "parts made out, and outlines of the ellipsoids fitted to them. Features came from such pictures, no others."
    )
    return section._replace(pictures=[*section.pictures, Picture("seen.png", caption)])
