"""Renders arm, tool and nail with Drake's renderer, which needs no display.

Frames: W the world, C the camera (Cz is the viewing direction, Cy points down). The camera is to the right of the
arm, slightly above and in front of it. From there, a right arm does not hide the object in its hand.
"""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    Cylinder,
    GeometryInstance,
    LightParameter,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    Rgba,
    Role,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from affordance.arrays import Array
from affordance.drake.renderer import make_renderer
from affordance.objects.tool import Tool
from affordance.plant.load import add_arm
from affordance.plant.nail import NailPlacement

Image = NDArray[np.uint8]

_RENDERER = "camera"
_FIELD_OF_VIEW = np.radians(20.0)  # vertical; with a long lens, near and far objects have a similar scale
# Viewpoint of the camera: azimuth from the arm's right towards its front, and elevation above the horizon, [rad].
_AZIMUTH, _ELEVATION = np.radians(20.0), np.radians(10.0)
# Margin at each edge, as a fraction of half a picture.
_MARGIN = 0.04
# Pictures are rendered larger by this factor and then averaged, because the renderer does not smooth edges.
_OVERSAMPLING = 3
# Radius, [m], and colour of the required path.
_LINE, _RED = 0.0015, Rgba(0.8, 0.2, 0.1, 1.0)
# Distances along the nail that close-ups show above and below the highest point of its head, [m].
_ABOVE, _BELOW = 0.045, 0.06
# Three lights, so that nothing is black: from above left of the camera, from the camera itself, and from below right.
# There are no shadows, because the renderer draws them with ragged edges.
_LIGHTS = [
    LightParameter(type="directional", frame="camera", intensity=intensity, direction=np.array(direction))
    for intensity, direction in ((0.75, (0.5, 0.9, 0.6)), (0.4, (0.0, 0.0, 1.0)), (0.4, (-0.8, -0.7, 0.3)))
]


class Pose(NamedTuple):
    """Posture of an arm with a tool and optionally a nail."""

    tool: Tool
    placement: NailPlacement | None
    q: Array  # joint angles, (num_joints,), [rad]
    travel: float = 0.0  # travel of the nail, [m]


def render_poses(
    directives: Path, poses: Sequence[Pose], *, width: int, height: int | None = None, p_WG: Array | None = None
) -> list[Image]:
    """Renders the whole arm with tool and nail, with the same camera for all poses.

    Args:
        directives: Directives file of the arm.
        poses: Poses to render.
        width: Width of the pictures, [pixels].
        height: Height of the pictures, [pixels]; None to fit the contents.
        p_WG: Points of a required path, (N, 3), [m], drawn as a red line.

    Returns:
        Pictures in RGB, (height, width, 3) each.
    """
    kinds = {(id(pose.tool), id(pose.placement)): pose for pose in poses}
    # Poses with the same tool and nail share a scene.
    scenes = {kind: _Scene(directives, pose, p_WG) for kind, pose in kinds.items()}
    R_WC = _turn_camera(_ELEVATION)
    corners = np.concatenate([scenes[id(pose.tool), id(pose.placement)].compute_corners(pose) for pose in poses])
    if height is None:
        across, down, _ = np.ptp(corners @ R_WC.matrix(), axis=0)
        height = round(width * down / across)
    X_WC = RigidTransform(R_WC, _step_back(corners, R_WC, width / height))
    return [scenes[id(pose.tool), id(pose.placement)].render(pose, X_WC, width, height) for pose in poses]


def render_close_ups(directives: Path, poses: Sequence[Pose], *, width: int, height: int) -> list[Image]:
    """Renders close-ups of nails and tools at a common scale. Pictures are the same as in ``render_poses``.

    Raises:
        ValueError: A pose has no nail.
    """
    pictures = []
    for pose in poses:
        if pose.placement is None:
            raise ValueError(f"a close-up needs a nail, but the pose with {pose.tool.name} has none")
        R_WC = _turn_camera(0.5 * _ELEVATION)
        along = pose.placement.direction_W
        ends = pose.placement.p_WNo + np.outer([-_ABOVE, _BELOW], along)
        p_WC = _step_back(ends, R_WC, width / height)
        pictures.append(_Scene(directives, pose).render(pose, RigidTransform(R_WC, p_WC), width, height))
    return pictures


class _Scene:
    """Diagram of an arm with a tool and optionally a nail, which renders poses."""

    def __init__(self, directives: Path, pose: Pose, p_WG: Array | None = None) -> None:
        """Builds the Diagram for the tool and nail of a pose, with a line through the points p_WG, (N, 3), [m]."""
        builder = DiagramBuilder()
        arm = add_arm(builder, directives, pose.tool, pose.placement)
        scene_graph = builder.GetSubsystemByName("scene_graph")
        assert isinstance(scene_graph, SceneGraph)  # add_arm added it
        params = RenderEngineVtkParams(default_clear_color=np.ones(3), lights=_LIGHTS)  # white behind everything
        scene_graph.AddRenderer(_RENDERER, make_renderer(params))
        if p_WG is not None:
            _add_line(scene_graph, p_WG)
        diagram = builder.Build()
        self._context = diagram.CreateDefaultContext()  # kept alive, because the query object refers to it
        self._plant, self._has_nail = arm.plant, arm.nail is not None
        self._plant_context = arm.plant.GetMyMutableContextFromRoot(self._context)
        self._world = scene_graph.world_frame_id()
        self._port = scene_graph.get_query_output_port()
        self._graph_context = scene_graph.GetMyContextFromRoot(self._context)

    def _set_pose(self, pose: Pose) -> Any:
        """Sets the pose, and returns the query object of the scene graph."""
        self._plant.SetPositions(self._plant_context, np.append(pose.q, [pose.travel] if self._has_nail else []))
        return self._port.Eval(self._graph_context)

    def compute_corners(self, pose: Pose) -> Array:
        """Computes the corners of bounding boxes of all visible geometry, in W, (N, 3), [m]."""
        query = self._set_pose(pose)
        inspector = query.inspector()
        corners = []
        signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), axis=-1).reshape(-1, 3)
        for geometry in inspector.GetAllGeometryIds(Role.kPerception):
            box = inspector.GetObbInGeometryFrame(geometry)
            if box is None:
                continue  # a half space is unbounded
            X_WG = query.GetPoseInWorld(geometry)
            corners.append((X_WG @ box.pose()).multiply((signs * box.half_width()).T).T)
        return np.concatenate(corners)

    def render(self, pose: Pose, X_WC: RigidTransform, width: int, height: int) -> Image:
        """Renders the picture of a pose in RGB, (height, width, 3)."""
        n = _OVERSAMPLING
        camera = ColorRenderCamera(
            RenderCameraCore(
                _RENDERER,
                CameraInfo(width=n * width, height=n * height, fov_y=_FIELD_OF_VIEW),
                ClippingRange(0.05, 50.0),
                RigidTransform(),
            )
        )
        image = self._set_pose(pose).RenderColorImage(camera, self._world, X_WC)
        colours = image.data[:, :, :3].reshape(height, n, width, n, 3).mean(axis=(1, 3))
        picture: Image = np.rint(colours).astype(np.uint8)
        return picture


def _add_line(scene_graph: SceneGraph, p_WG: Array) -> None:
    """Adds thin red cylinders between successive points, (N, 3), [m]."""
    source = scene_graph.RegisterSource("line")
    for number, (start, end) in enumerate(itertools.pairwise(p_WG)):
        along = end - start
        if not (length := float(np.linalg.norm(along))) > 0.0:
            continue
        X_WL = RigidTransform(RotationMatrix.MakeFromOneVector(along, 2), 0.5 * (start + end))
        line = GeometryInstance(X_WL, Cylinder(_LINE, length), f"line_{number}")
        line.set_perception_properties(PerceptionProperties())
        line.mutable_perception_properties().AddProperty("phong", "diffuse", _RED)
        scene_graph.RegisterAnchoredGeometry(source, line)


def _turn_camera(elevation: float) -> RotationMatrix:
    """Computes the orientation R_WC of a camera to the right of the arm (-Wy), turned towards the front (Wx)."""
    looks = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), -np.tan(elevation)])
    looks /= np.linalg.norm(looks)
    right = np.cross(looks, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return RotationMatrix(np.column_stack([right, np.cross(looks, right), looks]))


def _step_back(points: Array, R_WC: RotationMatrix, aspect: float) -> Array:
    """Computes the closest camera position that shows all points, centred.

    In the axes of C, a point (x, y, z) is visible from a camera at (a, b, c) if |x - a| <= k (z - c), where k is the
    tangent of half the field of view. The condition for y is analogous.
    """
    axes = R_WC.matrix()
    p_C = points @ axes
    place = np.zeros(3)
    depths = []
    for axis, k in ((0, aspect * np.tan(0.5 * _FIELD_OF_VIEW)), (1, np.tan(0.5 * _FIELD_OF_VIEW))):
        seen = (1.0 - _MARGIN) * k
        least, most = (p_C[:, axis] - seen * p_C[:, 2]).max(), (p_C[:, axis] + seen * p_C[:, 2]).min()
        place[axis] = 0.5 * (least + most)
        depths.append((most - least) / (2.0 * seen))
    place[2] = min(depths)
    return axes @ place
