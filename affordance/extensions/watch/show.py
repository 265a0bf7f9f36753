"""Real-time presentation of a simulation of the paper in the live scene."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.analysis import Simulator

from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer, plan_strike
from affordance.choice.inner_simulation import Choice
from affordance.choice.picking import pick_cheapest
from affordance.choice.reach import Reach
from affordance.control.cost_measure import CostMeasure
from affordance.experiments import com, hammer, reach, weight
from affordance.experiments.shared import experience
from affordance.experiments.shared.grips import plan_grips
from affordance.experiments.shared.observers import Setup
from affordance.extensions.watch import live_facts as facts
from affordance.extensions.watch.live_scene import LiveScene, Wish
from affordance.objects.materials import MATERIALS, load_materials
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.runs.random_streams import Stream
from affordance.simulation.blow import run_blow
from affordance.simulation.trial import TrialRunner

# Density of a decoy as a fraction of the density of the object that it looks like.
_DECOY = 0.1
_PAUSE = 1.0  # between presentations, [s]
_DONE = "Choose what comes next."


class Show:
    """Presentations of an experiment to one observer, in real time."""

    def __init__(self, name: str, setup: Setup) -> None:
        """Opens the scene and, for Simulations III and IV, plans the task."""
        self._setup, self._settings = setup, setup.settings
        self._tools, self._duration, task = _begin(name, setup)
        self._start = self._memory = setup.start_memory(0)
        self._trial = 0
        shown = list(self._tools)
        self._task: Reach | Hammer | None = None
        if task is not None:
            print("Planning the task with every grip, which takes some seconds.", flush=True)
            self._task, novel = task
            choices = plan_grips([novel], self._task, self._settings, seed=setup.seed, jobs=1, description="plans")
            self._choice: Choice = choices[novel.name]
            self._grips = novel.list_gripped()
            shown += self._grips.values()
        # The memory can contain materials of other objects.
        known = load_materials(self._settings.arm.parent / MATERIALS.name)
        parts = [*known.values(), *(part.looks_like for tool in self._tools for part in tool.components)]
        names = {part.colour: part.name.replace("_", " ") for part in parts}
        self.scene = LiveScene(self._settings.arm, names, shown)
        self._runner = TrialRunner(self._settings, display=self.scene.add_to)

    def run(self) -> None:
        """Presents all objects and serves requests of users until the process is interrupted."""
        place, is_decoy = 0, False
        while True:
            wish = self._hold(self._tools[place % len(self._tools)], is_decoy=is_decoy) or self._do_task()
            if wish is None:
                waits = is_decoy or place == len(self._tools) - 1
                if waits:
                    self.scene.tell({}, note=_DONE)
                wish = self.scene.wait(np.inf if waits else _PAUSE)
            is_decoy = wish is Wish.DECOY
            if wish is Wish.RESET:
                self._memory, place = self._start, 0
            elif wish is None or wish is Wish.NEXT:
                place = (place + 1) % len(self._tools)

    def _hold(self, tool: Tool, *, is_decoy: bool) -> Wish | None:
        """Presents an object, and returns the request of a user or None.

        A request ends the presentation early. Then the observer does not learn from it.
        """
        density, size = self.scene.factors
        tool = tool.scaled(density * (_DECOY if is_decoy else 1.0), size)
        self.scene.announce("decoy" if is_decoy else "held", tool, self._memory)
        trial, seed = self._runner.get_diagram(tool), (self._setup.seed, 0, self._trial)
        simulator = trial.prepare(trial.diagram.CreateDefaultContext(), tool, trial.hold, self._memory, seed)
        self._trial += 1
        if wish := self._advance(simulator, self._duration):
            return wish
        record = trial.finish(simulator, tool, self._duration)
        self._setup.remember(record)
        self._memory = record.memory
        surprise = facts.describe_surprise(record, learns_from_outliers=self._settings.learns_from_outliers)
        self.scene.tell({"Moved": facts.describe_motion(record), "Surprise": surprise}, self._memory)
        print(f"felt: {tool.name.replace('_', ' ')}, {tool.mass:.2f} kg", flush=True)
        return None

    def _advance(self, simulator: Simulator, end: float) -> Wish | None:
        """Runs a presentation in real time until ``end``, [s], or a request. Returns the request or None."""
        simulator.set_target_realtime_rate(1.0)
        simulator.AdvanceTo(end)
        return self.scene.take_wish()

    def _do_task(self) -> Wish | None:
        """Chooses a grip of the novel tool, performs the task, and returns the request of a user or None."""
        if self._task is None:
            return None
        rng = np.random.default_rng([self._setup.seed, 0, self._trial, Stream.PAPER])
        costs = self._choice.compute_costs(self._choice.draw_parameters(self._memory, rng, 1))
        (chosen,) = pick_cheapest(costs, rng)  # planning has checked that each grip is feasible
        option, cost = self._choice.options[chosen], self._choice.cost_models[chosen]
        held, seed = self._grips[option.grip], (self._setup.seed, 1, self._trial)
        self.scene.announce(f"chosen by {option.grip.replace('_', ' ')}", held, self._memory, follows=False)
        self.scene.tell({"Grip": self._judge(option.grip)})
        if isinstance(self._task, Reach):
            trial = self._runner.get_diagram(held)
            following = self._task.begin(trial.model, held.p_TTfree)
            self.scene.draw_path(following.list_places(np.linspace(0.0, self._task.duration, 50)))
            simulator = trial.prepare(trial.diagram.CreateDefaultContext(), held, following, self._memory, seed)
            return self._advance(simulator, self._task.duration)
        assert isinstance(cost, BlowCost)  # the task is a Hammer
        model = ArmModel(load_arm(self._settings.arm))
        strike = plan_strike(cost, self._task, model, held.parameters, self._settings)
        run_blow(self._runner, held, strike, self._memory, seed=seed)
        return self.scene.take_wish()

    def _judge(self, chosen: str) -> str:
        """Compares the chosen grip with the cheapest grip at the true densities."""
        parameters = np.array([self._grips[option.grip].parameters for option in self._choice.options])
        costs = self._choice.compute_costs(parameters[:, None])
        cost = np.where(costs.feasible, costs.cost, np.inf)[:, 0]
        by_grip = {option.grip: float(each) for option, each in zip(self._choice.options, cost, strict=True)}
        unit = "N² m² s" if self._settings.cost_measure is CostMeasure.EFFORT else "J"
        return facts.describe_grip(by_grip, chosen, unit)


def _begin(name: str, setup: Setup) -> tuple[Sequence[Tool], float, tuple[Reach | Hammer, Tool] | None]:
    """Reads the objects and the task of a simulation.

    Returns: Objects in order of presentation, duration of a hold, [s], and the task with its tool, or None.
    """
    if name == "weight":
        return weight.read(setup), weight.DURATION, None
    if name == "com":
        held = com.read(setup)
        learning = [held[index] for index in experience.draw_order(setup, 2, 0)]
        return [*learning, *held], com.DURATION, None
    tools: tuple[Sequence[Tool], Sequence[Tool], Reach | Hammer] = (reach if name == "reach" else hammer).read(setup)
    return tools[0], experience.DURATION, (tools[2], tools[1][0])
