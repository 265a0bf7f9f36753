"""Builds the Drake Diagram of a trial (figure 2 of the paper).

feature_sensor --features--> visual_prior --prior--> mpc_controller --tau--> plant --> proprioception
                             ^    `-----prior--> density_estimator <--tau, state, vdot----'
material_memory --materials--'                     |
^--------------posterior, p_value------------------'     task --goal--> mpc_controller

The Diagram has output ports for features, measurements and posterior, so that it can be part of a larger Diagram. It
has a scene graph only if a tool is given, because contact requires shapes. A nail is part of the plant. The
resistance of the wood is a separate system.
"""

import logging
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import LogVectorOutput, MatrixGain, VectorLogSink

from affordance.arguments import Seed, check_seed
from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.control.systems import MpcController
from affordance.control.task import Hold, Task
from affordance.drake.sampled_system import ObjectSource
from affordance.exceptions import name_object
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel, compute_stiffness
from affordance.plant.chain_plant import build_chain
from affordance.plant.load import add_arm, load_arm
from affordance.plant.nail import NailPlacement, NailRecord, NailResistance
from affordance.proprioception.outlier_check import OUTLIER_P_VALUE
from affordance.proprioception.systems import DensityEstimator, Proprioception
from affordance.runs.random_streams import Stream
from affordance.settings import Settings
from affordance.simulation.posterior_log import LoggedPosterior, PosteriorLog
from affordance.simulation.trial_record import Percept, TrialRecord
from affordance.vision.eye import Eye, observe
from affordance.vision.features import ComponentFeatures
from affordance.vision.systems import MaterialMemorySystem, VisualPrior

_LOG = logging.getLogger(__name__)

# Largest delay of an event by rounding errors, [s]. Later events do not belong to the trial.
_ROUNDING = 1e-9

# Function that adds systems for the visualisation of the plant and of the belief, given the port of the belief.
type Display = Callable[[DiagramBuilder, MultibodyPlant, OutputPort], None]


class NailLogs(NamedTuple):
    """Logs of a nail at each integrator step."""

    state: VectorLogSink
    acceleration: VectorLogSink
    resistance: VectorLogSink


class TrialDiagram:
    """Diagram of trials. All state is in the Context, so one instance can be used for many trials.

    Attributes:
        diagram: The Diagram, or a larger Diagram that contains it.
        settings: Settings of the simulation.
        arm: Simulated arm.
        model: Model of the arm for computations; it keeps the last state and payload.
        chain: Kinematic chain of the arm.
        hold: Task of holding an object in the home posture.
        is_stiff: True if damping stops a joint of the arm within a control period.
    """

    def __init__(
        self,
        settings: Settings,
        *,
        tool: Tool | None = None,
        nail: NailPlacement | None = None,
        eye: Eye | None = None,
        display: Display | None = None,
    ) -> None:
        """Builds the Diagram.

        Args:
            settings: Settings of the simulation.
            tool: Tool whose shapes can touch a nail; None for trials without contact.
            nail: Nail and its placement, or None.
            eye: Function that measures the features of an object; None for the eye of the settings.
            display: Function that adds systems for visualisation, or None.

        Raises:
            ModelFileError: The arm is unsuitable.
            BadValueError: A fault refers to an unknown joint.
        """
        builder = DiagramBuilder()
        self.settings = settings
        self._eye = eye or (lambda tool, rng: observe(tool, settings.eye, settings.vision_error, rng))
        self.arm = add_arm(builder, settings.arm, tool, nail)
        arm = load_arm(settings.arm)
        self.model, self.chain, self.hold = ArmModel(arm), build_chain(arm), Hold(self.arm.home)
        self.is_stiff = compute_stiffness(arm, settings.control_period) > 1.0
        plant = self.arm.plant

        def add[S: System](name: str, system: S) -> S:
            builder.AddNamedSystem(name, system)
            return system

        self._feature_sensor: ObjectSource[tuple[ComponentFeatures, ...]] = add(
            "feature_sensor", ObjectSource("features")
        )
        least_p_value = 0.0 if settings.learns_from_outliers else OUTLIER_P_VALUE
        self._memory = add("material_memory", MaterialMemorySystem(MaterialMemory(), least_p_value))
        visual_prior = add("visual_prior", VisualPrior(settings.prior))
        self._task: ObjectSource[Task] = add("task", ObjectSource("goal"))
        self._controller = add(
            "mpc_controller",
            MpcController(
                arm,
                settings=settings.mpc,
                control_period=settings.control_period,
                point_estimate=settings.point_estimate,
                angle_margin=settings.angle_margin,
            ),
        )
        self._proprioception = add(
            "proprioception",
            Proprioception(
                arm.num_joints,
                settings.noise,
                settings.sample_period,
                settings.faults,
                settings.faults.find_stuck(self.arm.joint_names),
                settings.acceleration_sd,
            ),
        )
        self._estimator = add(
            "density_estimator",
            DensityEstimator(
                arm,
                noise=settings.noise,
                deviation=settings.prior.deviation,
                sample_period=settings.sample_period,
            ),
        )

        def connect(source: System, output: str, destination: System, input: str) -> None:
            builder.Connect(source.GetOutputPort(output), destination.GetInputPort(input))

        connect(self._feature_sensor, "features", visual_prior, "features")
        connect(self._memory, "materials", visual_prior, "materials")
        connect(visual_prior, "prior", self._estimator, "prior")
        connect(self._estimator, "posterior", self._memory, "posterior")
        connect(self._estimator, "p_value", self._memory, "p_value")
        if settings.uses_posterior:
            connect(self._estimator, "posterior", self._controller, "belief")
        else:
            connect(visual_prior, "prior", self._controller, "belief")
        connect(self._task, "goal", self._controller, "goal")
        state, vdot = _select_arm(builder, self.arm)
        builder.Connect(state, self._controller.GetInputPort("state"))
        connect(self._controller, "tau", plant, "actuation")
        builder.Connect(state, self._proprioception.GetInputPort("state"))
        builder.Connect(vdot, self._proprioception.GetInputPort("vdot"))
        connect(plant, "net_actuation", self._proprioception, "tau")
        for name in ("tau", "state", "vdot"):
            connect(self._proprioception, f"measured_{name}", self._estimator, name)
        # Users can connect their own systems to these ports.
        builder.ExportOutput(self._feature_sensor.GetOutputPort("features"), "features")
        for felt in ("measured_tau", "measured_state", "measured_vdot"):
            builder.ExportOutput(self._proprioception.GetOutputPort(felt), felt)
        builder.ExportOutput(self._estimator.GetOutputPort("posterior"), "posterior")

        self._posterior_log = None
        if settings.posterior_log_period is not None:
            self._posterior_log = add("posterior_log", PosteriorLog(settings.posterior_log_period))
            connect(self._estimator, "posterior", self._posterior_log, "posterior")
        self._nail = nail
        self._nail_logs = None if nail is None else _add_nail_resistance(builder, self.arm, nail)
        self._state_log = _log(builder, state, "state_log", settings.log_period)
        self._tau_log = _log(builder, plant.GetOutputPort("net_actuation"), "tau_log", settings.log_period)
        if display is not None:
            display(builder, plant, self._estimator.GetOutputPort("posterior"))
        self.diagram: Diagram = builder.Build()
        self.diagram.set_name("visual_inertial_affordances")

    @property
    def integrator(self) -> SimulatorConfig:
        """Drake's simulator configuration for motions of this arm without contact."""
        return self.settings.integrator.stiff if self.is_stiff else self.settings.integrator.free

    def get_memory(self, context: Context) -> MaterialMemory:
        """Returns the memory in a Context of the Diagram."""
        return self._memory.get_memory(self._memory.GetMyContextFromRoot(context))

    def prepare(
        self,
        context: Context,
        tool: Tool,
        task: Task,
        memory: MaterialMemory,
        seed: Seed,
        remembered: tuple[Colour, ...] = (),
    ) -> Simulator:
        """Prepares a trial, and returns a simulator at its start.

        Args:
            context: New or used Context of the Diagram.
            tool: Object in the hand, with its true densities.
            task: Task of the controller.
            memory: Memory before the trial.
            seed: Seed of all random draws.
            remembered: Colours that the memory keeps after the trial; empty for all.
        """
        seed = check_seed(seed)
        self.diagram.SetDefaultContext(context)
        context.SetTime(0.0)
        for log in (self._state_log, self._tau_log, *(self._nail_logs or ())):
            log.FindMutableLog(context).Clear()
        if self._posterior_log is not None:
            self._posterior_log.find_log(self._posterior_log.GetMyMutableContextFromRoot(context)).clear()
        memory_context = self._memory.GetMyMutableContextFromRoot(context)
        self._memory.set_memory(memory_context, memory)
        self._memory.remembered.set(memory_context, remembered)
        plant_context = self.arm.plant.GetMyMutableContextFromRoot(context)
        self.arm.set_payload(plant_context, tool.parameters)
        self.settings.faults.change_arm(self.arm, plant_context)
        self.arm.set_posture(plant_context, task.q_start)
        features = self._eye(tool, np.random.default_rng([*seed, Stream.SEEING]))
        self._feature_sensor.set(self._feature_sensor.GetMyMutableContextFromRoot(context), features)
        self._task.set(self._task.GetMyMutableContextFromRoot(context), task)
        sensing, control = (*seed, int(Stream.SENSING)), (*seed, int(Stream.CONTROL))
        self._proprioception.draw_errors(self._proprioception.GetMyMutableContextFromRoot(context), sensing)
        self._controller.seed.set(self._controller.GetMyMutableContextFromRoot(context), control)
        simulator = Simulator(self.diagram, context)
        ApplySimulatorConfig(self.integrator, simulator)
        simulator.Initialize()
        return simulator

    def find_end(self, duration: float) -> float:
        """Returns the end of a trial, [s], which includes periodic events that are delayed by rounding errors.

        Drake computes the time of an event as offset + k period, and 0.1 + 29 x 0.1 > 3 in double precision.
        """
        settings = self.settings
        end = duration
        for offset, period in (
            (settings.sample_period, settings.sample_period),
            (0.0, settings.control_period),
            (0.0, settings.log_period),
        ):
            last = offset + round((duration - offset) / period) * period
            if last - duration < _ROUNDING:
                end = max(end, last)
        return end

    def finish(self, simulator: Simulator, tool: Tool, duration: float) -> TrialRecord:
        """Simulates until the end of the trial, updates the memory, and returns the record."""
        simulator.AdvanceTo(self.find_end(duration))
        simulator.AdvancePendingEvents()
        context = simulator.get_mutable_context()
        record = self._read_record(context, tool)
        # The events store the posterior in the memory (MaterialMemorySystem), and reset the estimator's statistics.
        self.diagram.ExecuteForcedEvents(context, publish=False)
        return record._replace(memory=self.get_memory(context))

    def read_nail_record(self, context: Context) -> NailRecord:
        """Returns the record of the nail, which the Diagram must have."""
        logs, placement = self._nail_logs, self._nail
        assert logs is not None
        assert placement is not None
        travel, rate = np.array(logs.state.FindLog(context).data())
        resistance = np.array(logs.resistance.FindLog(context).data())[0]
        acceleration = np.array(logs.acceleration.FindLog(context).data())[0]
        weight = placement.nail.mass * float(self.chain.gravity_W @ placement.direction_W)
        contact = placement.nail.mass * acceleration + resistance - weight
        return NailRecord(np.array(logs.state.FindLog(context).sample_times()), travel, rate, resistance, contact)

    def _read_record(self, context: Any, tool: Tool) -> TrialRecord:
        """Reads the record of a trial, without the final update of the memory."""
        estimator_context = self._estimator.GetMyContextFromRoot(context)
        inference = self._estimator.get_inference(estimator_context)
        samples = self._estimator.get_counts(estimator_context)
        posteriors: tuple[LoggedPosterior, ...] = ()
        if self._posterior_log is not None:
            now = context.get_time()
            log = self._posterior_log.find_log(self._posterior_log.GetMyMutableContextFromRoot(context))
            # The last sample is later than the last entry of the log.
            posteriors = (*(each for each in log if each.time < now), LoggedPosterior(now, inference.posterior))
        log_x = self._state_log.FindLog(context)
        times = np.array(log_x.sample_times())
        # If the integrator is changed during a trial, this time is logged twice. The last row is kept.
        rows = np.append(np.diff(times) > 0.0, True)
        x = np.array(log_x.data().T)[rows]  # a copy, because the next trial reuses the log
        q, v = np.split(x, 2, axis=1)
        percept = None
        if samples.rejected:
            _LOG.info("%d of %d samples were rejected: %s", samples.rejected, sum(samples), samples)
        if inference.p_value < OUTLIER_P_VALUE:
            _LOG.info("the trial with %s is a 5-sigma outlier, p = %.1e", tool.name, inference.p_value)
        if samples.accepted:
            statistics = self._estimator.get_statistics(estimator_context)
            percept = Percept(
                object_name=tool.name,
                features=self._feature_sensor.get(self._feature_sensor.GetMyContextFromRoot(context)),
                statistics=statistics._replace(features=np.array(statistics.features)),  # not a view of the Context
                noise=self.settings.noise,
                num_joints=self.arm.num_joints,
                arm=self.settings.arm,
            )
        height_centre, height_grip, height_com = self._measure_heights(q, [tool.p_TTcentre, np.zeros(3), tool.p_TTcm])
        return TrialRecord(
            times=times[rows],
            q=q,
            v=v,
            tau=np.array(self._tau_log.FindLog(context).data().T)[rows],
            height_centre=height_centre,
            height_grip=height_grip,
            height_com=height_com,
            memory=self.get_memory(context),
            log_evidence=inference.log_evidence,
            counts=self._controller.get_counts(self._controller.GetMyContextFromRoot(context)),
            p_value=inference.p_value,
            samples=samples,
            overloaded=self._find_overloaded(tool, q[0]),
            posteriors=posteriors,
            percept=percept,
        )

    def _find_overloaded(self, tool: Tool, q_start: Array) -> tuple[str, ...]:
        """Lists the joints that are too weak to hold arm and tool at rest, and logs a warning if there are any.

        Args:
            tool: Tool with true densities.
            q_start: Joint angles, (num_joints,), [rad].
        """
        self.model.set_payload(tool.parameters)
        self.model.set_posture(q_start)
        overloads = self.arm.find_overloads(self.model.compute_inverse_dynamics(np.zeros(len(q_start))))
        if overloads:
            texts = "; ".join(
                f"{joint} with {tau:.3g} N m, must be at most {bound:.3g}" for joint, tau, bound in overloads
            )
            _LOG.warning(
                "the arm cannot hold %s: at rest its %.3g kg load %s", name_object(tool.name), tool.mass, texts
            )
        return tuple(each.joint for each in overloads)

    def _measure_heights(self, q: Array, points: list[Array]) -> list[Array]:
        """Computes heights of tool points above their first positions, against gravity, (N,) each, [m]."""
        up = -self.chain.gravity_W / np.linalg.norm(self.chain.gravity_W)
        heights = [positions @ up for positions in self.chain.compute_positions_of(q, points)]
        return [height - height[0] for height in heights]


def _select_arm(builder: DiagramBuilder, arm: Arm) -> tuple[OutputPort, OutputPort]:
    """Returns ports for the state and accelerations of the arm's joints, without the nail."""
    plant, n = arm.plant, arm.num_joints
    state, vdot = plant.get_state_output_port(), plant.get_generalized_acceleration_output_port()
    if plant.num_velocities() == n:
        return state, vdot
    joints = [plant.get_joint_actuator(index).joint().index() for index in plant.GetJointActuatorIndices()]
    selected = []
    for name, port, rows in (
        ("arm_state", state, plant.MakeStateSelectorMatrix(joints)),
        ("arm_acceleration", vdot, np.eye(n, plant.num_velocities())),
    ):
        selection = builder.AddNamedSystem(name, MatrixGain(rows))
        builder.Connect(port, selection.get_input_port())
        selected.append(selection.get_output_port())
    return selected[0], selected[1]


def _add_nail_resistance(builder: DiagramBuilder, arm: Arm, nail: NailPlacement) -> NailLogs:
    """Adds the system for the resistance of the wood, and the logs of the nail."""
    plant = arm.plant
    assert arm.nail is not None  # add_arm has added it
    resistance = NailResistance(nail.nail, num_velocities=plant.num_velocities(), index=arm.nail.velocity_start())
    builder.AddNamedSystem("nail_resistance", resistance)
    builder.Connect(plant.GetOutputPort("nail_state"), resistance.GetInputPort("state"))
    builder.Connect(resistance.GetOutputPort("force"), plant.GetInputPort("applied_generalized_force"))
    return NailLogs(
        _log(builder, plant.GetOutputPort("nail_state"), "nail_state_log"),
        _log(builder, plant.GetOutputPort("nail_generalized_acceleration"), "nail_acceleration_log"),
        _log(builder, resistance.GetOutputPort("resistance"), "nail_resistance_log"),
    )


def _log(builder: DiagramBuilder, port: OutputPort, name: str, period: float | None = None) -> VectorLogSink:
    """Adds a log of a port with a period, [s], or at each integrator step."""
    log = LogVectorOutput(port, builder) if period is None else LogVectorOutput(port, builder, period)
    log.set_name(name)
    return log
