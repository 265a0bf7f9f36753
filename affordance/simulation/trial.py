"""One trial: one object, one task, one run of the Diagram."""

import functools
import logging
from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig, SimulatorStatus
from pydrake.systems.framework import Context

from affordance.arrays import Array
from affordance.belief.memory import Memory
from affordance.control.strike import Strike
from affordance.control.systems import ControlCounts
from affordance.control.task import Task
from affordance.objects.tool import Tool
from affordance.plant.nail import NailPlacement
from affordance.proprioception.systems import SampleCounts
from affordance.settings import Settings
from affordance.simulation.blow_trial import BlowMonitor, NailRecord, read_nail_record
from affordance.simulation.diagram import TrialDiagram, build_trial_diagram
from affordance.vision.observe import observe

_LOG = logging.getLogger(__name__)

# A trial less probable than this, given what was believed before it, is grossly surprising: five standard deviations,
# as physics asks of a discovery (one-sided).
SURPRISE = 2.87e-7


# Drake rounds the times of periodic events, some of them to beyond the end of a trial: 0.1 + 29 x 0.1 > 3, [s].
_ROUNDING = 1e-9


class TrialRecord(NamedTuple):
    """What happened in a trial of N logged times.

    Attributes:
        times: (N,), [s].
        q: Joint angles, (N, num_joints), [rad].
        v: Joint rates, (N, num_joints), [rad/s].
        tau: Torques over the tick that ends at each time (zero at t = 0), (N, num_joints), [N m].
        height_centre: Height of the tool's geometric centre above where it was at t = 0, (N,), [m].
        height_grip: The same of the grip To, (N,), [m].
        height_com: The same of the true centre of mass, (N,), [m].
        memory: What is believed of all materials after the trial.
        log_evidence: Log probability of what was felt, before it was felt.
        counts: How many ticks of the controller were limited, and failed.
        p_value: Probability of evidence as low as this, under what was believed before the trial.
        samples: How many samples of what was felt were refused, and why, and how many taken.
    """

    times: Array
    q: Array
    v: Array
    tau: Array
    height_centre: Array
    height_grip: Array
    height_com: Array
    memory: Memory
    log_evidence: float
    counts: ControlCounts
    p_value: float = 1.0
    samples: SampleCounts = SampleCounts(0, 0, 0, 0)

    @property
    def surprising(self) -> bool:
        """Whether the trial is grossly surprising: a decoy, a broken sensor, or a wrong model."""
        return self.p_value < SURPRISE


class TrialRunner:
    """Runs trials, building one Diagram per appearance of a tool and reusing it with fresh Contexts."""

    def __init__(self, settings: Settings) -> None:
        """Takes what all trials share."""
        self.settings = settings
        self._diagrams: dict[tuple[object, ...], TrialDiagram] = {}

    def get_diagram(self, tool: Tool, nail: NailPlacement | None = None, *, has_clamp: bool = False) -> TrialDiagram:
        """Returns the Diagram for tools that look like this one, and for nail and clamp; built at first use."""
        placement = () if nail is None else (nail.nail, nail.p_WNo.tobytes(), nail.direction_W.tobytes())
        key = (*tool.appearance, *placement, has_clamp)
        if key not in self._diagrams:
            self._diagrams[key] = build_trial_diagram(tool, self.settings, nail, has_clamp=has_clamp)
        return self._diagrams[key]

    def run_hold(self, tool: Tool, memory: Memory, *, duration: float, seed: tuple[int, ...]) -> TrialRecord:
        """Holds an object in the arm's home posture; arguments and result are those of ``run``."""
        return self.run(tool, self.get_diagram(tool).hold, memory, duration=duration, seed=seed)

    def run(self, tool: Tool, task: Task, memory: Memory, *, duration: float, seed: tuple[int, ...]) -> TrialRecord:
        """Runs one trial, from rest in the arm's home posture and with the object attached.

        Args:
            tool: The object; its true densities act in the plant.
            task: What is to be done with it.
            memory: What is believed of materials when the trial begins.
            duration: How long it lasts, [s].
            seed: Determines every random draw of the trial.

        Returns: What happened.
        """
        trial = self.get_diagram(tool)
        simulator = self.prepare(trial, tool, task, memory, seed)
        simulator.AdvanceTo(duration + _ROUNDING)
        simulator.AdvancePendingEvents()
        return read_record(trial, simulator.get_mutable_context(), tool)

    def run_blow(
        self, tool: Tool, strike: Strike, memory: Memory, *, seed: tuple[int, ...]
    ) -> tuple[TrialRecord, NailRecord]:
        """Strikes a nail and comes to rest again; arguments are those of ``run``.

        Raises:
            StallError: The integrator takes too many steps.
        """
        trial = self.get_diagram(tool, strike.placement)
        simulator = self.prepare(trial, tool, strike, memory, seed)
        watch = BlowMonitor(trial.arm.plant, tool.name)
        simulator.set_monitor(watch)
        touch, leave = strike.contact
        duration = strike.compute_duration(self.settings.mpc.horizon)
        _advance(simulator, self.settings.simulator, touch)
        _advance(simulator, self.settings.contact_simulator, leave)
        # A tool that catches at the nail on its way back stalls the integrator of a free arm (0013).
        watch.stops_at_touch = True
        end = duration + _ROUNDING
        if not _advance(simulator, self.settings.simulator, end):
            watch.stops_at_touch = False
            _advance(simulator, self.settings.second_touch_simulator, end)
        simulator.AdvancePendingEvents()
        context = simulator.get_mutable_context()
        return read_record(trial, context, tool), read_nail_record(trial, context, strike.placement)

    def prepare(
        self, trial: TrialDiagram, tool: Tool, task: Task, memory: Memory, seed: tuple[int, ...]
    ) -> Simulator:
        """Sets a trial up, ready to be advanced; arguments are those of ``run``, with the Diagram of the tool."""
        context = trial.diagram.CreateDefaultContext()
        plant_context = trial.arm.plant.GetMyMutableContextFromRoot(context)
        trial.arm.set_payload(plant_context, tool.parameters)
        self.settings.faults.change_arm(trial.arm, plant_context)
        trial.memory.set_memory(trial.memory.GetMyMutableContextFromRoot(context), memory)
        features = observe(tool, self.settings, np.random.default_rng([*seed, 0]))
        trial.vision.set_features(trial.vision.GetMyMutableContextFromRoot(context), features)
        trial.proprioception.draw_errors(trial.proprioception.GetMyMutableContextFromRoot(context), (*seed, 1))
        trial.controller.set_seed(trial.controller.GetMyMutableContextFromRoot(context), (*seed, 2))
        trial.task.set_task(trial.task.GetMyMutableContextFromRoot(context), task)

        simulator = Simulator(trial.diagram, context)
        ApplySimulatorConfig(self.settings.simulator, simulator)
        simulator.Initialize()
        return simulator


@functools.lru_cache(maxsize=4)
def get_runner(settings: Settings) -> TrialRunner:
    """Returns this process's runner for the settings."""
    return TrialRunner(settings)


def _advance(simulator: Simulator, config: SimulatorConfig, end: float) -> bool:
    """Changes the integrator and goes on until a time; returns whether no monitor ended it before."""
    config.start_time = simulator.get_context().get_time()  # or the clock would be set back
    ApplySimulatorConfig(config, simulator)
    return bool(simulator.AdvanceTo(end).reason() == SimulatorStatus.ReturnReason.kReachedBoundaryTime)


def read_record(trial: TrialDiagram, context: Context, tool: Tool) -> TrialRecord:
    """Ends a trial and reads out what happened."""
    estimator_context = trial.estimator.GetMyContextFromRoot(context)
    log_evidence: Any = trial.estimator.GetOutputPort("log_evidence").Eval(estimator_context)
    p_value: Any = trial.estimator.GetOutputPort("p_value").Eval(estimator_context)
    memory_context = trial.memory.GetMyMutableContextFromRoot(context)
    if p_value[0] >= SURPRISE or trial.settings.learns_from_surprises:
        trial.memory.learn(memory_context)
    samples = trial.estimator.get_counts(estimator_context)
    if samples.rejected:
        _LOG.info("%d of %d samples were refused: %s", samples.rejected, sum(samples), samples)
    if p_value[0] < SURPRISE:
        _LOG.info("the trial with %s is grossly surprising, p = %.1e", tool.name, p_value[0])
    log = trial.state_log.FindLog(context)
    x = log.data().T
    q, v = np.split(x, 2, axis=1)
    return TrialRecord(
        times=np.array(log.sample_times()),
        q=q,
        v=v,
        tau=np.array(trial.tau_log.FindLog(context).data().T),
        height_centre=_measure_height(trial, q, tool.p_TTcentre),
        height_grip=_measure_height(trial, q, np.zeros(3)),
        height_com=_measure_height(trial, q, tool.p_TTcm),
        memory=trial.memory.get_memory(memory_context),
        log_evidence=float(log_evidence[0]),
        counts=trial.controller.get_counts(trial.controller.GetMyContextFromRoot(context)),
        p_value=float(p_value[0]),
        samples=samples,
    )


def _measure_height(trial: TrialDiagram, q: Array, p_TQ: Array) -> Array:
    """Height of a point Q of the tool above where it was first, against gravity, (N,), [m]."""
    up = -trial.chain.gravity_W / np.linalg.norm(trial.chain.gravity_W)
    heights = trial.chain.compute_positions(q, p_TQ) @ up
    above: Array = heights - heights[0]
    return above
