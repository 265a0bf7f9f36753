"""Trial: one object, one task, one presentation in the Diagram."""

import functools
import logging
from collections import OrderedDict
from dataclasses import replace

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import Context

from affordance.arguments import Seed, check_kind, check_number, check_seed
from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.control.task import Task
from affordance.exceptions import BadArgumentError, name_object
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.plant.nail import NailPlacement
from affordance.plant.serial_chain import ArmOwner
from affordance.proprioception.outlier_check import OUTLIER_P_VALUE
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.diagram import END_MARGIN, Display, TrialDiagram, build_trial_diagram
from affordance.simulation.trial_record import Percept, TrialRecord
from affordance.vision.eye import Eye

_LOG = logging.getLogger(__name__)

# Number of Diagrams in a runner's cache, enough for a task or two. A Diagram takes 0.1 s to build and 2 MB of memory.
_MAX_DIAGRAMS = 8
# Longest presentation, [s]; a longer one is probably in the wrong unit. Simulating a second takes 0.05 s.
DURATION_MAX = 3600.0
_MOST_PERIODS = 200_000  # largest number of control, sample or log periods in a presentation
_MEMORIES = "MaterialMemory() knows nothing yet"


class TrialRunner:
    """Runner of trials, which builds Diagrams at first use and reuses recent ones with new Contexts.

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
            eye: Function that gives the features of an object; None for that of the settings.
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

    def get_diagram(
        self,
        duration: float,
        tool: Tool | None = None,
        nail: NailPlacement | None = None,
        *,
        has_clamp: bool = False,
    ) -> TrialDiagram:
        """Returns the Diagram for presentations of a duration, [s], with tool shapes, nail and clamp if given."""
        shapes = () if tool is None else tool.appearance
        placement = () if nail is None else nail.key
        key = (duration, has_clamp, *shapes, *placement)
        if key not in self._diagrams:
            self._diagrams[key] = build_trial_diagram(
                self.settings,
                duration,
                tool=tool,
                nail=nail,
                has_clamp=has_clamp,
                eye=self._eye,
                display=self._display,
            )
            if len(self._diagrams) > _MAX_DIAGRAMS:
                self._diagrams.popitem(last=False)
        self._diagrams.move_to_end(key)
        return self._diagrams[key]

    def run_hold(self, tool: Tool, memory: MaterialMemory, *, duration: float, seed: Seed = 0) -> TrialRecord:
        """Runs a trial in which an object is held in the arm's home posture, without contact; see ``run``."""
        return Observer(self, memory, duration=duration).hold(tool, seed)

    def run(self, tool: Tool, task: Task, memory: MaterialMemory, *, duration: float, seed: Seed = 0) -> TrialRecord:
        """Runs one trial with the object attached to the hand, from rest at the start of the task.

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
        check_duration(duration, self.settings)
        _check_trial(tool, memory)
        check_kind("task", task, Task)
        trial = self.get_diagram(duration, tool)
        return finish(trial, self.prepare(trial, tool, task, memory, seed), tool)

    def prepare(self, trial: TrialDiagram, tool: Tool, task: Task, memory: MaterialMemory, seed: Seed) -> Simulator:
        """Sets up a trial in a new Context, ready to be advanced; arguments are those of ``run``."""
        context = trial.diagram.CreateDefaultContext()
        trial.memory.set_memory(trial.memory.GetMyMutableContextFromRoot(context), memory)
        return present(trial, context, tool, task, seed)


class Observer:
    """Observer that is given objects to hold, one after the other.

    All presentations run in one Context. Each starts from the default state, except that of the ``material_memory``,
    which the event at the end of the previous presentation has updated.
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
        check_duration(duration, runner.settings)
        check_kind("memory", memory, MaterialMemory, _MEMORIES)
        self._trial = runner.get_diagram(duration)
        self._context = self._trial.diagram.CreateDefaultContext()
        self._memory_context = self._trial.memory.GetMyMutableContextFromRoot(self._context)
        self._trial.memory.set_memory(self._memory_context, memory)
        self._trial.memory.remembered.set(self._memory_context, remembered)

    @property
    def memory(self) -> MaterialMemory:
        """Present belief about materials."""
        return self._trial.memory.get_memory(self._memory_context)

    def hold(self, tool: Tool, seed: Seed = 0) -> TrialRecord:
        """Runs a trial in which an object is held in the home posture; the seed determines all random draws."""
        _check_trial(tool, self.memory)
        trial = self._trial
        for system in trial.diagram.GetSystems():
            if system is not trial.memory:
                system.SetDefaultContext(system.GetMyMutableContextFromRoot(self._context))
        for log in (trial.state_log, trial.tau_log):
            log.FindMutableLog(self._context).Clear()
        self._context.SetTime(0.0)
        return finish(trial, present(trial, self._context, tool, trial.hold, seed), tool)


@functools.lru_cache(maxsize=4)
def get_runner(settings: Settings) -> TrialRunner:
    """Returns this process's runner for the settings."""
    return TrialRunner(settings)


def check_duration(duration: float, settings: Settings) -> None:
    """Checks the duration of a presentation, [s].

    Raises:
        BadArgumentError: If it is shorter than a sample period, so that nothing would be learned, or longer than
            DURATION_MAX or than _MOST_PERIODS control, sample or log periods, whose rows are kept in memory.
    """
    unit = "s, with at least one sample period"
    check_number("duration", duration, settings.sample_period, DURATION_MAX, unit)
    name = min(("control_period", "sample_period", "log_period"), key=lambda name: float(getattr(settings, name)))
    longest = _MOST_PERIODS * getattr(settings, name)
    if duration > longest:
        problem = f"is {duration:g} s, must be at most {longest:g} s, which are {_MOST_PERIODS} times {name}"
        raise BadArgumentError("duration", "", problem)


def _check_trial(tool: Tool, memory: MaterialMemory) -> None:
    check_kind("tool", tool, Tool, "load_tools(PATH) reads some")
    check_kind("memory", memory, MaterialMemory, _MEMORIES)


def present(trial: TrialDiagram, context: Context, tool: Tool, task: Task, seed: Seed) -> Simulator:
    """Sets up the presentation of an object in a new Context that contains the memory; ready to be advanced."""
    settings, seed = trial.settings, check_seed(seed)
    plant_context = trial.arm.plant.GetMyMutableContextFromRoot(context)
    trial.arm.set_payload(plant_context, tool.parameters)
    settings.faults.change_arm(trial.arm, plant_context)
    features = trial.eye(tool, np.random.default_rng([*seed, 0]))
    trial.feature_sensor.features.set(trial.feature_sensor.GetMyMutableContextFromRoot(context), features)
    trial.proprioception.draw_errors(trial.proprioception.GetMyMutableContextFromRoot(context), (*seed, 1))
    trial.controller.seed.set(trial.controller.GetMyMutableContextFromRoot(context), (*seed, 2))
    trial.task.task.set(trial.task.GetMyMutableContextFromRoot(context), task)
    trial.arm.set_posture(plant_context, task.q_start)
    simulator = Simulator(trial.diagram, context)
    ApplySimulatorConfig(trial.simulator, simulator)
    simulator.Initialize()
    return simulator


def finish(trial: TrialDiagram, simulator: Simulator, tool: Tool) -> TrialRecord:
    """Advances a trial to its end, when the memory learns, and reads its record."""
    simulator.AdvanceTo(trial.duration + END_MARGIN)
    simulator.AdvancePendingEvents()
    return _read_record(trial, simulator.get_context(), tool)


def _read_record(trial: TrialDiagram, context: Context, tool: Tool) -> TrialRecord:
    estimator_context = trial.estimator.GetMyContextFromRoot(context)
    log_evidence, p_value = trial.estimator.get_evidence(estimator_context)
    samples = trial.estimator.get_counts(estimator_context)
    if samples.rejected:
        _LOG.info("%d of %d samples were rejected: %s", samples.rejected, sum(samples), samples)
    if p_value < OUTLIER_P_VALUE:
        _LOG.info("the trial with %s is a 5-sigma outlier, p = %.1e", tool.name, p_value)
    posteriors = trial.posterior_log and trial.posterior_log.entries.get(
        trial.posterior_log.GetMyContextFromRoot(context)
    )
    log = trial.state_log.FindLog(context)
    times = np.array(log.sample_times())
    # If the integrator is changed during a trial, that time is logged twice, and the last row counts.
    rows = np.append(np.diff(times) > 0.0, True)
    x = np.array(log.data().T)[rows]  # a copy, because the next presentation reuses the log
    q, v = np.split(x, 2, axis=1)
    return TrialRecord(
        times=times[rows],
        q=q,
        v=v,
        tau=np.array(trial.tau_log.FindLog(context).data().T)[rows],
        height_centre=_measure_height(trial, q, tool.p_TTcentre),
        height_grip=_measure_height(trial, q, np.zeros(3)),
        height_com=_measure_height(trial, q, tool.p_TTcm),
        memory=trial.memory.get_memory(trial.memory.GetMyContextFromRoot(context)),
        log_evidence=log_evidence,
        counts=trial.controller.get_counts(trial.controller.GetMyContextFromRoot(context)),
        p_value=p_value,
        samples=samples,
        overloaded=_find_overloaded(trial, tool, q[0]),
        posteriors=posteriors or (),
        percept=_read_percept(trial, context, tool) if samples.accepted else None,
    )


def _read_percept(trial: TrialDiagram, context: Context, tool: Tool) -> Percept:
    statistics = trial.estimator.get_last_statistics(trial.estimator.GetMyContextFromRoot(context))
    return Percept(
        object_name=tool.name,
        features=trial.feature_sensor.features.get(trial.feature_sensor.GetMyContextFromRoot(context)),
        statistics=statistics._replace(features=np.array(statistics.features)),  # not a view of the Context
        noise=trial.settings.noise,
        num_joints=trial.arm.num_joints,
        arm=trial.settings.arm,
    )


def _find_overloaded(trial: TrialDiagram, tool: Tool, q_start: Array) -> tuple[str, ...]:
    """Lists the joints that are too weak to hold arm and tool at rest at q_start, (num_joints,), [rad].

    Logs a warning if there are any.
    """
    trial.model.set_payload(tool.parameters)
    trial.model.set_posture(q_start)
    overloads = trial.arm.find_overloads(trial.model.compute_inverse_dynamics(np.zeros(len(q_start))))
    if overloads:
        texts = "; ".join(
            f"{joint} with {tau:.3g} N m, must be at most {bound:.3g}" for joint, tau, bound in overloads
        )
        _LOG.warning("the arm cannot hold %s: at rest its %.3g kg load %s", name_object(tool.name), tool.mass, texts)
    return tuple(each.joint for each in overloads)


def _measure_height(trial: TrialDiagram, q: Array, p_TQ: Array) -> Array:
    """Computes the height of a point Q of the tool relative to its first position, against gravity, (N,), [m]."""
    up = -trial.chain.gravity_W / np.linalg.norm(trial.chain.gravity_W)
    heights = trial.chain.compute_positions(q, p_TQ) @ up
    above: Array = heights - heights[0]
    return above
