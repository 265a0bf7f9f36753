"""Geometry of a tool as its drawing gives it, with what drawings are off by."""

from dataclasses import replace

import numpy as np

from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures, VisionError, measure_features

# What drawings are off by: parity of mass within 0.3 %, of centres of mass within 0.15 mm, as on all
# twenty tools (docs/tools.md says what is blind and what is not).
CAD_VOLUME_SD, CAD_PLACE_SD = 4e-3, 2e-4


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
