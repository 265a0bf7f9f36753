"""The Diagram of a trial: the paper's figure 2, and the only place that connects ports.

vision --features--> visual_prior --prior--> mpc_controller --tau--> plant --> proprioception
^    `-----prior--> density_estimator <--sensation-----'
material_memory --materials--'                  |
^-------------------posterior------------'            task --goal--> mpc_controller

Where there is a nail, it is part of the plant, and what the wood does to it is a system of its own.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import LogVectorOutput, MatrixGain, VectorLogSink

from affordance.control.hold import Hold
from affordance.control.systems import MpcController, TaskSystem
from affordance.objects.tool import Tool
from affordance.plant.arm import Arm, add_arm, load_arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.nail import NailPlacement
from affordance.plant.nail_system import NailResistance
from affordance.plant.serial_chain import SerialChain, build_chain
from affordance.proprioception.systems import DensityEstimator, Proprioception
from affordance.settings import Settings
from affordance.vision.systems import MaterialMemorySystem, Vision, VisualPrior


class NailLogs(NamedTuple):
    """What is logged of a nail at every step of the integrator."""

    state: VectorLogSink
    acceleration: VectorLogSink
    resistance: VectorLogSink


@dataclass(frozen=True)
class TrialDiagram:
    """A built Diagram, with the handles needed to set it up and read it out.

    One serves any number of trials with tools of the same shape: what a trial changes lives in its Context. Without a
    nail ``nail_logs`` is None.
    """

    diagram: Diagram
    settings: Settings
    arm: Arm
    model: ArmModel
    chain: SerialChain
    vision: Vision
    memory: MaterialMemorySystem
    estimator: DensityEstimator
    controller: MpcController
    proprioception: Proprioception
    task: TaskSystem
    hold: Hold
    state_log: VectorLogSink
    tau_log: VectorLogSink
    nail_logs: NailLogs | None


def build_trial_diagram(
    tool: Tool, settings: Settings, nail: NailPlacement | None = None, *, has_clamp: bool = False
) -> TrialDiagram:
    """Builds the Diagram for tools of one shape.

    Args:
        tool: Gives the shape; its densities are set per trial.
        settings: What is the same in all simulations.
        nail: The nail and where it stands; None for none.
        has_clamp: Whether there is a clamp for the hand; it is open.

    Raises:
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
        BadValueError: A fault is that of a joint the arm has not.
    """
    builder = DiagramBuilder()
    arm = add_arm(builder, settings.arm, tool, nail, has_clamp)
    model = load_arm(settings.arm)
    n = arm.num_joints
    plant = arm.plant

    def add[S: System](name: str, system: S) -> S:
        builder.AddNamedSystem(name, system)
        return system

    vision = add("vision", Vision())
    memory = add("material_memory", MaterialMemorySystem())
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
        "proprioception", Proprioception(n, settings.noise, settings.sample_period, settings.faults, stuck)
    )
    estimator = add(
        "density_estimator",
        DensityEstimator(
            model,
            noise=settings.noise,
            deviation_sd=settings.prior.deviation_sd,
            sample_period=settings.sample_period,
        ),
    )

    def connect(source: System, output: str, destination: System, input: str) -> None:
        builder.Connect(source.GetOutputPort(output), destination.GetInputPort(input))

    def select_of_arm(name: str, output: str, parts: int) -> OutputPort:
        """The port of the plant, without what the nail adds to the end of each of its equal parts."""
        port: OutputPort = plant.GetOutputPort(output)
        if nail is None:
            return port
        selection = add(
            name,
            MatrixGain(np.array(np.kron(np.eye(parts), np.eye(n, plant.num_velocities())), dtype=np.float64)),
        )
        builder.Connect(port, selection.get_input_port())
        return selection.get_output_port()

    connect(vision, "features", visual_prior, "features")
    connect(memory, "materials", visual_prior, "materials")
    connect(visual_prior, "prior", estimator, "prior")
    connect(estimator, "posterior", memory, "posterior")
    if settings.uses_posterior:
        connect(estimator, "posterior", controller, "belief")
    else:
        connect(visual_prior, "prior", controller, "belief")
    connect(task, "goal", controller, "goal")
    state = select_of_arm("arm_state", "state", 2)
    builder.Connect(state, controller.GetInputPort("state"))
    connect(controller, "tau", plant, "actuation")
    builder.Connect(state, proprioception.GetInputPort("state"))
    connect(plant, "net_actuation", proprioception, "tau")
    vdot = select_of_arm("arm_acceleration", "generalized_acceleration", 1)
    builder.Connect(vdot, proprioception.GetInputPort("vdot"))
    connect(proprioception, "measurement", estimator, "measurement")

    nail_logs = None
    if nail is not None and arm.nail is not None:
        resistance = add(
            "nail_resistance",
            NailResistance(nail.nail, num_velocities=plant.num_velocities(), index=arm.nail.velocity_start()),
        )
        connect(plant, "nail_state", resistance, "state")
        connect(resistance, "force", plant, "applied_generalized_force")
        sources = {
            "nail_state": plant.GetOutputPort("nail_state"),
            "nail_acceleration": plant.GetOutputPort("nail_generalized_acceleration"),
            "nail_resistance": resistance.GetOutputPort("resistance"),
        }
        nail_logs = NailLogs(*(_log(builder, port, f"{name}_log") for name, port in sources.items()))
    state_log = LogVectorOutput(state, builder, settings.log_period)
    state_log.set_name("state_log")
    tau_log = LogVectorOutput(plant.GetOutputPort("net_actuation"), builder, settings.log_period)
    tau_log.set_name("tau_log")
    diagram = builder.Build()
    diagram.set_name("visual_inertial_affordances")
    return TrialDiagram(
        diagram,
        settings,
        arm,
        ArmModel(model),
        build_chain(model),
        vision,
        memory,
        estimator,
        controller,
        proprioception,
        task,
        Hold(arm.home),
        state_log,
        tau_log,
        nail_logs,
    )


def _log(builder: DiagramBuilder, port: OutputPort, name: str) -> VectorLogSink:
    """Logs a port at every step of the integrator."""
    log = LogVectorOutput(port, builder)
    log.set_name(name)
    return log
