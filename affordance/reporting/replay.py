"""Replays recorded joint angles as a self-contained Meshcat web page.

A blow takes only a few milliseconds, so a scene can be slowed down and magnified around the strike.
"""

import gc
import html
import secrets
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
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

from affordance.arrays import Array
from affordance.exceptions import AffordanceError
from affordance.files.atomic import write_text
from affordance.objects.tool import Tool
from affordance.plant.load import attach_tool, parse_arm
from affordance.plant.nail import NailPlacement, add_nail
from affordance.reporting.side_view import SideView, find_direction, list_corners, place_camera

# Meshcat's path of the line that the hand or the tool must follow, by default at the goal height.
HELD_HEIGHT = "asked for"
_FRAMES_PER_SECOND = 30.0
# Pause between two scenes on the last frame of the first, [s].
_PAUSE = 0.5
# Number of frames between two checks that the camera's view includes all shapes.
_LOOKS = 5
# Path of Meshcat's camera, and its magnification in slow motion.
_CAMERA = "/Cameras/default/rotated/<object>"
_ZOOM = 5.0
# Duration of a change of magnification, in replay time, [s].
_ZOOMING = 0.7


# Bar at the bottom of a page. Its placeholders are the title, the legend, the captions (each begins with its start
# time), and tangents of half the smallest horizontal and vertical view angles above the bar.
_BAR = """<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
#bar{position:fixed;left:0;right:0;bottom:0;padding:8px 12px;background:#ffffffe6;font:14px/1.5 sans-serif;
display:grid;grid-template-columns:auto 1fr auto;gap:2px 12px;align-items:center}#bar b,#bar div{grid-column:1/-1}
.dg,#bar span{display:none}#bar span.now{display:inline}#bar button{width:5em;font:inherit}
#bar output{min-width:8em}#bar small{font-weight:normal}
</style>
<div id="bar"><b>%s<small>%s</small></b><div>%s</div><button type="button">Pause</button>
<input type="range" min="0" step="0.01" aria-label="time"><output></output></div>
<script>
(() => {
  const film = viewer.animator, bar = document.getElementById("bar"), [wide, high] = %s;
  const [button, slider, clock] = bar.querySelectorAll("button, input, output"), lines = bar.querySelectorAll("span");
  const starts = Array.from(lines, line => parseFloat(line.textContent));
  let fitted = 0;  // ratio of width to height to which the angle of view was fitted
  const fit = () => {
    const free = Math.max(0.3, 1 - 2 * bar.offsetHeight / window.innerHeight);  // the bar covers the foot
    viewer.camera.fov = 360 / Math.PI * Math.atan(Math.max(wide / viewer.camera.aspect, high / free));
    viewer.camera.updateProjectionMatrix();
    viewer.set_dirty();
    fitted = viewer.camera.aspect;
  };
  const show = () => {
    if (viewer.camera.aspect != fitted) fit();
    slider.max = film.duration;
    slider.value = film.time;
    clock.textContent = `${film.time.toFixed(1)} of ${film.duration.toFixed(1)} s`;
    button.textContent = film.playing ? "Pause" : "Play";
    const now = starts.filter(start => start <= film.time + 1e-3).length - 1;
    lines.forEach((line, number) => line.classList.toggle("now", number == Math.max(0, now)));
    requestAnimationFrame(show);
  };
  button.onclick = () => {
    if (film.playing) return film.pause();
    if (film.time > film.duration - 0.05) film.reset();
    film.play();
  };
  slider.oninput = () => { const time = Number(slider.value); film.pause(); film.time = time; film.seek(time); };
  show();
})();
</script>"""


class Scene(NamedTuple):
    """Motion of an arm with a tool in its hand, and optionally a nail."""

    tool: Tool
    times: Array  # times, (N,), starting at 0, [s]
    q: Array  # joint angles, (N, num_joints), [rad]
    caption: str
    placement: NailPlacement | None = None
    travel: Array | None = None  # travel of the nail, (N,), [m]; None for a nail that does not move
    # Begin and end of slow motion, [s], and its factor; None for no slow motion.
    slow: tuple[float, float, float] | None = None
    height: Array | None = None  # height of the object's centre above the goal, (N,), [m]; None without a goal


@dataclass(frozen=True)
class Replay:
    """Scenes of an experiment, for a page or a film. A call with a path writes the page."""

    directives: Path
    title: str
    scenes: Sequence[Scene]
    p_WG: Array | None = None  # points of the required path, (N, 3), [m]; None for the goal height

    def __call__(self, path: Path) -> None:
        """Writes the page; see ``write_replay``."""
        write_replay(path, self.directives, self.scenes, title=self.title, p_WG=self.p_WG)


def write_replay(
    path: Path, directives: Path, scenes: Sequence[Scene], *, title: str, p_WG: Array | None = None
) -> None:
    """Writes scenes as a self-contained page that shows them one after the other.

    Args:
        path: File to write.
        directives: Directives file of the arm.
        scenes: Scenes to show.
        title: Title of the page.
        p_WG: Points of the required path, (N, 3), [m], drawn as a line. With None, the line is at the height of the
            hand in its home posture, or omitted if there is a nail.

    Raises:
        ValueError: A slow interval is outside its scene, or its factor is below 1.
        AffordanceError: Meshcat cannot open a local port, for example because DRAKE_ALLOW_NETWORK forbids it.
    """
    for scene in scenes:
        if scene.slow is not None:
            begin, end, factor = scene.slow
            if not (scene.times[0] <= begin < end <= scene.times[-1] and factor >= 1.0):
                bound = f"from {scene.times[0]:g} to {scene.times[-1]:g} s, and at least 1 times slower"
                raise ValueError(f"{path}: slow is {scene.slow}, must be {bound}")
    meshcat = open_meshcat(str(path))
    try:
        captions, view = _record(meshcat, directives, scenes, p_WG)
        page = meshcat.StaticHtml()
    finally:
        # Meshcat must be freed by the thread that created it, or it ends the process. The garbage collector can run
        # in any thread, so Meshcat is freed here.
        del meshcat
        gc.collect()
    has_line = p_WG is not None or all(scene.placement is None for scene in scenes)
    write_text(path, _add_bar(page, title, "; red line: the goal" if has_line else "", captions, view))


def open_meshcat(what: str) -> Meshcat:
    """Opens Meshcat on a random port of a random local address.

    Meshcat accepts messages from any website that is open in a browser on this machine, and an invalid message ends
    its process. Websites cannot know which of the 16 million local addresses it uses; macOS has only one. The port is
    random too: with a known port, all addresses could be tried in a few hours.

    Args:
        what: Name of the picture, for the error.

    Raises:
        AffordanceError: No port can be opened.
    """
    own = "127." + ".".join(str(1 + secrets.randbelow(254)) for _ in range(3))
    try:
        return Meshcat(MeshcatParams(host="localhost" if sys.platform == "darwin" else own, port=0))
    except RuntimeError as error:
        raise AffordanceError(f"{what}: cannot be drawn: {error}") from error


def _record(
    meshcat: Meshcat, directives: Path, scenes: Sequence[Scene], p_WG: Array | None
) -> tuple[list[str], SideView]:
    """Plays the scenes into Meshcat's recording. Returns the caption of each scene, and the camera's view."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    hand = parse_arm(plant, directives)
    names = [f"tool_{number}" for number, _ in enumerate(scenes)]
    for name, scene in zip(names, scenes, strict=True):
        attach_tool(plant, hand, scene.tool, name)
    # Nails are added after the arm, so that the arm's joints come first in the plant's state.
    nails = {
        number: add_nail(plant, scene.placement, f"nail_{number}")
        for number, scene in enumerate(scenes)
        if scene.placement is not None
    }
    plant.Finalize()
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, MeshcatVisualizerParams(prefix="arm"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    placements = [scene.placement for scene in scenes if scene.placement is not None]
    set_stage(meshcat, plant, plant_context, hand, p_WG, placements)
    out = find_direction(plant, plant_context, hand)
    query_port, graph_context = scene_graph.get_query_output_port(), scene_graph.GetMyContextFromRoot(context)
    seen = [] if p_WG is None else [p_WG]

    meshcat.StartRecording(_FRAMES_PER_SECOND, set_visualizations_while_recording=False)
    start = 0.0
    captions = []
    for number, (name, scene) in enumerate(zip(names, scenes, strict=True)):
        for other in names:
            meshcat.SetProperty(f"arm/{other}", "visible", other == name, start)
        for other_number, joint in nails.items():
            for path in (joint.name(), f"{joint.name()}_block"):
                meshcat.SetProperty(f"arm/{path}", "visible", other_number == number, start)
        shown = slow_down(scene)
        end = start + shown.times[-1] + _PAUSE
        for frame, time in enumerate(np.arange(0.0, end - start, 1.0 / _FRAMES_PER_SECOND)):
            row = min(int(np.searchsorted(shown.times, time)), len(shown.q) - 1)
            state = np.zeros(plant.num_positions())
            state[: shown.q.shape[1]] = shown.q[row]
            if number in nails and shown.travel is not None:
                state[nails[number].position_start()] = shown.travel[row]
            plant.SetPositions(plant_context, state)
            context.SetTime(start + time)
            diagram.ForcedPublish(context)
            if frame % _LOOKS == 0:
                seen.append(list_corners(query_port.Eval(graph_context)))
            if any(other.slow is not None for other in scenes):
                meshcat.SetProperty(_CAMERA, "zoom", _zoom(scene.slow, float(time)), start + float(time))
        captions.append(f"{start:.1f} to {end - _PAUSE:.1f} s: {_describe(scene, start)}")
        start = end
    meshcat.StopRecording()
    meshcat.get_mutable_recording().set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
    meshcat.PublishRecording()
    # The camera zooms in on the middle of the picture.
    middle = np.mean([placement.p_WNo for placement in placements], axis=0) if placements else None
    view = place_camera(np.concatenate(seen), out, middle)
    meshcat.SetCameraPose(view.place, view.target)
    return captions, view


def slow_down(scene: Scene) -> Scene:
    """Resamples a scene at the frames of its replay, by interpolation."""
    if scene.slow is None:
        return scene
    begin, end, factor = scene.slow
    log = scene.times
    in_log = np.array([0.0, begin, end, log[-1]])
    in_replay = np.array([0.0, begin, begin + factor * (end - begin), log[-1] + (factor - 1.0) * (end - begin)])
    # The end is added even if it is between two frames, so that the duration does not change.
    frames = np.append(np.arange(0.0, in_replay[-1], 1.0 / _FRAMES_PER_SECOND), in_replay[-1])
    times = np.interp(frames, in_replay, in_log)
    q = np.column_stack([np.interp(times, log, angle) for angle in scene.q.T])
    travel = None if scene.travel is None else np.interp(times, log, scene.travel)
    return scene._replace(times=frames, q=q, travel=travel)


def _zoom(slow: tuple[float, float, float] | None, time: float) -> float:
    """Computes the camera's magnification at a time in the replay of a scene."""
    if slow is None:
        return 1.0
    begin, end, factor = slow
    last = begin + factor * (end - begin)
    share = np.interp(time, [begin - _ZOOMING, begin, last, last + _ZOOMING], [0.0, 1.0, 1.0, 0.0])
    return float(_ZOOM**share)


def _describe(scene: Scene, start: float) -> str:
    """Returns a scene's caption with the times of its slow motion.

    Args:
        scene: Scene.
        start: Start of the scene in the replay, [s].
    """
    if scene.slow is None:
        return scene.caption
    begin, end, factor = scene.slow
    last = start + begin + factor * (end - begin)
    return f"{scene.caption} ({factor:g} × slower around the strike, {start + begin:.1f} to {last:.1f} s)"


def find_held_height(p_WB: Array, p_WH: Array) -> Array:
    """Computes the ends of a line at the goal height, (2, 3), [m], from the home positions of base and hand."""
    out = (p_WH - p_WB) * [1.0, 1.0, 0.0]
    return np.array([p_WH - 0.3 * out, p_WH + 0.45 * out])


def set_stage(
    meshcat: Meshcat,
    plant: MultibodyPlant,
    plant_context: Context,
    hand: Frame,
    p_WG: Array | None,
    placements: Sequence[NailPlacement],
) -> None:
    """Draws the required path on a white background. Without a path or a nail, draws a line at the goal height."""
    p_WH = hand.CalcPoseInWorld(plant_context).translation()
    first_joint = plant.get_joint_actuator(plant.GetJointActuatorIndices()[0]).joint()
    p_WBo = first_joint.frame_on_parent().CalcPoseInWorld(plant_context).translation()
    if p_WG is None and not placements:
        p_WG = find_held_height(p_WBo, p_WH)
    if p_WG is not None:
        meshcat.SetLine(HELD_HEIGHT, np.asfortranarray(p_WG.T), 2.0, Rgba(0.8, 0.2, 0.1, 1.0))
    for end in ("top_color", "bottom_color"):
        meshcat.SetProperty("/Background/<object>", end, [1.0, 1.0, 1.0])
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)


def _add_bar(page: str, title: str, legend: str, captions: Sequence[str], view: SideView) -> str:
    """Sets the title of a page, and adds a bar with a play button, a time slider and the current caption."""
    lines = "".join(f"<span>{html.escape(caption)}</span>" for caption in captions)
    bar = _BAR % (html.escape(title), legend, lines, [view.wide, view.high])
    page = page.replace("<title>Drake MeshCat</title>", f"<title>{html.escape(title)}</title>")
    return page.replace("</body>", f"{bar}\n</body>")
