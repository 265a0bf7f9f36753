"""Live scene of ``affordance watch``: the arm in Meshcat, next to beliefs before and after feeling."""

import math
import time
from collections.abc import Iterable, Mapping
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import MeshcatVisualizer, MeshcatVisualizerParams, Rgba, SceneGraph
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus, OutputPort

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import SampledSystem, Source
from affordance.extensions.watch import live_facts as facts
from affordance.extensions.watch.live_page import LivePage
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.load import attach_tool, parse_arm
from affordance.reporting.replay import HELD_HEIGHT, open_meshcat, set_stage
from affordance.reporting.side_view import SideView, find_direction, list_corners, place_camera

_FRAME = 1.0 / 30.0  # time between two frames, [s]
_RED = Rgba(0.8, 0.2, 0.1, 1.0)
# Sliders with label, smallest and largest value. Their values scale the density and size of the objects.
DENSITY, SIZE = "Density, times", "Size, times"
_SLIDERS = ((DENSITY, "Density", 0.1, 2.0), (SIZE, "Size", 0.5, 1.5))
_PATIENCE = 0.1  # time between checks for a request, [s]
# Headings of the lines next to the scene, from top to bottom.
_ROWS = ("True mass", "Expected", "After feeling", "Moved", "Surprise", "Grip")


class Wish(Enum):
    """Request of a user. Values are labels of buttons; CHANGE means that a slider was moved."""

    NEXT = "Next object"
    DECOY = "Decoy"
    RESET = "Reset"
    CHANGE = ""


class LiveScene:
    """Meshcat scene and page that show several Diagrams, one after another."""

    def __init__(self, directives: Path, names: Mapping[Colour, str], tools: Iterable[Tool] = ()) -> None:
        """Opens Meshcat and the page. Errors are as in ``open_meshcat`` and ``LivePage``.

        Args:
            directives: File of the arm.
            names: Name of each colour.
            tools: Tools that must fit in the view when held.
        """
        self.meshcat = open_meshcat("the live scene")
        self._names = names
        self._tool: Tool | None = None
        self._expected: ObjectBelief | None = None
        self._felt: ObjectBelief | None = None
        self._masses: Array | None = None  # samples of the expected mass
        self._follows = True
        buttons = [(wish.value, wish.value[0]) for wish in Wish if wish.value]
        for name, key in buttons:
            self.meshcat.AddButton(name, f"Key{key}")
        for name, _, low, high in _SLIDERS:
            self.meshcat.AddSlider(name, low, high, 0.05, 1.0)
        self._clicks = self._count_clicks()
        self._factors = self.factors
        view = self._set_stage(directives, tools)
        self.page = LivePage(self.meshcat, buttons, _SLIDERS)
        self._state: dict[str, Any] = {"view": (view.wide, view.high), "note": ""}

    def _set_stage(self, directives: Path, tools: Iterable[Tool]) -> SideView:
        """Points the camera at the arm in its home posture so that all tools in its hand are visible."""
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
    def addresses(self) -> tuple[str, str]:
        """Addresses of the page and the scene."""
        return self.page.address, self.meshcat.web_url()

    @property
    def factors(self) -> tuple[float, float]:
        """Factors for density and size, limited to the range of the sliders. NaN becomes 1."""
        sent = [(self.meshcat.GetSliderValue(name), low, high) for name, _, low, high in _SLIDERS]
        density, size = (1.0 if math.isnan(value) else min(max(value, low), high) for value, low, high in sent)
        return density, size

    @property
    def is_wanted(self) -> bool:
        """True if a button or slider was used since the last request."""
        return self._clicks != self._count_clicks() or self._factors != self.factors

    def take_wish(self) -> Wish | None:
        """Returns the request since the last call, or None."""
        clicks, factors = self._count_clicks(), self.factors
        pressed = [wish for wish, number in clicks.items() if number != self._clicks[wish]]
        moved = factors != self._factors
        self._clicks, self._factors = clicks, factors
        return pressed[0] if pressed else Wish.CHANGE if moved else None

    def wait(self, seconds: float = np.inf) -> Wish | None:
        """Waits for a request for at most the given time, [s], and returns it or None."""
        end = time.monotonic() + seconds
        while not self.is_wanted and time.monotonic() < end:
            time.sleep(_PATIENCE)
        return self.take_wish()

    def add_to(self, builder: DiagramBuilder, plant: MultibodyPlant, posterior: OutputPort) -> None:
        """Adds systems to a Diagram that show a plant and the belief from an output port."""
        (scene_graph,) = (system for system in builder.GetMutableSystems() if isinstance(system, SceneGraph))
        shown = MeshcatVisualizerParams(prefix="arm", publish_period=_FRAME)
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, self.meshcat, shown)
        display = builder.AddNamedSystem("belief_display", _BeliefDisplay(self))
        builder.Connect(posterior, display.GetInputPort("posterior"))

    def announce(self, what: str, tool: Tool, memory: MaterialMemory, *, follows: bool = True) -> None:
        """Announces the presentation of a tool on the page and the terminal.

        Args:
            what: Kind of presentation.
            tool: Presented tool.
            memory: Memory of the observer before the presentation.
            follows: True to show the posterior in addition to the prior.
        """
        self._follows = follows
        self._tool, self._expected, self._felt, self._masses = tool, None, None, None
        self.meshcat.SetProperty(HELD_HEIGHT, "visible", follows)
        self.meshcat.Delete("path")
        name = tool.name.replace("_", " ")
        print(f"{what}: {name}, {tool.mass:.2f} kg", flush=True)
        self._state |= {"title": f"{what[0].upper()}{what[1:]}: {name}", "factors": self.factors}
        self._rows = {"True mass": facts.describe_mass(tool.mass)}
        self.tell({}, memory, note="")

    def tell(self, rows: Mapping[str, str], memory: MaterialMemory | None = None, note: str | None = None) -> None:
        """Updates lines of text by heading, the beliefs about materials, and the note."""
        self._rows |= rows
        if memory is not None:
            self._state["legend"] = facts.describe_memory(memory, self._names)
        if note is not None:
            self._state["note"] = note
        self._show()

    def draw_path(self, p_WG: Array) -> None:
        """Draws the desired path of a point, (N, 3), [m], until the next announcement."""
        self.meshcat.SetLine("path", np.asfortranarray(p_WG.T), 2.0, _RED)

    def follow(self, belief: ObjectBelief) -> None:
        """Shows the belief about the object if it has changed. The first belief is the prior."""
        if self._expected is None:
            assert self._tool is not None  # announced before
            self._expected = belief
            self._masses = facts.draw_masses(belief)
            self.tell({"Expected": facts.describe_masses(self._masses, self._tool.mass)})
        elif self._follows and belief is not (self._felt or self._expected):
            self._felt = belief
            self._show()

    def _show(self) -> None:
        tool = self._tool
        assert tool is not None  # announced before
        felt = None if self._felt is None else facts.draw_masses(self._felt)
        if felt is not None:
            self._rows["After feeling"] = facts.describe_masses(felt, tool.mass)
        self._state |= {
            "rows": [(name, self._rows[name]) for name in _ROWS if name in self._rows],
            "mass": facts.draw_mass_chart(tool, self._masses, felt),
            "densities": facts.draw_density_chart(tool, self._expected, self._felt),
        }
        self.page.show(self._state)

    def _count_clicks(self) -> dict[Wish, int]:
        return {wish: self.meshcat.GetButtonClicks(wish.value) for wish in Wish if wish.value}


class _BeliefDisplay(SampledSystem):
    """System that shows the belief next to the scene, and ends the presentation when the user requests something.

    Input ports:
        posterior: Belief given the samples so far, ObjectBelief.
    """

    def __init__(self, scene: LiveScene) -> None:
        super().__init__()
        self._scene = scene
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        self.DeclarePeriodicPublishEvent(_FRAME, 0.0, self._show)

    def _show(self, context: Context) -> EventStatus:
        self._scene.follow(self._posterior.Eval(context))
        return EventStatus.ReachedTermination(self, "a wish") if self._scene.is_wanted else EventStatus.Succeeded()
