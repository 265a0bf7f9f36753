"""A mallet of two boxes, of materials of the workshop, and inertial parameters of its features."""

from dataclasses import replace

import numpy as np

from affordance.extensions.pixels.camera_sensor import TURNING_RIG, CameraSensor
from affordance.objects.inertia import build_inertia_map
from affordance.objects.primitives import Box
from affordance.objects.striking_face import StrikingFace
from affordance.objects.tool import Component, Tool
from affordance.objects.tool_entries import build_pose
from helpers.workshop import MATERIALS

STAND = CameraSensor(TURNING_RIG)


def make_tool(*parts):
    """A tool of boxes: lengths, position and material of each."""
    components = []
    for lengths, position, name in parts:
        components.append(Component(Box(lengths), build_pose(np.array(position)), MATERIALS[name], MATERIALS[name]))
    return Tool("made up", tuple(components))


def weigh(features):
    """Ten inertial parameters of features, by the true densities of the nearest colours."""
    densities = []
    for part in features:
        gaps = {m.density: np.abs(np.subtract(m.colour, part.colour)).sum() for m in MATERIALS.values()}
        densities.append(min(gaps, key=gaps.get))
    shapes, poses = [part.shape for part in features], [part.X_TE for part in features]
    return build_inertia_map(shapes, poses, range(len(features)), len(features)) @ densities


# A handle next to a head: nothing is hidden.
FACE = StrikingFace("face", np.array([0.0, 0.04, 0.0]), np.array([0.0, 1.0, 0.0]))
HANDLE, HEAD = make_tool(
    ((0.2, 0.024, 0.02), (0.03, 0, 0), "oak"), ((0.03, 0.08, 0.03), (0.145, 0.01, 0), "brass")
).components
TOOL = Tool("mallet", (HANDLE, replace(HEAD, strikes=(FACE,))))
