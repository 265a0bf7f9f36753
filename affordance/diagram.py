"""The Diagram of a trial: the paper's figure 2, and the only place that connects ports.

vision --features--> visual_prior --prior--> mpc_controller --tau--> plant --> proprioception
^    `-----prior--> density_estimator <--sensation-----'
material_memory --materials--'                  |
^-------------------posterior------------'            task --goal--> mpc_controller
"""

from dataclasses import dataclass

from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from affordance.arm import Arm, ArmModel, add_arm, load_arm
from affordance.kinematics import SerialChain, build_chain
from affordance.settings import Settings
from affordance.systems.density_estimator import DensityEstimator
from affordance.systems.material_memory import MaterialMemorySystem
from affordance.systems.mpc_controller import MpcController
from affordance.systems.proprioception import Proprioception
from affordance.systems.task import TaskSystem
from affordance.systems.vision import Vision
from affordance.systems.visual_prior import VisualPrior
from affordance.tasks.hold import Hold
from affordance.tools import Tool


@dataclass(frozen=True)
class TrialDiagram:
    """A built Diagram, with the handles needed to set it up and read it out.

    One serves any number of trials with tools of the same shape: what a trial changes lives in its Context.
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


def build_trial_diagram(tool: Tool, settings: Settings) -> TrialDiagram:
    """Builds the Diagram for tools of one shape.

    Args:
        tool: Gives the shape; its densities are set per trial.
        settings: What is the same in all simulations.

    Raises:
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    builder = DiagramBuilder()
    arm = add_arm(builder, settings.arm, tool)
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
        "mpc_controller", MpcController(model, settings=settings.mpc, tick=settings.tick, point=settings.point)
    )
    proprioception = add("proprioception", Proprioception(n, settings.noise, settings.sample_period))
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

    connect(vision, "features", visual_prior, "features")
    connect(memory, "materials", visual_prior, "materials")
    connect(visual_prior, "prior", estimator, "prior")
    connect(estimator, "posterior", memory, "posterior")
    if settings.uses_posterior:
        connect(estimator, "posterior", controller, "belief")
    else:
        connect(visual_prior, "prior", controller, "belief")
    connect(task, "goal", controller, "goal")
    connect(plant, "state", controller, "state")
    connect(controller, "tau", plant, "actuation")
    connect(plant, "state", proprioception, "state")
    connect(plant, "net_actuation", proprioception, "tau")
    connect(plant, "generalized_acceleration", proprioception, "vdot")
    connect(proprioception, "sensation", estimator, "sensation")

    state_log = LogVectorOutput(plant.GetOutputPort("state"), builder, settings.log_period)
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
        build_chain(arm),
        vision,
        memory,
        estimator,
        controller,
        proprioception,
        task,
        Hold(arm.home),
        state_log,
        tau_log,
    )
