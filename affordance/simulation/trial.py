"""Runs simulated trials, each with one object and one task."""

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

# Largest number of Diagrams in a runner's cache. A Diagram takes 0.1 s to build and 2 MB of memory.
_MAX_DIAGRAMS = 8
# Longest trial, [s]; longer durations probably have the wrong unit. Simulating a second takes 0.05 s.
DURATION_MAX = 3600.0
_MEMORIES = "MaterialMemory() knows nothing yet"


class TrialRunner:
    """Runner of simulated trials with common settings.

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
        """Stores settings for all trials.

        Args:
            settings: Settings of the simulation.
            eye: Function that measures the features of an object; None for the eye of the settings.
            robot: Robot whose arm holds objects; None for the arm of the settings.
            display: Function that adds systems for visualisation to the Diagrams; None for no visualisation.

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
            seed: Seed of the learner's random draws, if it makes any. Different observers need different seeds.

        Raises:
            BadArgumentError: The seed is invalid.
        """
        return start_memory(self.settings.learner, seed)

    def get_diagram(self, tool: Tool | None = None, nail: NailPlacement | None = None) -> TrialDiagram:
        """Builds the Diagram for trials, or returns it from the cache.

        Args:
            tool: Tool whose shapes can touch a nail; None for trials without contact.
            nail: Nail and its placement, or None.
        """
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
        """Runs a trial in which an object is held in the home posture (``run``)."""
        return Observer(self, memory, duration=duration).hold(tool, seed)

    def run(self, tool: Tool, task: Task, memory: MaterialMemory, *, duration: float, seed: Seed = 0) -> TrialRecord:
        """Runs one trial with an object in the hand, starting at rest.

        Args:
            tool: Object in the hand, with its true densities.
            task: Task of the controller.
            memory: Memory at the start of the trial.
            duration: Duration of the trial, at least one sample period, [s].
            seed: Seed of all random draws: one or several integers.

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
    """Observer that holds objects in successive trials.

    All trials use one Context. Each starts from the default state, with the memory from the end of the previous
    trial.
    """

    def __init__(
        self, runner: TrialRunner, memory: MaterialMemory, *, duration: float, remembered: tuple[Colour, ...] = ()
    ) -> None:
        """Sets the initial memory, and the duration of all trials.

        Args:
            runner: Runner of the trials.
            memory: Memory before the first trial.
            duration: Duration of each trial, at least one sample period, [s].
            remembered: Colours that the memory keeps after a trial; empty for all.

        Raises:
            BadArgumentError: The memory has the wrong type, or the duration is out of bounds.
        """
        _check_duration(duration, runner.settings)
        check_kind("memory", memory, MaterialMemory, _MEMORIES)
        self._trial = runner.get_diagram()
        self._context = self._trial.diagram.CreateDefaultContext()
        self._duration = duration
        self._remembered = remembered
        self.memory = memory  # present memory

    def hold(self, tool: Tool, seed: Seed = 0) -> TrialRecord:
        """Runs a trial in which an object is held in the home posture.

        Args:
            tool: Object in the hand, with its true densities.
            seed: Seed of all random draws: one or several integers.
        """
        _check_trial(tool, self.memory)
        trial = self._trial
        simulator = trial.prepare(self._context, tool, trial.hold, self.memory, seed, self._remembered)
        record = trial.finish(simulator, tool, self._duration)
        self.memory = record.memory
        return record


@functools.lru_cache(maxsize=4)
def get_runner(settings: Settings) -> TrialRunner:
    """Returns a runner for the settings, which is cached in the process."""
    return TrialRunner(settings)


def _check_duration(duration: float, settings: Settings) -> None:
    check_number("duration", duration, settings.sample_period, DURATION_MAX, "s, with at least one sample period")


def _check_trial(tool: Tool, memory: MaterialMemory) -> None:
    check_kind("tool", tool, Tool, "load_tools(PATH) reads some")
    check_kind("memory", memory, MaterialMemory, _MEMORIES)
