"""Builds the Diagram of a presentation, the paper's figure 2; no other module connects ports.

feature_sensor --features--> visual_prior --prior--> mpc_controller --tau--> plant --> proprioception
                             ^    `-----prior--> density_estimator <--measurement-----'
material_memory --materials--'                     |
^--------------posterior, p_value------------------'     task --goal--> mpc_controller

The Diagram's outputs are features, measurement and posterior, so that it can be part of a larger Diagram with other
systems. The posterior is logged during the trial if the settings give it a log period. Contact needs shapes, so there
is a scene graph only if a tool is given. A nail is part of the plant; the resistance of the wood is a separate
system.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import SimulatorConfig
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import LogVectorOutput, MatrixGain, VectorLogSink

from affordance.belief.material_memory import MaterialMemory
from affordance.control.hold import Hold
from affordance.control.systems import MpcController, TaskSystem
from affordance.objects.tool import Tool
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel, compute_stiffness
from affordance.plant.chain_plant import build_chain
from affordance.plant.load import add_arm, load_arm
from affordance.plant.nail import NailPlacement, NailResistance
from affordance.plant.serial_chain import SerialChain
from affordance.proprioception.outlier_check import OUTLIER_P_VALUE
from affordance.proprioception.systems import DensityEstimator, Proprioception
from affordance.settings import Settings
from affordance.simulation.posterior_log import PosteriorLog
from affordance.vision.eye import Eye, observe
from affordance.vision.systems import FeatureSensor, MaterialMemorySystem, VisualPrior

# Presentations end a nanosecond late, [s]: Drake rounds the times of periodic events, sometimes to after the end
# (0.1 + 29 x 0.1 > 3), and the last sample must be taken before the memory learns.
END_MARGIN = 1e-9


# Function that adds systems to a Diagram that show the plant and the belief, given the belief's port.
type Display = Callable[[DiagramBuilder, MultibodyPlant, OutputPort], None]


class NailLogs(NamedTuple):
    """Logs of a nail for every step of the integrator."""

    state: VectorLogSink
    acceleration: VectorLogSink
    resistance: VectorLogSink


@dataclass(frozen=True)
class TrialDiagram:
    """Diagram of a presentation, with handles to set it up and to read its results.

    One instance serves any number of presentations, whose state is in the Context. ``posterior_log`` is None unless
    the settings give it a log period, ``nail_logs`` unless there is a nail. The arm is stiff if damping stops a joint
    within a control period.
    """

    diagram: Diagram
    settings: Settings
    eye: Eye
    duration: float
    arm: Arm
    model: ArmModel
    chain: SerialChain
    feature_sensor: FeatureSensor
    memory: MaterialMemorySystem
    estimator: DensityEstimator
    controller: MpcController
    proprioception: Proprioception
    task: TaskSystem
    hold: Hold
    state_log: VectorLogSink
    tau_log: VectorLogSink
    posterior_log: PosteriorLog | None
    nail_logs: NailLogs | None
    is_stiff: bool

    @property
    def simulator(self) -> SimulatorConfig:
        """Drake's simulator configuration for this arm."""
        return self.settings.integrator.stiff if self.is_stiff else self.settings.integrator.free


def build_trial_diagram(
    settings: Settings,
    duration: float,
    *,
    tool: Tool | None = None,
    nail: NailPlacement | None = None,
    has_clamp: bool = False,
    eye: Eye | None = None,
    display: Display | None = None,
) -> TrialDiagram:
    """Builds the Diagram for presentations of a duration, [s], at the end of which the memory learns.

    Args:
        settings: Settings of the simulation.
        duration: Duration of a presentation, [s].
        tool: Tool whose shapes can touch a nail; None if nothing is in contact, as when an object is only held.
        nail: Nail and its placement, if any.
        has_clamp: True to add a clamp for the hand, which is open at first.
        eye: Function that gives the features of an object; None for that of the settings.
        display: Function that adds systems that show the plant, if any.

    Raises:
        ModelFileError: If the arm is unsuitable.
        BadValueError: If a fault is that of a joint which the arm does not have.
    """
    builder = DiagramBuilder()
    arm = add_arm(builder, settings.arm, tool, nail, has_clamp=has_clamp)
    model = load_arm(settings.arm)
    n = arm.num_joints
    plant = arm.plant

    def add[S: System](name: str, system: S) -> S:
        builder.AddNamedSystem(name, system)
        return system

    end = duration + END_MARGIN
    sensor = add("feature_sensor", FeatureSensor())
    least_p_value = 0.0 if settings.learns_from_outliers else OUTLIER_P_VALUE
    memory = add("material_memory", MaterialMemorySystem(MaterialMemory(), duration=end, least_p_value=least_p_value))
    visual_prior = add("visual_prior", VisualPrior(settings.prior))
    task = add("task", TaskSystem())
    controller = add(
        "mpc_controller",
        MpcController(
            model,
            settings=settings.mpc,
            control_period=settings.control_period,
            point_estimate=settings.point_estimate,
            angle_margin=settings.angle_margin,
        ),
    )
    stuck = settings.faults.find_stuck(arm.joint_names)
    proprioception = add(
        "proprioception",
        Proprioception(n, settings.noise, settings.sample_period, settings.faults, stuck, settings.acceleration_sd),
    )
    estimator = add(
        "density_estimator",
        DensityEstimator(
            model,
            noise=settings.noise,
            deviation=settings.prior.deviation,
            sample_period=settings.sample_period,
            duration=end,
        ),
    )

    def connect(source: System, output: str, destination: System, input: str) -> None:
        builder.Connect(source.GetOutputPort(output), destination.GetInputPort(input))

    connect(sensor, "features", visual_prior, "features")
    connect(memory, "materials", visual_prior, "materials")
    connect(visual_prior, "prior", estimator, "prior")
    connect(estimator, "posterior", memory, "posterior")
    connect(estimator, "p_value", memory, "p_value")
    if settings.uses_posterior:
        connect(estimator, "posterior", controller, "belief")
    else:
        connect(visual_prior, "prior", controller, "belief")
    connect(task, "goal", controller, "goal")
    state = _select_arm(builder, "arm_state", plant, "state", num_joints=n, parts=2)
    builder.Connect(state, controller.GetInputPort("state"))
    connect(controller, "tau", plant, "actuation")
    builder.Connect(state, proprioception.GetInputPort("state"))
    connect(plant, "net_actuation", proprioception, "tau")
    vdot = _select_arm(builder, "arm_acceleration", plant, "generalized_acceleration", num_joints=n, parts=1)
    builder.Connect(vdot, proprioception.GetInputPort("vdot"))
    connect(proprioception, "measurement", estimator, "measurement")
    for source, output in ((sensor, "features"), (proprioception, "measurement"), (estimator, "posterior")):
        builder.ExportOutput(source.GetOutputPort(output), output)  # for user-defined systems

    posterior_log = None
    if settings.posterior_log_period is not None:
        posterior_log = add("posterior_log", PosteriorLog(settings.posterior_log_period, end))
        connect(estimator, "posterior", posterior_log, "posterior")
    nail_logs = None if nail is None else _add_nail_resistance(builder, arm, nail)
    state_log = _log(builder, state, "state_log", settings.log_period)
    tau_log = _log(builder, plant.GetOutputPort("net_actuation"), "tau_log", settings.log_period)
    if display is not None:
        display(builder, plant, estimator.GetOutputPort("posterior"))
    diagram = builder.Build()
    diagram.set_name("visual_inertial_affordances")
    return TrialDiagram(
        diagram=diagram,
        settings=settings,
        eye=eye or (lambda tool, rng: observe(tool, settings.feature_source, settings.vision_error, rng)),
        duration=duration,
        arm=arm,
        model=ArmModel(model),
        chain=build_chain(model),
        feature_sensor=sensor,
        memory=memory,
        estimator=estimator,
        controller=controller,
        proprioception=proprioception,
        task=task,
        hold=Hold(arm.home),
        state_log=state_log,
        tau_log=tau_log,
        posterior_log=posterior_log,
        nail_logs=nail_logs,
        is_stiff=compute_stiffness(model, settings.control_period) > 1.0,
    )


def _select_arm(
    builder: DiagramBuilder, name: str, plant: MultibodyPlant, output: str, *, num_joints: int, parts: int
) -> OutputPort:
    """Selects the arm's entries from a port of the plant that consists of ``parts`` equal parts.

    The nail's entries are at the end of each part.
    """
    port: OutputPort = plant.GetOutputPort(output)
    if plant.num_velocities() == num_joints:
        return port
    rows = np.array(np.kron(np.eye(parts), np.eye(num_joints, plant.num_velocities())), dtype=np.float64)
    selection = builder.AddNamedSystem(name, MatrixGain(rows))
    builder.Connect(port, selection.get_input_port())
    return selection.get_output_port()


def _add_nail_resistance(builder: DiagramBuilder, arm: Arm, nail: NailPlacement) -> NailLogs:
    """Adds the resistance of the wood, and the logs of the nail."""
    plant = arm.plant
    assert arm.nail is not None  # add_arm was given a nail
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
    """Logs a port with a period, [s], or at every step of the integrator."""
    log = LogVectorOutput(port, builder) if period is None else LogVectorOutput(port, builder, period)
    log.set_name(name)
    return log
