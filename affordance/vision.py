"""What the eye measures of a presented object: its features, with the error of measuring them.

The paper assumes an algorithm that recovers the three-dimensional sizes of ellipsoids from pictures. Here the true
features are handed over with a stated error, which by default is none.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.tools import Tool
from affordance.visual_prior import ComponentFeatures


class VisionError(NamedTuple):
    """Standard deviations of the eye's measurements.

    Attributes:
        size: Of each axis length, as a fraction of it.
        position: Of each coordinate of a component's centre, [m].
        rotation: About each axis, [rad].
    """

    size: float = 0.0
    position: float = 0.0
    rotation: float = 0.0


def observe(tool: Tool, error: VisionError, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
    """Measures a tool: its true features plus normally distributed errors.

    Sizes are multiplied by the exponential of their error, so that they stay positive.
    """
    features = []
    for component in tool.components:
        sizes = component.shape.sizes
        X_TE = np.array(component.X_TE)
        sizes = sizes * np.exp(error.size * rng.standard_normal(len(sizes)))
        X_TE[:3, 3] += error.position * rng.standard_normal(3)
        X_TE[:3, :3] = Rotation.from_rotvec(error.rotation * rng.standard_normal(3)).as_matrix() @ X_TE[:3, :3]
        features.append(
            ComponentFeatures(
                component.looks_like.colour,
                component.shape.with_sizes(sizes),
                X_TE,
                error.size,
                error.position,
                error.rotation,
            )
        )
    return tuple(features)
