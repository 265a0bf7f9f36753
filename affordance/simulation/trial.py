"""Trial: one object, one task, one presentation in the Diagram."""

import functools
import logging
from collections import OrderedDict
from dataclasses import replace

import numpy as np

from affordance.arguments import Seed, check_kind, check_number
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.control.task import Task
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.plant.nail import NailPlacement
from affordance.plant.serial_chain import ArmOwner
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.diagram import Display, TrialDiagram
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.eye import Eye

_LOG = logging.getLogger(__name__)

# Number of Diagrams in a runner's cache, enough for a task or two. A Diagram takes 0.1 s to build and 2 MB of memory.
_MAX_DIAGRAMS = 8
# Longest presentation, [s]; a longer one is probably in the wrong unit. Simulating a second takes 0.05 s.
DURATION_MAX = 3600.0
_MEMORIES = "MaterialMemory() knows nothing yet"


class TrialRunner:
    """Runner of trials, which reuses recent Diagrams with new Contexts.

    Example:
        >>> from affordance import MODELS, TrialRunner, load_tools
        >>> rod, *_ = load_tools(MODELS / "tools" / "weight.yaml")
        >>> runner = TrialRunner()
        >>> record = runner.run_hold(rod, runner.start_memory(), duration=1.0, seed=1)
        >>> record.memory.density("brass").sd < runner.settings.prior.sd
        True
    """

    def __init__(
        self,
        settings: Settings = DEFAULT_SETTINGS,
        eye: Eye | None = None,
        *,
        robot: ArmOwner | None = None,
        display: Display | None = None,
    ) -> None:
        """Stores the settings, eye and robot that all trials share.

        Args:
            settings: Settings of all simulations.
            eye: Function that measures the features of an object; None for the eye of the settings.
            robot: Robot whose arm holds objects; None for the arm of the settings.
            display: Function that adds systems to the Diagrams that show the plant; None to show nothing.

        Raises:
            BadArgumentError: The settings are not a Settings object, or the robot has no arm.
        """
        self._eye, self._display = eye, display
        self.settings = check_kind("settings", settings, Settings, "Settings(...) makes them")
        if robot is not None:
            robot = check_kind("robot", robot, ArmOwner, "such as Robot.load(FOLDER)")
            self.settings = replace(settings, arm=robot.directives)
        self._diagrams: OrderedDict[tuple[object, ...], TrialDiagram] = OrderedDict()

    @functools.cached_property
    def gravity(self) -> float:
        """Gravitational acceleration in the arm's model, [m/s^2]."""
        return float(np.linalg.norm(ArmModel(load_arm(self.settings.arm)).gravity))

    def start_memory(self, seed: Seed = 0) -> MaterialMemory:
        """Returns the initial memory of an observer with the learner of the settings.

        Args:
            seed: Seed of the learner's random draws, if it makes any; different for each observer.

        Raises:
            BadArgumentError: The seed is invalid.
        """
        return start_memory(self.settings.learner, seed)

    def get_diagram(self, tool: Tool | None = None, nail: NailPlacement | None = None) -> TrialDiagram:
        """Returns the Diagram of presentations, with tool shapes and nail if given."""
        shapes = () if tool is None else tool.appearance
        placement = () if nail is None else nail.key
        key = (*shapes, *placement)
        if key not in self._diagrams:
            self._diagrams[key] = TrialDiagram(
                self.settings, tool=tool, nail=nail, eye=self._eye, display=self._display
            )
            if len(self._diagrams) > _MAX_DIAGRAMS:
                self._diagrams.popitem(last=False)
        self._diagrams.move_to_end(key)
        return self._diagrams[key]

    def run_hold(self, tool: Tool, memory: MaterialMemory, *, duration: float, seed: Seed = 0) -> TrialRecord:
        """Runs a trial in which an object is held in the home posture, without contact; see ``run``."""
        return Observer(self, memory, duration=duration).hold(tool, seed)

    def run(self, tool: Tool, task: Task, memory: MaterialMemory, *, duration: float, seed: Seed = 0) -> TrialRecord:
        """Runs one trial with an object in the hand, starting at rest.

        Args:
            tool: Object in the hand; the plant has its true densities.
            task: Task that is done with it.
            memory: Belief about materials at the start of the trial.
            duration: Duration of the trial, at least one sample period, [s].
            seed: Seed of all random draws of the trial: a whole number, or several.

        Returns: Record of the trial.

        Raises:
            BadArgumentError: An argument has the wrong type or is out of bounds.
        """
        _check_duration(duration, self.settings)
        _check_trial(tool, memory)
        check_kind("task", task, Task)
        trial = self.get_diagram(tool)
        simulator = trial.prepare(trial.diagram.CreateDefaultContext(), tool, task, memory, seed)
        return trial.finish(simulator, tool, duration)


class Observer:
    """Observer that holds objects, one after the other.

    All presentations run in one Context. Each starts from the default state, except for the memory, which has learned
    at the end of the previous presentation.
    """

    def __init__(
        self, runner: TrialRunner, memory: MaterialMemory, *, duration: float, remembered: tuple[Colour, ...] = ()
    ) -> None:
        """Sets the memory before the first presentation, and the duration of every presentation.

        Args:
            runner: Runner of the trials.
            memory: Belief about materials before the first presentation.
            duration: Duration of a presentation, at least one sample period, [s].
            remembered: Colours that the memory keeps after a presentation; empty for all.

        Raises:
            BadArgumentError: If the memory has the wrong type, or the duration is out of bounds.
        """
        _check_duration(duration, runner.settings)
        check_kind("memory", memory, MaterialMemory, _MEMORIES)
        self._trial = runner.get_diagram()
        self._context = self._trial.diagram.CreateDefaultContext()
        self._duration = duration
        self._remembered = remembered
        self.memory = memory  # present belief about materials

    def hold(self, tool: Tool, seed: Seed = 0) -> TrialRecord:
        """Runs a trial in which an object is held in the home posture. The seed determines all random draws."""
        _check_trial(tool, self.memory)
        trial = self._trial
        simulator = trial.prepare(self._context, tool, trial.hold, self.memory, seed, self._remembered)
        record = trial.finish(simulator, tool, self._duration)
        self.memory = record.memory
        return record


@functools.lru_cache(maxsize=4)
def get_runner(settings: Settings) -> TrialRunner:
    """Returns this process's runner for the settings."""
    return TrialRunner(settings)


def _check_duration(duration: float, settings: Settings) -> None:
    check_number("duration", duration, settings.sample_period, DURATION_MAX, "s, with at least one sample period")


def _check_trial(tool: Tool, memory: MaterialMemory) -> None:
    check_kind("tool", tool, Tool, "load_tools(PATH) reads some")
    check_kind("memory", memory, MaterialMemory, _MEMORIES)
