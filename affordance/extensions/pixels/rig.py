"""Rig for observing objects: a plain stand, lamps, and a camera above.

The world frame W is in the middle of the stand's top, with Wz up. The camera frame C is above Wo, with Cx along Wx
and Cy along -Wy. The object, with frame T, is on the stand in its given orientation, with its bounding box in the
middle of the image. The rig has a separate Diagram, because the image is taken before the hand grasps the object
(docs/decisions/0015-vision-from-pixels.md).
"""

import gc
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake import geometry
from pydrake.math import RigidTransform
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from affordance.arrays import Array
from affordance.drake.renderer import make_renderer
from affordance.extensions.pixels.rgbd import Camera, Picture
from affordance.objects.colour import Colour
from affordance.objects.drake_geometry import make_drawn_shape
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Tool, find_box

_RENDERER = "vtk"
# Size of the stand, which is larger than the field of view, [m].
_STAND_SIZE = (1.6, 1.4, 0.02)
# Drake renders ellipsoids as inscribed polyhedra, which are 0.13 % too small on average
# (tests/extensions/pixels/test_rig.py). Ellipsoids are enlarged by this factor to compensate.
_FACETS = 1.0013
# Diagrams contain reference cycles of about 3 MB each. Garbage is collected after every tenth image.
_COLLECTED, _NUMBER = 10, itertools.count(1)


class Lamp(NamedTuple):
    """Lamp with parallel light."""

    direction_C: tuple[float, float, float]
    intensity: float  # radiance of a white surface facing the lamp, relative to saturation


def _tilt_lamp(azimuth_deg: float) -> tuple[float, float, float]:
    """Computes the light direction of a lamp at 45 degrees between the camera and the horizon."""
    azimuth = np.radians(azimuth_deg)
    x, y = np.sqrt(0.5) * np.cos(azimuth), np.sqrt(0.5) * np.sin(azimuth)
    return float(x), float(y), float(np.sqrt(0.5))


# One lamp at the camera and four around it illuminate all visible sides. Together they nearly saturate a white
# surface that faces the camera: 0.5 + 4 x 0.17 x cos(45 degrees) = 0.98.
LAMPS = (Lamp((0.0, 0.0, 1.0), 0.5), *(Lamp(_tilt_lamp(azimuth), 0.17) for azimuth in (0.0, 90.0, 180.0, 270.0)))


def compute_shading(normals_C: Array) -> Array:
    """Computes the radiance of a white surface relative to saturation, (N,), from outward normals in C, (N, 3)."""
    shading = np.zeros(len(normals_C))
    for lamp in LAMPS:
        shading += lamp.intensity * np.maximum(0.0, -normals_C @ np.array(lamp.direction_C))
    return shading


@dataclass(frozen=True)
class Rig:
    """Coloured stand with a camera at a height above its top, [m]."""

    camera: Camera = Camera()
    # The field of view is 0.98 by 0.73 m. Objects below 0.4 m in height are beyond the minimum depth of the first
    # Kinect, 0.5 m.
    height: float = 0.9
    # Dark grey, so that bright objects differ from it.
    colour: Colour = (0.2, 0.2, 0.2)

    @property
    def X_WC(self) -> Array:
        """Pose of the camera, shape (4, 4)."""
        X_WC = np.diag([1.0, -1.0, -1.0, 1.0])
        X_WC[2, 3] = self.height
        return X_WC

    def place(self, tool: Tool) -> Array:
        """Computes the pose X_WT, (4, 4), of a presented object."""
        low, high = find_box(tool.components)
        X_WT = np.eye(4)
        X_WT[:2, 3] = -0.5 * (low + high)[:2]
        X_WT[2, 3] = -low[2]
        return X_WT

    def compute_camera_pose(self, tool: Tool) -> Array:
        """Computes the pose X_TC, (4, 4), of the camera relative to a presented object."""
        return np.linalg.inv(self.place(tool)) @ self.X_WC


DEFAULT_RIG = Rig()


def build_rig_diagram(tool: Tool, rig: Rig = DEFAULT_RIG) -> Diagram:
    """Builds the Diagram of an object on the stand, with ``scene_graph``, ``camera``, and the images as outputs."""
    builder = DiagramBuilder()
    scene_graph = geometry.SceneGraph()
    builder.AddNamedSystem("scene_graph", scene_graph)
    lights = [
        geometry.LightParameter(type="directional", frame="camera", direction=direction, intensity=intensity)
        for direction, intensity in LAMPS
    ]
    scene_graph.AddRenderer(_RENDERER, make_renderer(geometry.RenderEngineVtkParams(lights=lights)))
    source = scene_graph.RegisterSource("stand")

    def show(shape: Any, X: Array, name: str, colour: Colour, label: geometry.RenderLabel) -> None:
        instance = geometry.GeometryInstance(RigidTransform(X), shape, name)
        properties = geometry.PerceptionProperties()
        properties.AddProperty("phong", "diffuse", geometry.Rgba(*colour))
        properties.AddProperty("label", "id", label)
        instance.set_perception_properties(properties)
        scene_graph.RegisterAnchoredGeometry(source, instance)

    X_stand = np.eye(4)
    X_stand[2, 3] = -0.5 * _STAND_SIZE[2]
    show(geometry.Box(*_STAND_SIZE), X_stand, "stand", rig.colour, geometry.RenderLabel.kDontCare)
    X_WT = rig.place(tool)
    for i, part in enumerate(tool.components):
        shape = part.shape.with_sizes(_FACETS * part.shape.sizes) if isinstance(part.shape, Ellipsoid) else part.shape
        show(make_drawn_shape(shape), X_WT @ part.X_TE, f"part_{i}", part.looks_like.colour, geometry.RenderLabel(i))

    camera = rig.camera
    # Integer pixel coordinates are corners of pixels in Drake's renderer (as tested with a symmetric object), and
    # centres of pixels in this module.
    centre_x, centre_y = (coordinate + 0.5 for coordinate in camera.centre)
    intrinsics = CameraInfo(camera.width, camera.height, camera.focal_length, camera.focal_length, centre_x, centre_y)
    core = geometry.RenderCameraCore(_RENDERER, intrinsics, geometry.ClippingRange(0.05, 5.0), RigidTransform())
    sensor = RgbdSensor(
        geometry.SceneGraph.world_frame_id(),
        RigidTransform(rig.X_WC),
        geometry.ColorRenderCamera(core),
        geometry.DepthRenderCamera(core, geometry.DepthRange(0.1, 4.0)),
    )
    builder.AddNamedSystem("camera", sensor)
    builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
    builder.ExportOutput(sensor.color_image_output_port(), "colour")
    builder.ExportOutput(sensor.depth_image_32F_output_port(), "depth")
    builder.ExportOutput(sensor.label_image_output_port(), "labels")
    diagram = builder.Build()
    diagram.set_name("presentation")
    return diagram


def render(tool: Tool, rig: Rig = DEFAULT_RIG) -> Picture:
    """Renders a noise-free colour and depth image of an object."""
    depth, colour = render_images(tool, rig, ("depth", "colour"))
    depth = depth[:, :, 0].astype(float)
    depth[~np.isfinite(depth)] = 0.0
    return Picture(colour[:, :, :3].copy(), depth)


def render_images(tool: Tool, rig: Rig, names: Sequence[str]) -> list[NDArray[Any]]:
    """Renders the images of the named output ports of the camera."""
    diagram = build_rig_diagram(tool, rig)
    context = diagram.CreateDefaultContext()
    images: list[Any] = [diagram.GetOutputPort(name).Eval(context) for name in names]
    if next(_NUMBER) % _COLLECTED == 0:
        gc.collect()
    return [np.array(image.data) for image in images]
