"""``affordance watch``: an observer of an experiment, live in the browser."""

import argparse
import os
import socket
import sys
import webbrowser
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory_file import begin_memory
from affordance.belief.object_belief import Memory
from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer, plan_strike
from affordance.choice.inner_simulation import Choice
from affordance.choice.picking import pick_cheapest
from affordance.choice.reach import Reach
from affordance.commands import options
from affordance.exceptions import BadValueError
from affordance.experiments.shared.choosing import ChoiceExperiment
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.experiments.suite import begin_with, load_experiment
from affordance.memory.past_arms import describe_past_arms
from affordance.named_settings import parse_changes
from affordance.objects.materials import MATERIALS, load_materials
from affordance.objects.tool import Tool
from affordance.plant.arm import ARM
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.reporting.live_scene import LiveScene, Wish
from affordance.robots.kept import open_robot
from affordance.settings import Settings
from affordance.simulation.blow import run_blow
from affordance.simulation.trial import TrialRunner, finish

_WATCHABLE = ("weight", "com", "reach", "hammer")
# A decoy looks like the object before it, and has this share of its density.
_DECOY = 0.1
# Hold of a protocol that is computed in closed form, and pause between presentations, [s].
_DURATION, _PAUSE = 3.0, 1.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    names = ", ".join(_WATCHABLE)
    parser.add_argument("experiment", nargs="?", default="weight", help=f"{names}, or a protocol (path or name)")
    options.add_robot(parser)
    options.add_seed(parser)
    options.add_set(parser)
    what = "lasting memory: the observer begins with it, and every hold is appended"
    parser.add_argument("--memory", default="", help=what)
    options.add_same_colours(parser)


def run(arguments: argparse.Namespace) -> int:
    """Shows an observer until it is interrupted; returns the exit status."""
    options.check_bounds(arguments)
    if arguments.experiment == "vision":
        raise BadValueError("experiment", "", f"is 'vision', in which nothing moves, must be {', '.join(_WATCHABLE)}")
    options.check_experiment(arguments, _WATCHABLE)
    if arguments.robot is not None and arguments.robot.is_file():
        print(f"{arguments.robot.name} is imported first unless results/arms has it, some half a minute.", flush=True)
    robot = open_robot(*options.read_robot(arguments))
    if past := describe_past_arms(robot.name, robot.count_past_arms(arguments.memory)):
        print(past, flush=True)
    models = robot.folder
    changes = parse_changes(arguments.changes)
    settings, seed = Settings(arm=models / ARM.name), arguments.seed
    materials = load_materials(models / MATERIALS.name) if arguments.same_colour else {}
    same_colours = options.read_same_colours(arguments, materials)
    if arguments.memory:
        settings, seed = begin_with(settings, arguments.memory, seed, changes, same_colours)
    experiment = load_experiment(arguments.experiment, models, seed, settings, changes)
    assert isinstance(experiment, PresentationExperiment | ChoiceExperiment)  # vision was refused
    if isinstance(experiment, ChoiceExperiment):
        print("The task is planned with every grip first, which takes some seconds.", flush=True)
    show = _Show(experiment)
    address = show.scene.address
    port = address.rsplit(":", 1)[1]
    print(f"Watch {experiment.name} at {address} (Ctrl-C ends it)", end="; ")
    print(f"from another machine first: ssh -L {port}:localhost:{port} {socket.gethostname()}", flush=True)
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open_new_tab(address)
    try:
        show.run()
    except KeyboardInterrupt:
        print()
    return 0


class _Show:
    """Presentations of an experiment to one observer, at the pace of the wall."""

    def __init__(self, experiment: PresentationExperiment | ChoiceExperiment) -> None:
        """Opens the scene, and plans the task if there is one."""
        self.settings = experiment.settings
        self.seed = experiment.seed
        self.tools, self.duration, self.memory = _begin(experiment)
        self.start, self.trial = self.memory, 0
        self.task: Reach | Hammer | None = None
        if isinstance(experiment, ChoiceExperiment):
            assert isinstance(experiment.task, Reach | Hammer)  # as protocols have them
            self.task, self.novel = experiment.task, experiment.novel[0]
            self.choice: Choice = experiment.plan_grips(self.settings, "plans", 1)[self.novel.name]
            self.grips = self.novel.list_gripped()
        # A memory may be of more than these objects.
        known = load_materials(self.settings.arm.parent / MATERIALS.name)
        parts = [*known.values(), *(part.looks_like for tool in self.tools for part in tool.components)]
        self.scene = LiveScene(self.settings.arm, {part.colour: part.name.replace("_", " ") for part in parts})
        self.runner = TrialRunner(self.settings, display=self.scene.add_to)
        # What is not held teaches nothing, and is not remembered.
        self.doer = TrialRunner(replace(self.settings, ledger=""), display=self.scene.add_to)

    def run(self) -> None:
        """Presents all objects and does what visitors wish, until an interruption."""
        place, is_decoy = 0, False
        while True:
            tool = self.tools[place % len(self.tools)]
            wish = self._hold(tool, is_decoy=is_decoy) or self._do_task()
            is_last = place == len(self.tools) - 1
            wish = wish or self.scene.wait(np.inf if is_last or is_decoy else _PAUSE)
            is_decoy = wish is Wish.DECOY
            if wish is Wish.RESET:
                self.memory, place = self.start, 0
            elif wish is None or wish is Wish.NEXT:
                place = (place + 1) % len(self.tools)

    def _hold(self, tool: Tool, *, is_decoy: bool) -> Wish | None:
        """Presents an object, from which the observer learns unless a wish ends it before; returns the wish."""
        density, size = self.scene.factors
        tool = tool.scaled(density * (_DECOY if is_decoy else 1.0), size)
        self.scene.announce("decoy" if is_decoy else "held", tool, self.memory)
        trial = self.runner.get_diagram(self.duration, tool)
        simulator = self.runner.prepare(trial, tool, trial.hold, self.memory, (self.seed, 0, self.trial))
        self.trial += 1
        simulator.AdvanceTo(self.duration)
        if not self.scene.is_wanted:
            self.memory = finish(trial, simulator, tool).memory
            self.scene.announce("felt", tool, self.memory)
        return self.scene.take_wish()

    def _do_task(self) -> Wish | None:
        """Chooses a grip of the novel tool by the present belief, and does the task with it; returns a wish."""
        if self.task is None:
            return None
        rng = np.random.default_rng([self.seed, 0, self.trial, 1])
        costs = self.choice.compute_costs(self.choice.draw_parameters(self.memory, rng, 1))
        (chosen,) = pick_cheapest(costs, rng)  # each grip can do it, or planning had said so
        option, cost = self.choice.options[chosen], self.choice.cost_models[chosen]
        held = self.grips[option.grip]
        self.scene.announce(f"chosen by {option.grip.replace('_', ' ')}", held, self.memory, follows=False)
        if isinstance(self.task, Reach):
            trial = self.doer.get_diagram(self.task.duration, held)
            following = self.task.begin(trial.model, held.p_TTfree)
            self.scene.draw_path(following.list_places(np.linspace(0.0, self.task.duration, 50)))
            simulator = self.doer.prepare(trial, held, following, self.memory, (self.seed, 1, self.trial))
            simulator.AdvanceTo(self.task.duration)
        else:
            assert isinstance(cost, BlowCost)  # as built by a Hammer
            model = ArmModel(load_arm(self.settings.arm))
            strike = plan_strike(cost, self.task, model, held.parameters, self.settings)
            run_blow(self.doer, held, strike, self.memory, seed=(self.seed, 1, self.trial))
        return self.scene.take_wish()


def _begin(experiment: PresentationExperiment | ChoiceExperiment) -> tuple[Sequence[Tool], float, Memory]:
    """Returns the objects in the order of the first observer, the duration of a hold, [s], and the first memory."""
    settings = experiment.settings
    memory = begin_memory(settings.known, settings.learner, (experiment.seed, 0))
    if isinstance(experiment, ChoiceExperiment):
        return experiment.experience.tools, experiment.experience.duration, memory
    if experiment.told:
        memory = MaterialMemory.from_densities(dict(experiment.told))
    tools = [experiment.weigh(each) for each in experiment.draw_presentations(0)]
    return tools, experiment.duration or _DURATION, memory
