"""The arm in motion as a web page that needs nothing else: recorded joint angles, shown by Meshcat."""

import gc
import html
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    Meshcat,
    MeshcatAnimation,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
)
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import Context, DiagramBuilder

from affordance.arm import attach_tool, parse_arm
from affordance.exceptions import AffordanceError
from affordance.results import write_text
from affordance.tools import Tool

Array = NDArray[np.float64]

_FRAMES_PER_SECOND = 30.0
# A breath between two scenes, with the last frame of the first, [s].
_PAUSE = 0.5


class Scene(NamedTuple):
    """One motion of the arm with one tool in its hand.

    Attributes:
        tool: What is in the hand.
        times: (N,), starting at 0, [s].
        q: Joint angles, (N, num_joints), [rad].
        caption: Said of it in the page.
    """

    tool: Tool
    times: Array
    q: Array
    caption: str


def write_replay(
    path: Path, directives: Path, scenes: Sequence[Scene], *, title: str, p_WG: Array | None = None
) -> None:
    """Writes the scenes, one after the other, as a self-contained page.

    Args:
        path: The page.
        directives: Drake model directives of the arm.
        scenes: What is shown.
        title: Title of the page.
        p_WG: Points of the line that is drawn as what was asked for, shape (N, 3), [m]; the height of the hand in its
            home posture if None.

    Raises:
        AffordanceError: Meshcat may not open a local port (as where DRAKE_ALLOW_NETWORK leaves it out).
    """
    try:
        meshcat = Meshcat(MeshcatParams(host="localhost"))
    except RuntimeError as error:
        raise AffordanceError(f"{path}: cannot be drawn: {error}") from error
    try:
        captions = _record(meshcat, directives, scenes, p_WG)
        page = meshcat.StaticHtml()
    finally:
        # Meshcat ends the process if it is freed by a thread other than the one that made it, and the garbage
        # collector runs in whatever thread comes by. So it is freed here.
        del meshcat
        gc.collect()
    write_text(path, _add_captions(page, title, captions))


def _record(meshcat: Meshcat, directives: Path, scenes: Sequence[Scene], p_WG: Array | None) -> list[str]:
    """Plays the scenes into Meshcat's recording; returns what is said of each."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    hand = parse_arm(plant, directives)
    names = [f"tool_{number}" for number, _ in enumerate(scenes)]
    for name, scene in zip(names, scenes, strict=True):
        attach_tool(plant, hand, scene.tool, name)
    plant.Finalize()
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, MeshcatVisualizerParams(prefix="arm"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    _set_stage(meshcat, plant, plant_context, hand, p_WG)

    meshcat.StartRecording(_FRAMES_PER_SECOND, set_visualizations_while_recording=False)
    start = 0.0
    captions = []
    for name, scene in zip(names, scenes, strict=True):
        for other in names:
            meshcat.SetProperty(f"arm/{other}", "visible", other == name, start)
        end = start + scene.times[-1] + _PAUSE
        for time in np.arange(0.0, end - start, 1.0 / _FRAMES_PER_SECOND):
            row = min(int(np.searchsorted(scene.times, time)), len(scene.q) - 1)
            plant.SetPositions(plant_context, scene.q[row])
            context.SetTime(start + time)
            diagram.ForcedPublish(context)
        captions.append(f"{start:.1f} to {end - _PAUSE:.1f} s: {scene.caption}")
        start = end
    meshcat.StopRecording()
    meshcat.get_mutable_recording().set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
    meshcat.PublishRecording()
    return captions


def _set_stage(
    meshcat: Meshcat, plant: MultibodyPlant, plant_context: Context, hand: Frame, p_WG: Array | None
) -> None:
    """Looks at the arm from its side, and draws what was asked for as a line."""
    p_WH = hand.CalcPoseInWorld(plant_context).translation()
    first_joint = plant.get_joint_actuator(plant.GetJointActuatorIndices()[0]).joint()
    p_WBo = first_joint.frame_on_parent().CalcPoseInWorld(plant_context).translation()
    middle = p_WBo + 0.6 * (p_WH - p_WBo)
    reach = float(np.linalg.norm(p_WH - p_WBo))
    side = np.cross([0.0, 0.0, 1.0], p_WH - p_WBo)
    meshcat.SetCameraPose(middle - 1.05 * side + np.array([0.0, 0.0, 0.2 * reach]), middle)
    if p_WG is None:
        p_WG = np.array([p_WH - 0.3 * (p_WH - p_WBo), p_WH + 0.6 * (p_WH - p_WBo)])
    meshcat.SetLine("asked for", np.asfortranarray(p_WG.T), 2.0, Rgba(0.8, 0.2, 0.1, 1.0))
    for end in ("top_color", "bottom_color"):
        meshcat.SetProperty("/Background", end, [1.0, 1.0, 1.0])
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)


def _add_captions(page: str, title: str, captions: Sequence[str]) -> str:
    """Names the page and what it shows when, in its lower left corner."""
    lines = "<br>".join(html.escape(caption) for caption in captions)
    note = (
        '<div style="position:fixed;left:12px;bottom:12px;padding:8px 12px;background:#ffffffd9;'
        f'font:14px/1.5 sans-serif;border-radius:6px"><b>{html.escape(title)}</b><br>{lines}</div>'
    )
    page = page.replace("<title>Drake MeshCat</title>", f"<title>{html.escape(title)}</title>")
    return page.replace("</body>", f"{note}\n</body>")
