"""Live scene in Drake's Meshcat: arm, object, contact forces, beliefs as curves on a panel, buttons and sliders."""

import io
import time
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np
from matplotlib.figure import Figure
from pydrake.common import MemoryFile
from pydrake.common.value import Value
from pydrake.geometry import InMemoryMesh, Mesh, MeshcatVisualizer, MeshcatVisualizerParams, Rgba, SceneGraph
from pydrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from pydrake.multibody.plant import ContactResults, MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus, OutputPort

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.object_belief import Memory, ObjectBelief
from affordance.drake.sampled_system import SampledSystem, Source
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.reporting.replay import open_meshcat, set_stage

_FRAMES_PER_SECOND = 30.0
# Simulated time between pictures of contact forces, [s], and ratio of real to simulated time while there are any.
_CONTACT_PERIOD, _SLOWNESS = 0.002, 10.0
# Sliders: label, least and greatest value; both multiply what the objects' file says.
DENSITY, SIZE = "True density, times", "Size, times"
_SLIDERS = {DENSITY: (0.1, 2.0), SIZE: (0.5, 1.5)}
# Panel next to the arm: width and height as shares of the distance from base to hand, and pixels of its picture.
_PANEL = np.array([1.0, 0.5])
_PIXELS = (1200, 600)
# Axes on the panel, as shares of it: left, bottom, width, height.
_AXES = (0.06, 0.17, 0.88, 0.50)
# Densities on the panel, [kg/m^3]: beyond lead, which is the densest of the materials.
_DENSITY_MAX = 14000.0
_FRACTIONS = np.linspace(0.01, 0.99, 50)


class Wish(Enum):
    """Wish of a visitor, by the label of its button; that of a moved slider has none."""

    NEXT = "Next object"
    DECOY = "Decoy"
    RESET = "Reset"
    CHANGE = ""


class LiveScene:
    """Scene that several Diagrams share, one after another."""

    def __init__(self, directives: Path, names: Mapping[Colour, str]) -> None:
        """Opens Meshcat, with buttons, sliders and an empty panel; errors are those of ``open_meshcat``."""
        self.meshcat = open_meshcat("the live scene")
        self._names = names
        self._shown: object = None
        self._follows = True
        for wish, key in ((Wish.NEXT, "KeyN"), (Wish.DECOY, "KeyD"), (Wish.RESET, "KeyR")):
            self.meshcat.AddButton(wish.value, key)
        for label, (low, high) in _SLIDERS.items():
            self.meshcat.AddSlider(label, low, high, 0.05, 1.0)
        self._clicks = self._count_clicks()
        self._factors = self.factors
        arm = load_arm(directives)
        context = arm.plant.CreateDefaultContext()
        arm.set_posture(context, arm.home)
        set_stage(self.meshcat, arm.plant, context, arm.hand, None, [])
        joints = [arm.plant.get_joint_actuator(index).joint() for index in arm.plant.GetJointActuatorIndices()]
        frames = [*(joint.frame_on_parent() for joint in joints), arm.hand]
        p_WF = np.array([frame.CalcPoseInWorld(context).translation() for frame in frames])
        self._panel = _place_panel(p_WF)
        self.meshcat.SetCameraPose(*_place_camera(p_WF, self._panel))

    @property
    def address(self) -> str:
        """Address of the page."""
        return str(self.meshcat.web_url())

    @property
    def factors(self) -> tuple[float, float]:
        """Factors of true density and size, as the sliders stand."""
        return self.meshcat.GetSliderValue(DENSITY), self.meshcat.GetSliderValue(SIZE)

    @property
    def is_wanted(self) -> bool:
        """True if a button was pressed or a slider moved since the last wish was taken."""
        return self._clicks != self._count_clicks() or self._factors != self.factors

    def take_wish(self) -> Wish | None:
        """Takes the wish since the last one; None if nothing was wished for."""
        clicks, factors = self._count_clicks(), self.factors
        pressed = [wish for wish, number in clicks.items() if number != self._clicks[wish]]
        moved = factors != self._factors
        self._clicks, self._factors = clicks, factors
        return pressed[0] if pressed else Wish.CHANGE if moved else None

    def wait(self, seconds: float = np.inf) -> Wish | None:
        """Waits for a wish, at most some time, [s], and takes it."""
        end = time.monotonic() + seconds
        while not self.is_wanted and time.monotonic() < end:
            time.sleep(1.0 / _FRAMES_PER_SECOND)
        return self.take_wish()

    def add_to(self, builder: DiagramBuilder, plant: MultibodyPlant, posterior: OutputPort) -> None:
        """Adds the systems that show a plant with shapes, and the belief on a port, to a Diagram."""
        (scene_graph,) = (system for system in builder.GetMutableSystems() if isinstance(system, SceneGraph))
        shown = MeshcatVisualizerParams(prefix="arm", publish_period=1.0 / _FRAMES_PER_SECOND)
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, self.meshcat, shown)
        forces = ContactVisualizerParams(prefix="contact", publish_period=_CONTACT_PERIOD)
        ContactVisualizer.AddToBuilder(builder, plant, self.meshcat, forces)
        clock = builder.AddNamedSystem("live_clock", _LiveClock(self))
        builder.Connect(posterior, clock.GetInputPort("posterior"))
        builder.Connect(plant.get_contact_results_output_port(), clock.GetInputPort("contact"))

    def announce(self, what: str, tool: Tool, memory: Memory, *, follows: bool = True) -> None:
        """Shows what is done with a tool, its true densities, and the belief about materials, on the panel.

        Titles, axis and legend are a picture on a rectangle, as Meshcat draws no text; the title is printed too. From
        then on the belief about the tool is drawn, if it is to be followed.
        """
        self._follows = follows
        title = f"{what}: {tool.name.replace('_', ' ')}, {tool.mass:.2f} kg"
        print(title, flush=True)
        figure = Figure(figsize=(_PIXELS[0] / 100, _PIXELS[1] / 100))
        axes = figure.add_axes(_AXES)
        axes.set_xlim(0.0, _DENSITY_MAX / 1000.0)
        axes.set_ylim(0.0, 1.05)
        axes.set_yticks([])
        axes.spines[["left", "right", "top"]].set_visible(False)
        axes.tick_params(labelsize=18)
        axes.set_xlabel("density, g/cm³ (line: this object; dashed: the truth)", fontsize=18)
        figure.text(_AXES[0], 0.9, title, fontsize=26)
        for part in tool.components:
            axes.axvline(part.material.density / 1000.0, color=part.looks_like.colour, linestyle="--")
        for index, (colour, curve) in enumerate(zip(memory.colours, trace_densities(memory.belief), strict=True)):
            axes.fill_between(curve[:, 0] / 1000.0, curve[:, 1], color=colour, alpha=0.5)
            if index < 6:  # as many lines as there is room for
                x, y = _AXES[0] + 0.46 * (index % 2), 0.82 - 0.07 * (index // 2)
                figure.text(x, y, "■", fontsize=20, color=colour)
                figure.text(x + 0.04, y, self._describe(memory, index), fontsize=20)
        image = io.BytesIO()
        figure.savefig(image, format="png", dpi=100)
        self.meshcat.SetObject("panel", self._panel.build_mesh(image.getvalue()), Rgba(1.0, 1.0, 1.0, 1.0))
        self.meshcat.Delete("now")

    def follow(self, belief: ObjectBelief) -> None:
        """Draws the belief about the object at hand, if it has changed."""
        if belief is self._shown or not self._follows:
            return
        self._shown = belief
        curves = trace_densities(belief.densities)
        left, bottom, wide, high = _AXES
        for index in np.flatnonzero(belief.geometry.Phi.any(axis=0)):
            shares = curves[index] * [wide / _DENSITY_MAX, high / 1.05] + [left, bottom]
            line = np.asfortranarray(self._panel.place(shares, 0.01).T)
            red, green, blue = belief.memory.colours[index]
            self.meshcat.SetLine(f"now/{index}", line, 4.0, Rgba(0.6 * red, 0.6 * green, 0.6 * blue, 1.0))

    def _describe(self, memory: Memory, index: int) -> str:
        low, high = memory.belief.compute_percentiles([0.25, 0.75])[:, index] / 1000.0
        return f"{self._names.get(memory.colours[index], 'unnamed')}: {low:.1f} to {high:.1f} g/cm³"

    def _count_clicks(self) -> dict[Wish, int]:
        return {wish: self.meshcat.GetButtonClicks(wish.value) for wish in Wish if wish.value}


class _LiveClock(SampledSystem):
    """Clock that keeps a presentation in real time, shows the belief, and ends it at a visitor's wish.

    While something is in contact, which lasts some milliseconds, it slows down, so that forces can be seen.

    Input ports:
        contact: Contact results of the plant.
        posterior: Belief given the samples so far, ObjectBelief.
    """

    def __init__(self, scene: LiveScene) -> None:
        super().__init__()
        self._scene = scene
        self._start = 0.0
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        self._contact = self.DeclareAbstractInputPort("contact", Value(ContactResults()))
        self.DeclareInitializationPublishEvent(self._begin)
        self.DeclarePeriodicPublishEvent(_CONTACT_PERIOD, 0.0, self._slow_down)
        self.DeclarePeriodicPublishEvent(1.0 / _FRAMES_PER_SECOND, 0.0, self._keep_pace)

    def _begin(self, context: Context) -> None:
        self._start = time.monotonic() - context.get_time()

    def _slow_down(self, context: Context) -> None:
        contact = cast(ContactResults, self._contact.Eval(context))
        if contact.num_point_pair_contacts() or contact.num_hydroelastic_contacts():
            pause = (_SLOWNESS - 1.0) * _CONTACT_PERIOD
            self._start += pause
            time.sleep(pause)

    def _keep_pace(self, context: Context) -> EventStatus:
        self._scene.follow(self._posterior.Eval(context))
        time.sleep(max(0.0, self._start + context.get_time() - time.monotonic()))
        if self._scene.is_wanted:
            return EventStatus.ReachedTermination(self, "a wish")
        return EventStatus.Succeeded()


class _Panel(NamedTuple):
    """Rectangle in the world: its lower left corner, its edges and the direction towards the camera, (3,), [m]."""

    corner: Array
    right: Array
    up: Array
    front: Array

    def place(self, shares: Array, lift: float) -> Array:
        """Places points given by shares of the edges, (N, 2), lifted off the panel, [m]; returns (N, 3)."""
        place: Array = self.corner + shares @ np.array([self.right, self.up]) + lift * self.front
        return place

    def build_mesh(self, image: bytes) -> Mesh:
        """Builds the rectangle with a picture, PNG, on it."""
        corners = self.place(np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), 0.0)
        lines = ["mtllib panel.mtl", *("v {} {} {}".format(*corner) for corner in corners)]
        lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "vn {} {} {}".format(*self.front)]
        lines += ["usemtl panel", "f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1"]
        paint = "newmtl panel\nKa 1 1 1\nKd 1 1 1\nmap_Kd panel.png\n"
        files = {
            "panel.mtl": MemoryFile(paint.encode(), ".mtl", "panel.mtl"),
            "panel.png": MemoryFile(image, ".png", "panel.png"),
        }
        text = MemoryFile("\n".join(lines).encode(), ".obj", "panel.obj")
        return Mesh(InMemoryMesh(mesh_file=text, supporting_files=files))


def _place_panel(p_WF: Array) -> _Panel:
    """Places the panel over an arm, given by its frames from base to hand, for a camera at its side."""
    p_WB, p_WH = p_WF[0], p_WF[-1]
    out = (p_WH - p_WB) * [1.0, 1.0, 0.0]
    reach = float(np.linalg.norm(p_WH - p_WB))
    right, up = out / np.linalg.norm(out), np.array([0.0, 0.0, 1.0])
    front = -np.cross(up, right)
    wide, high = reach * _PANEL
    above = p_WF[:, 2].max() - p_WB[2] + 0.12 * reach
    corner = p_WB + 0.25 * reach * right + above * up - 0.1 * reach * front
    return _Panel(corner, wide * right, high * up, front)


def _place_camera(p_WF: Array, panel: _Panel) -> tuple[Array, Array]:
    """Places the camera so that arm, object and panel are in its view, 75 degrees high; returns place and target."""
    reach = float(np.linalg.norm(p_WF[-1] - p_WF[0]))
    low, high = p_WF[:, 2].min() - 0.35 * reach, panel.corner[2] + panel.up[2]
    target = p_WF[0] + 0.65 * panel.right * reach / np.linalg.norm(panel.right)
    target[2] = 0.5 * (low + high)
    far = max(0.82 * (high - low), reach)
    return target + far * panel.front + [0.0, 0.0, 0.15 * far], target


def trace_densities(belief: DensityBelief) -> list[Array]:
    """Traces the marginal probability density of each density, each (N, 2): [kg/m^3], and 1 at the greatest."""
    if not belief.size:
        return []
    curves = []
    for values in belief.compute_percentiles(list(_FRACTIONS)).T:
        heights = np.diff(_FRACTIONS) / np.maximum(np.diff(values), 1e-9)
        curve = np.column_stack([0.5 * (values[1:] + values[:-1]), heights / heights.max()])
        curves.append(curve[curve[:, 0] <= _DENSITY_MAX])
    return curves
