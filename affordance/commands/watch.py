"""``affordance watch``: shows an observer in an experiment, live in the browser."""

import argparse
import os
import socket
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus

from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer, plan_strike
from affordance.choice.inner_simulation import Choice
from affordance.choice.picking import pick_cheapest
from affordance.choice.reach import Reach
from affordance.commands import options
from affordance.commands.setups import check_experiment, read_setup
from affordance.control.cost_measure import CostMeasure
from affordance.exceptions import BadValueError
from affordance.experiments import com, experience, next_lift, weight
from affordance.experiments.grips import plan_grips
from affordance.experiments.observers import Setup
from affordance.experiments.suite import NAMES, find_experiment
from affordance.memory.past_arms import describe_past_arms
from affordance.objects.materials import MATERIALS, load_materials
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.reporting import live_facts as facts
from affordance.reporting.live_scene import LiveScene, Wish
from affordance.robots.kept import open_robot
from affordance.simulation.blow import run_blow
from affordance.simulation.diagram import END_MARGIN, TrialDiagram
from affordance.simulation.trial import TrialRunner, finish

_WATCHABLE = tuple(name for name in NAMES if name != "vision")
# A decoy looks like the object before it, and has this share of its density.
_DECOY = 0.1
_PAUSE = 1.0  # between presentations, [s]
# Notes next to the scene.
_PULLED = "You pulled: this hold is not remembered."
_OVER = "The hold is over: choose what comes next. Until then you can pull; nothing more is learned."
_DONE = "The task is over: choose what comes next."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    names = ", ".join(_WATCHABLE)
    parser.add_argument("experiment", nargs="?", default="weight", help=f"{names} (default: weight)")
    options.add_robot(parser)
    options.add_seed(parser)
    options.add_set(parser)
    options.add_learner(parser)
    what = "lasting memory (SQLite file): the observer starts with it, and every hold is added"
    parser.add_argument("--memory", default="", metavar="MEMORY", help=what)
    options.add_same_colours(parser)


def run(arguments: argparse.Namespace) -> int:
    """Shows an observer until it is interrupted; returns the exit status."""
    options.check_bounds(arguments)
    if arguments.experiment == "vision":
        raise BadValueError("experiment", "", f"is 'vision', in which nothing moves, must be {', '.join(_WATCHABLE)}")
    check_experiment(arguments, _WATCHABLE)
    if arguments.robot is not None and arguments.robot.is_file():
        options.tell(
            arguments, f"{arguments.robot.name}: importing it takes about half a minute, unless that was done before."
        )
    robot = open_robot(*options.read_robot(arguments))
    if past := describe_past_arms(robot.name, robot.count_past_arms(arguments.memory)):
        options.tell(arguments, past)
    arguments.repeats, arguments.jobs, arguments.out = 1, 1, Path("results")
    setup = read_setup(arguments, robot, options.read_changes(arguments))
    show = _Show(arguments.experiment, setup)
    address = show.scene.page.address
    tunnels = " ".join(f"-L {port}:localhost:{port}" for port in show.scene.ports)
    print(f"Watch {arguments.experiment} at {address} (Ctrl-C ends it)", end="; ")
    print(f"from another machine first: ssh {tunnels} {socket.gethostname()}", flush=True)
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open_new_tab(address)
    try:
        show.run()
    except KeyboardInterrupt:
        print()
    return 0


class _Show:
    """Presentations of an experiment to one observer, at the pace of the wall."""

    def __init__(self, name: str, setup: Setup) -> None:
        """Opens the scene, and plans the task if there is one."""
        self.setup, self.settings = setup, setup.settings
        self.tools, self.duration, task = _begin(name, setup)
        self.start = self.memory = setup.start_memory(0)
        self.trial = 0
        self.held: tuple[TrialDiagram, Simulator] | None = None
        shown = list(self.tools)
        self.task: Reach | Hammer | None = None
        if task is not None:
            print("Planning the task with every grip, which takes some seconds.", flush=True)
            self.task, novel = task
            choices = plan_grips([novel], self.task, self.settings, seed=setup.seed, jobs=1, description="plans")
            self.choice: Choice = choices[novel.name]
            self.grips = novel.list_gripped()
            shown += self.grips.values()
        # A memory may be of more than these objects.
        known = load_materials(self.settings.arm.parent / MATERIALS.name)
        parts = [*known.values(), *(part.looks_like for tool in self.tools for part in tool.components)]
        names = {part.colour: part.name.replace("_", " ") for part in parts}
        self.scene = LiveScene(self.settings.arm, names, shown)
        self.runner = TrialRunner(self.settings, display=self.scene.add_to)

    def run(self) -> None:
        """Presents all objects and does what visitors wish, until an interruption."""
        place, is_decoy = 0, False
        while True:
            tool = self.tools[place % len(self.tools)]
            wish = self._hold(tool, is_decoy=is_decoy) or self._do_task()
            is_last = place == len(self.tools) - 1
            wish = wish or self._rest(np.inf if is_last or is_decoy else _PAUSE)
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
        simulator = self.runner.prepare(trial, tool, trial.hold, self.memory, (self.setup.seed, 0, self.trial))
        self.trial += 1
        self._advance(trial, simulator, self.duration + END_MARGIN, _PULLED)
        if self.scene.is_wanted:
            return self.scene.take_wish()
        record = finish(trial, simulator, tool)
        self._continue(trial, simulator)
        if self.scene.was_pulled:
            rows = {"Moved": facts.describe_motion(record), "Surprise": "unknown, because you pulled"}
            self.scene.tell(rows, note=_PULLED)  # it may have begun before this hold
            return self.scene.take_wish()
        self.setup.remember(record)
        self.memory = record.memory
        surprise = facts.describe_surprise(record, learns_from_outliers=self.settings.learns_from_outliers)
        self.scene.tell({"Moved": facts.describe_motion(record), "Surprise": surprise}, self.memory)
        print(f"felt: {tool.name.replace('_', ' ')}, {tool.mass:.2f} kg", flush=True)
        return self.scene.take_wish()

    def _advance(self, trial: TrialDiagram, simulator: Simulator, end: float, note: str | None = None) -> None:
        """Advances a hold to a time, or a wish; where a visitor begins or ends to pull, the belief begins anew.

        A pull is then noted next to the scene, if there is a note for it.
        """
        reached = SimulatorStatus.ReturnReason.kReachedBoundaryTime
        while simulator.AdvanceTo(end).reason() != reached and not self.scene.is_wanted:
            trial.estimator.forget(trial.estimator.GetMyMutableContextFromRoot(simulator.get_mutable_context()))
            self.scene.tell({}, note=note)

    def _continue(self, trial: TrialDiagram, simulator: Simulator) -> None:
        """Lets a hold that is over go on as if it were not, for ``_rest``."""
        context = simulator.get_mutable_context()
        trial.memory.set_memory(trial.memory.GetMyMutableContextFromRoot(context), self.memory)
        trial.estimator.resume(trial.estimator.GetMyMutableContextFromRoot(context))
        self.held = trial, simulator

    def _rest(self, seconds: float) -> Wish | None:
        """Holds the object on for some time, [s], from which nothing is learned, or until a wish; returns it."""
        if seconds == np.inf and not self.scene.was_pulled:
            self.scene.tell({}, note=_OVER if self.held else _DONE)
        if self.held is None:
            return self.scene.wait(seconds)
        trial, simulator = self.held
        context = simulator.get_mutable_context()
        while seconds > 0.0 and not self.scene.is_wanted:
            # The clock is set back, as the memory would learn again at twice the duration.
            context.SetTime(self.duration + 0.001)
            for log in (trial.state_log, trial.tau_log):
                log.FindMutableLog(context).Clear()
            simulator.Initialize()
            self._advance(trial, simulator, context.get_time() + min(seconds, 0.9 * self.duration))
            seconds -= 0.9 * self.duration
        return self.scene.take_wish()

    def _do_task(self) -> Wish | None:
        """Chooses a grip of the novel tool by the present belief, and does the task with it; returns a wish."""
        if self.task is None:
            return None
        self.held = None
        rng = np.random.default_rng([self.setup.seed, 0, self.trial, 1])
        costs = self.choice.compute_costs(self.choice.draw_parameters(self.memory, rng, 1))
        (chosen,) = pick_cheapest(costs, rng)  # each grip can do it, or planning had said so
        option, cost = self.choice.options[chosen], self.choice.cost_models[chosen]
        held = self.grips[option.grip]
        self.scene.announce(f"chosen by {option.grip.replace('_', ' ')}", held, self.memory, follows=False)
        self.scene.tell({"Grip": self._judge(option.grip)})
        if isinstance(self.task, Reach):
            trial = self.runner.get_diagram(self.task.duration, held)
            following = self.task.begin(trial.model, held.p_TTfree)
            self.scene.draw_path(following.list_places(np.linspace(0.0, self.task.duration, 50)))
            simulator = self.runner.prepare(trial, held, following, self.memory, (self.setup.seed, 1, self.trial))
            simulator.AdvanceTo(self.task.duration)
        else:
            assert isinstance(cost, BlowCost)  # as built by a Hammer
            model = ArmModel(load_arm(self.settings.arm))
            strike = plan_strike(cost, self.task, model, held.parameters, self.settings)
            run_blow(self.runner, held, strike, self.memory, seed=(self.setup.seed, 1, self.trial))
        return self.scene.take_wish()

    def _judge(self, chosen: str) -> str:
        """Describes whether a grip is the cheapest at the true densities."""
        parameters = np.array([self.grips[option.grip].parameters for option in self.choice.options])
        costs = self.choice.compute_costs(parameters[:, None])
        cost = np.where(costs.feasible, costs.cost, np.inf)[:, 0]
        by_grip = {option.grip: float(each) for option, each in zip(self.choice.options, cost, strict=True)}
        unit = "N² m² s" if self.settings.cost_measure is CostMeasure.EFFORT else "J"
        return facts.describe_grip(by_grip, chosen, unit)


def _begin(name: str, setup: Setup) -> tuple[Sequence[Tool], float, tuple[Reach | Hammer, Tool] | None]:
    """Returns the objects in an observer's order, the duration of a hold, [s], and the task with its tool, if any."""
    if name in ("reach", "hammer"):
        held, tools, task = find_experiment(name).read(setup)
        return held, experience.DURATION, (task, tools[0])
    if name == "com":
        held = com.read(setup)
        learning = [held[index] for index in experience.draw_order(setup, 2, 0)]
        return [*learning, *held], com.DURATION, None
    if name == "next_lift":
        return next_lift.read(setup)[0], next_lift.DURATION, None
    return find_experiment(name).read(setup), weight.DURATION, None
