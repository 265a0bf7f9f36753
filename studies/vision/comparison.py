"""Errors of the features detected of an object."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.colour import convert_to_lab
from affordance.objects.tool import Tool
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.pixels.camera_sensor import get_camera_sensor
from affordance.vision.pixels.pipeline import Detection
from affordance.vision.systems import predict_object
from studies.vision.random_objects import MAX_PARTS


class Comparison(NamedTuple):
    """Errors of the features detected of an object; NaN for parts it does not have."""

    visible_error: Array  # relative errors of the two semi-axes across the view, (MAX_PARTS, 2)
    depth_error: Array  # relative error of the semi-axis along the view, (MAX_PARTS,)
    colour_error: Array  # distance of each part's colour from the true one in CIELAB, (MAX_PARTS,)
    mass_error: float  # relative error of the mass at the true densities
    mass_deviation: float  # error of the mass in its predicted standard deviations


NOTHING = Comparison(
    np.full((MAX_PARTS, 2), np.nan), np.full(MAX_PARTS, np.nan), np.full(MAX_PARTS, np.nan), np.nan, np.nan
)


def compare(tool: Tool, detection: Detection) -> Comparison:
    """Compares the detected features of an object, of all its parts, with the true ones."""
    X_TC = get_camera_sensor().rig.compute_camera_pose(tool)
    features = detection.compute_features(X_TC)
    places = np.array([part.X_TE[:3, 3] for part in tool.components])
    found = np.array([part.X_TE[:3, 3] for part in features])
    true_of, seen_of = linear_sum_assignment(np.linalg.norm(places[:, None] - found[None], axis=2))
    visible, depth, colours = (np.array(values) for values in NOTHING[:3])
    matched = []
    for i, j in zip(true_of, seen_of, strict=True):
        true, part = tool.components[i], features[j]
        # Axes are paired by direction; the depth axis is the true one closest to the line of sight.
        alignment = np.abs(true.X_TE[:3, :3].T @ part.X_TE[:3, :3])
        _, pairs = linear_sum_assignment(-(alignment**2))
        errors = part.shape.sizes[pairs] / true.shape.sizes - 1.0
        view = true.X_TE[:3, 3] - X_TC[:3, 3]
        along = int(np.argmax(np.abs(true.X_TE[:3, :3].T @ view)))
        depth[i], visible[i] = errors[along], np.delete(errors, along)
        colours[i] = np.linalg.norm(
            convert_to_lab(np.array(part.colour)) - convert_to_lab(np.array(true.looks_like.colour))
        )
        matched.append(replace(part, colour=true.looks_like.colour, colour_sd=0.0))
    memory = MaterialMemory.from_densities(
        {part.looks_like.colour: part.material.density for part in tool.components}
    )
    geometry = predict_object(matched, memory, DEFAULT_SETTINGS.prior).geometry
    rho = memory.belief.untruncated_mean
    mass = float(geometry.Phi[0] @ rho)
    sd = math.sqrt(geometry.compute_covariance(rho)[0, 0])
    return Comparison(visible, depth, colours, mass / tool.mass - 1.0, (mass - tool.mass) / sd)
