"""Live scene of ``affordance watch``: the arm in Meshcat, with what was expected and what is felt next to it."""

import time
from collections.abc import Iterable, Mapping
from enum import Enum
from pathlib import Path
from typing import Any, cast

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import Rgba, SceneGraph
from pydrake.lcm import DrakeLcm
from pydrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactResults,
    ExternallyAppliedSpatialForce,
    MultibodyPlant,
)
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus, OutputPort
from pydrake.visualization import ApplyVisualizationConfig, VisualizationConfig

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import SampledSystem, Source
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.load import attach_tool, parse_arm
from affordance.reporting import live_facts as facts
from affordance.reporting.live_bodies import LiveBodies
from affordance.reporting.live_page import LivePage
from affordance.reporting.replay import HELD_HEIGHT, open_meshcat, set_stage
from affordance.reporting.side_view import SideView, find_direction, list_corners, place_camera

_FRAMES_PER_SECOND = 30.0
# Simulated time between pictures of contact forces, [s], and ratio of real to simulated time while there are any.
_CONTACT_PERIOD, _SLOWNESS = 0.002, 10.0
_RED = Rgba(0.8, 0.2, 0.1, 1.0)
# Sliders: label, least and greatest value; both multiply what the objects' file says.
DENSITY, SIZE = "Density, times", "Size, times"
_SLIDERS = ((DENSITY, "Density", 0.1, 2.0), (SIZE, "Size", 0.5, 1.5))
# Time between looks for a wish, and between measurements of the pace, [s].
_PATIENCE, _PACE = 0.1, 0.4
# Stiffness of the spring by which a visitor pulls a body, over the body's mass, [1/s^2]: a tenth of a metre lifts it.
_STIFFNESS = 100.0


class Wish(Enum):
    """Wish of a visitor, by the label of its button; that of a moved slider has none."""

    NEXT = "Next object"
    DECOY = "Decoy"
    RESET = "Reset"
    CHANGE = ""


class LiveScene:
    """Scene that several Diagrams share, one after another.

    Attributes:
        follows: True if the belief about the object at hand is followed.
        is_pulled: True while a visitor pulls a body of the arm with the mouse.
        was_pulled: True if one did since the last presentation began.
        pace: Ratio of simulated to real time, as last measured.
    """

    def __init__(self, directives: Path, names: Mapping[Colour, str], tools: Iterable[Tool] = ()) -> None:
        """Opens Meshcat and the page, before whose camera is the arm with each of the tools in its hand.

        Errors are those of ``open_meshcat`` and ``LivePage``.
        """
        self.meshcat = open_meshcat("the live scene")
        self._names = names
        self._bodies: dict[str, object] = {}
        self.follows = True
        self._tool: Tool | None = None
        self._expected: ObjectBelief | None = None
        self._felt: ObjectBelief | None = None
        self._masses: Array | None = None  # as expected
        self.is_pulled, self.was_pulled, self.pace = False, False, 1.0
        buttons = [(wish.value, wish.value[0]) for wish in Wish if wish.value]
        for name, key in buttons:
            self.meshcat.AddButton(name, f"Key{key}")
        for name, _, low, high in _SLIDERS:
            self.meshcat.AddSlider(name, low, high, 0.05, 1.0)
        self._clicks = self._count_clicks()
        self._factors = self.factors
        view = self._set_stage(directives, tools)
        self.page = LivePage(self.meshcat, buttons, _SLIDERS)
        self._state: dict[str, Any] = {"view": (view.wide, view.high), "note": "", "pace": ""}

    def _set_stage(self, directives: Path, tools: Iterable[Tool]) -> SideView:
        """Points the camera at the arm in its home posture, with the tools in its hand."""
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        hand = parse_arm(plant, directives)
        for number, tool in enumerate(tools):
            attach_tool(plant, hand, tool, f"tool_{number}")
        plant.Finalize()
        diagram = builder.Build()
        context = diagram.CreateDefaultContext()
        plant_context = plant.GetMyContextFromRoot(context)
        set_stage(self.meshcat, plant, plant_context, hand, None, [])
        corners = list_corners(scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context)))
        corners = np.vstack([corners, hand.CalcPoseInWorld(plant_context).translation()])
        view = place_camera(corners, find_direction(plant, plant_context, hand))
        self.meshcat.SetCameraPose(view.place, view.target)
        return view

    @property
    def ports(self) -> tuple[int, int]:
        """Ports of the page and of its scene."""
        return self.page.port, int(self.meshcat.port())

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
            time.sleep(_PATIENCE)
        return self.take_wish()

    def add_to(self, builder: DiagramBuilder, plant: MultibodyPlant, posterior: OutputPort) -> None:
        """Adds the systems that show a plant with shapes, and the belief on a port, to a Diagram.

        A visitor can pull the arm and what it holds, unless there is a nail: a blow is planned to the millisecond.
        """
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
        if not plant.HasModelInstanceNamed("nail"):
            spring = VisualizationConfig(
                publish_illustration=False,
                publish_proximity=False,
                publish_contacts=False,
                publish_inertia=False,
                mouse_interaction_stiffness=_STIFFNESS,
            )
            # Nothing is published by LCM, so that no socket is opened.
            silent = DrakeLcm("memq://")
            ApplyVisualizationConfig(
                spring, builder, plant=plant, scene_graph=scene_graph, meshcat=self.meshcat, lcm=silent
            )
            pull = builder.GetSubsystemByName("meshcat_mouse_spring").get_output_port(0)
            builder.Connect(pull, clock.GetInputPort("pull"))

    def announce(self, what: str, tool: Tool, memory: MaterialMemory, *, follows: bool = True) -> None:
        """Begins the presentation of a tool to an observer with a memory; its title is printed too.

        From then on the belief about the tool is drawn, as it was first and, if it is to be followed, as it is.
        """
        self.follows, self.was_pulled = follows, False
        self._tool, self._expected, self._felt, self._masses = tool, None, None, None
        self.meshcat.SetProperty(HELD_HEIGHT, "visible", follows)
        self.meshcat.Delete("path")
        name = tool.name.replace("_", " ")
        print(f"{what}: {name}, {tool.mass:.2f} kg", flush=True)
        self._state |= {"title": f"{what[0].upper()}{what[1:]}: {name}", "factors": self.factors}
        self._rows = {"True mass": facts.describe_mass(tool.mass)}
        self.tell({}, memory, note="")

    def tell(self, rows: Mapping[str, str], memory: MaterialMemory | None = None, note: str | None = None) -> None:
        """Shows lines of text, by heading, next to the scene, and what a memory believes about materials."""
        self._rows |= rows
        if memory is not None:
            self._state["legend"] = facts.describe_memory(memory, self._names)
        if note is not None:
            self._state["note"] = note
        self._show()

    def draw_path(self, p_WG: Array) -> None:
        """Draws the path that a point is to follow until the next announcement; places on it, (N, 3), [m]."""
        self.meshcat.SetLine("path", np.asfortranarray(p_WG.T), 2.0, _RED)

    def follow(self, belief: ObjectBelief) -> None:
        """Draws the belief about the object at hand, if it has changed; the first one is what was expected."""
        if self._expected is None:
            assert self._tool is not None  # announced before
            self._expected = belief
            self._masses = facts.draw_masses(belief)
            self.tell({"Expected": facts.describe_masses(self._masses, self._tool.mass)})
        elif self.follows and belief is not (self._felt or self._expected):
            self._felt = belief
            self._show()

    def _show(self) -> None:
        tool = self._tool
        assert tool is not None  # announced before
        felt = None if self._felt is None else facts.draw_masses(self._felt)
        if felt is not None:
            self._rows["After feeling"] = facts.describe_masses(felt, tool.mass)
        pace = f"Shown at {100.0 * self.pace:.0f}\u00a0% of real time."
        self._state |= {
            "rows": [(name, self._rows[name]) for name in _ROWS if name in self._rows],
            "mass": facts.draw_mass_chart(tool, self._masses, felt),
            "densities": facts.draw_density_chart(tool, self._expected, self._felt),
            "pace": pace,
        }
        self.page.show(self._state)

    def _count_clicks(self) -> dict[Wish, int]:
        return {wish: self.meshcat.GetButtonClicks(wish.value) for wish in Wish if wish.value}


# Headings of the lines next to the scene, in their order.
_ROWS = ("True mass", "Expected", "After feeling", "Moved", "Surprise", "Grip")


class _LiveClock(SampledSystem):
    """Clock that keeps a presentation in real time, shows the belief, and ends it at a visitor's wish.

    While something is in contact, which lasts some milliseconds, it slows down, so that forces can be seen. Where a
    visitor begins or ends to pull, a presentation whose belief is followed is interrupted.

    Input ports:
        contact: Contact results of the plant.
        posterior: Belief given the samples so far, ObjectBelief.
        pull: Forces of the visitor's spring, none unless it is drawn; need not be connected.
    """

    def __init__(self, scene: LiveScene) -> None:
        super().__init__()
        self._scene = scene
        self._start = 0.0
        self._mark = (0.0, 0.0)  # real and simulated time at which the pace was last measured, [s]
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        self._contact = self.DeclareAbstractInputPort("contact", Value(ContactResults()))
        self._pull = self.DeclareAbstractInputPort("pull", Value[list[ExternallyAppliedSpatialForce]]())
        self.DeclareInitializationPublishEvent(self._begin)
        self.DeclarePeriodicPublishEvent(_CONTACT_PERIOD, 0.0, self._look)
        self.DeclarePeriodicPublishEvent(1.0 / _FRAMES_PER_SECOND, 0.0, self._keep_pace)

    def _begin(self, context: Context) -> None:
        self._start = time.monotonic() - context.get_time()
        self._mark = (time.monotonic(), context.get_time())

    def _look(self, context: Context) -> EventStatus:
        contact = cast(ContactResults, self._contact.Eval(context))
        if contact.num_point_pair_contacts() or contact.num_hydroelastic_contacts():
            pause = (_SLOWNESS - 1.0) * _CONTACT_PERIOD
            self._start += pause
            time.sleep(pause)
        was, now = self._scene.is_pulled, self._pull.HasValue(context) and bool(self._pull.Eval(context))
        self._scene.is_pulled = now
        self._scene.was_pulled |= now
        if was != now and self._scene.follows:
            return EventStatus.ReachedTermination(self, "a pull begins or ends")
        return EventStatus.Succeeded()

    def _keep_pace(self, context: Context) -> EventStatus:
        self._scene.follow(self._posterior.Eval(context))
        time.sleep(max(0.0, self._start + context.get_time() - time.monotonic()))
        real, simulated = time.monotonic() - self._mark[0], context.get_time() - self._mark[1]
        if real > _PACE:
            self._scene.pace, self._mark = simulated / real, (time.monotonic(), context.get_time())
        if self._scene.is_wanted:
            return EventStatus.ReachedTermination(self, "a wish")
        return EventStatus.Succeeded()
