"""Live scene in Drake's Meshcat: arm, object, contact forces, beliefs as curves on a panel, buttons and sliders."""

import io
import time
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import cast

import numpy as np
from matplotlib.figure import Figure
from pydrake.common.value import Value
from pydrake.geometry import Mesh, Rgba, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from pydrake.multibody.plant import ContactResults, MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus, OutputPort

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import SampledSystem, Source
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.reporting.live_bodies import LiveBodies
from affordance.reporting.live_panel import place_camera, place_panel
from affordance.reporting.replay import HELD_HEIGHT, open_meshcat, set_stage

_FRAMES_PER_SECOND = 30.0
# Simulated time between pictures of contact forces, [s], and ratio of real to simulated time while there are any.
_CONTACT_PERIOD, _SLOWNESS = 0.002, 10.0
_RED = Rgba(0.8, 0.2, 0.1, 1.0)
# Sliders: label, least and greatest value; both multiply what the objects' file says.
DENSITY, SIZE = "Density, times", "Size, times"
_SLIDERS = {DENSITY: (0.1, 2.0), SIZE: (0.5, 1.5)}
# Time for a page to load a picture, and between looks for a wish, [s].
_LOADING, _PATIENCE = 0.3, 0.1
# Size of the panel's picture, [px].
_PIXELS = (1000, 500)
# Axes on the panel, as shares of it: left, bottom, width, height.
_AXES = (0.06, 0.20, 0.88, 0.46)
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
        self._picture = 0
        self._bodies: dict[str, object] = {}
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
        self._panel = place_panel(p_WF)
        self.meshcat.SetCameraPose(*place_camera(p_WF, self._panel))

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
            self._redraw()
            time.sleep(_PATIENCE)
        return self.take_wish()

    def add_to(self, builder: DiagramBuilder, plant: MultibodyPlant, posterior: OutputPort) -> None:
        """Adds the systems that show a plant with shapes, and the belief on a port, to a Diagram."""
        (scene_graph,) = (system for system in builder.GetMutableSystems() if isinstance(system, SceneGraph))
        bodies = builder.AddNamedSystem(
            "live_bodies", LiveBodies(self.meshcat, self._bodies, 1.0 / _FRAMES_PER_SECOND)
        )
        builder.Connect(scene_graph.get_query_output_port(), bodies.GetInputPort("query"))
        forces = ContactVisualizerParams(prefix="contact", publish_period=_CONTACT_PERIOD)
        ContactVisualizer.AddToBuilder(builder, plant, self.meshcat, forces)
        clock = builder.AddNamedSystem("live_clock", _LiveClock(self))
        builder.Connect(posterior, clock.GetInputPort("posterior"))
        builder.Connect(plant.get_contact_results_output_port(), clock.GetInputPort("contact"))

    def announce(self, what: str, tool: Tool, memory: MaterialMemory, *, follows: bool = True) -> None:
        """Shows what is done with a tool, its true densities, and the belief about materials, on the panel.

        Titles, axis and legend are a picture on a rectangle, as Meshcat draws no text; the title is printed too. From
        then on the belief about the tool is drawn, if it is to be followed, and the height to hold.
        """
        self._follows = follows
        self.meshcat.SetProperty(HELD_HEIGHT, "visible", follows)
        title = f"{what}: {tool.name.replace('_', ' ')}, {tool.mass:.2f} kg"
        print(title, flush=True)
        figure = Figure(figsize=(_PIXELS[0] / 100, _PIXELS[1] / 100))
        axes = figure.add_axes(_AXES)
        axes.set_xlim(0.0, _DENSITY_MAX / 1000.0)
        axes.set_ylim(0.0, 1.05)
        axes.set_yticks([])
        axes.spines[["left", "right", "top"]].set_visible(False)
        axes.tick_params(labelsize=18)
        axes.set_xlabel("density, g/cm³ (line: this object; dashed: the truth)", fontsize=18, fontweight="bold")
        figure.text(_AXES[0], 0.89, title, fontsize=24, fontweight="bold")
        for part in tool.components:
            dark = 0.5 * np.array(part.looks_like.colour)
            axes.axvline(part.material.density / 1000.0, color=dark, linestyle="--", linewidth=4.0)
        for index, (colour, curve) in enumerate(zip(memory.colours, trace_densities(memory.belief), strict=True)):
            axes.fill_between(curve[:, 0] / 1000.0, curve[:, 1], color=colour, alpha=0.8)
            if index < 6:  # as many lines as there is room for
                x, y = _AXES[0] + 0.46 * (index % 2), 0.80 - 0.075 * (index // 2)
                figure.text(x, y, "■", fontsize=18, color=colour)
                figure.text(x + 0.04, y, self._describe(memory, index), fontsize=18, fontweight="bold")
        image = io.BytesIO()
        figure.savefig(image, format="png", dpi=100)
        self._hang(self._panel.build_mesh(image.getvalue()))
        for path in ("now", "path"):
            self.meshcat.Delete(path)

    def _hang(self, picture: Mesh) -> None:
        """Shows a new picture in place of the last one, which covers it until a page has had time to load it."""
        old, self._picture = f"panel/{self._picture % 2}", self._picture + 1
        new = f"panel/{self._picture % 2}"
        self.meshcat.SetTransform(new, RigidTransform(-0.01 * self._panel.front))
        self.meshcat.SetObject(new, picture, Rgba(1.0, 1.0, 1.0, 1.0))
        time.sleep(_LOADING)
        self.meshcat.Delete(old)
        self._redraw()

    def _redraw(self) -> None:
        """Has pages draw the scene anew, which they do only when told, and not when a picture has been loaded."""
        self.meshcat.SetTransform(f"panel/{self._picture % 2}", RigidTransform())

    def draw_path(self, p_WG: Array) -> None:
        """Draws the path that a point is to follow until the next announcement; places on it, (N, 3), [m]."""
        self.meshcat.SetLine("path", np.asfortranarray(p_WG.T), 2.0, _RED)

    def follow(self, belief: ObjectBelief) -> None:
        """Draws the belief about the object at hand, if it has changed."""
        if belief is self._shown or not self._follows:
            return
        self._shown = belief
        curves = trace_densities(belief.densities)
        left, bottom, wide, high = _AXES
        for curve, index in zip(curves, belief.colours, strict=True):
            shares = curve * [wide / _DENSITY_MAX, high / 1.05] + [left, bottom]
            line = np.asfortranarray(self._panel.place(shares, 0.01).T)
            red, green, blue = belief.memory.colours[index]
            self.meshcat.SetLine(f"now/{index}", line, 4.0, Rgba(0.6 * red, 0.6 * green, 0.6 * blue, 1.0))

    def _describe(self, memory: MaterialMemory, index: int) -> str:
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
