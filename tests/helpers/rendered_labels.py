"""Which part of a tool each pixel shows, from the renderer."""

import numpy as np
from numpy.typing import NDArray

from affordance.extensions.pixels.rig import DEFAULT_RIG, Rig, render_images
from affordance.objects.tool import Tool


def render_labels(tool: Tool, rig: Rig = DEFAULT_RIG) -> NDArray[np.int32]:
    """Renders the index of the part that each pixel shows, -1 for none, (height, width)."""
    (labels,) = render_images(tool, rig, ("labels",))
    labels = labels[:, :, 0].astype(np.int32)
    labels[(labels < 0) | (labels >= len(tool.components))] = -1
    return labels
