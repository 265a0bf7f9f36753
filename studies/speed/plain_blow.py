"""Blow without its controller: arm, tool and nail alone, fed with the recorded torques of a closed loop.

It serves where the Diagram of a trial cannot: for a discrete plant, or one with hydroelastic contact.
"""

import time
from typing import NamedTuple

import numpy as np
from pydrake.geometry import DefaultProximityProperties, SceneGraphConfig
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, EventStatus
from pydrake.systems.primitives import LogVectorOutput

from affordance.arrays import Array
from affordance.objects.tool import Tool
from affordance.plant.arm import ARM
from affordance.plant.load import attach_tool, parse_arm
from affordance.plant.nail import STICTION_TOLERANCE, NailPlacement, NailResistance, add_nail

# Modulus of both bodies, such that they approach under a blow's peak as far as with point contact. Two spheres of
# radii R_1 and R_2 resist by about pi E R_1 R_2 / (R_1 + R_2)^2 times the approach squared, [Pa].
HYDROELASTIC_MODULUS = 5e9
# Edges of the meshes, [m]: under the peak the patch is 3 mm wide; with edges of 1 mm a blow takes three times as
# long, for a peak of the resistance that differs by 0.1 %, and a peak of the contact force that differs by a quarter.
_RESOLUTION = 2e-3
# Fraction of the nail's travel up to which its impulse is counted: afterwards only the tool's weight rests on it.
_WHOLE_WAY = 0.999


class Blow(NamedTuple):
    """Measures of a blow."""

    peak: float  # peak of the resistance, [N]
    contact: float  # peak of the tool's force on the nail along its axis, [N]
    impulse: float  # impulse of the resistance, until the nail is in, [N s]
    travel: float  # travel of the nail, [m]
    steps: int  # number of the integrator's steps
    seconds: float  # wall time, [s]


class Strip(NamedTuple):
    """Part of a closed loop in which tool and nail may touch."""

    x: Array  # state of the arm at its beginning, (2 num_joints,)
    tau: Array  # torques of each of its K control periods, (K, num_joints), [N m]
    control_period: float  # control period, [s]


def measure_blow(times: Array, travel: Array, resistance: Array, contact: Array, seconds: float) -> Blow:
    """Computes the measures of a blow from the logs of every step, (N,) each."""
    driven = 1 + int(np.argmax(travel >= _WHOLE_WAY * travel.max()))
    impulse = np.trapezoid(resistance[:driven], times[:driven])
    return Blow(
        resistance.max(), contact.max(), float(impulse), float(travel[-1]), len(np.unique(times)) - 1, seconds
    )


def advance(simulator: Simulator, diagram: Diagram, end: float, patience: float) -> bool:
    """Simulates until a time; returns False if that takes longer than the patience in wall time, [s]."""
    begun = time.perf_counter()

    def lose_patience(_: Context) -> EventStatus:
        if time.perf_counter() - begun > patience:
            return EventStatus.ReachedTermination(diagram, "too slow")
        return EventStatus.DidNothing()

    simulator.set_monitor(lose_patience)
    simulator.AdvanceTo(end)
    return bool(simulator.get_context().get_time() >= end)


def free_joints(plant: MultibodyPlant) -> None:
    """Removes the joints' limits.

    A continuous plant ignores them. Discrete plants and CENIC stop a joint within a step, and throw back one that is
    beyond: the milliradians by which the controller violates limits become hundreds of rad/s.
    """
    for index in plant.GetJointActuatorIndices():
        plant.get_joint_actuator(index).joint().set_position_limits(np.array([-np.inf]), np.array([np.inf]))


class PlainBlow:
    """Plant of arm, tool and nail."""

    def __init__(
        self,
        tool: Tool,
        placement: NailPlacement,
        *,
        model: ContactModel = ContactModel.kPoint,
        time_step: float = 0.0,
    ) -> None:
        """Builds the plant, continuous if its time step is zero."""
        builder = DiagramBuilder()
        self._plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
        if model == ContactModel.kHydroelastic:
            properties = DefaultProximityProperties(
                compliance_type="compliant",
                hydroelastic_modulus=HYDROELASTIC_MODULUS,
                resolution_hint=_RESOLUTION,
            )
            scene_graph.set_config(SceneGraphConfig(default_proximity_properties=properties))
        hand = parse_arm(self._plant, ARM)
        attach_tool(self._plant, hand, tool)
        joint = add_nail(self._plant, placement)
        self._plant.set_contact_model(model)
        self._plant.Finalize()
        self._plant.set_stiction_tolerance(STICTION_TOLERANCE)
        free_joints(self._plant)
        self._arm = hand.body().model_instance()
        wood = builder.AddSystem(
            NailResistance(placement.nail, num_velocities=self._plant.num_velocities(), index=joint.velocity_start())
        )
        builder.Connect(self._plant.GetOutputPort("nail_state"), wood.GetInputPort("state"))
        builder.Connect(wood.GetOutputPort("force"), self._plant.GetInputPort("applied_generalized_force"))
        ports = (
            self._plant.GetOutputPort("nail_state"),
            wood.GetOutputPort("resistance"),
            self._plant.GetOutputPort("nail_generalized_contact_forces"),
        )
        self._logs = [LogVectorOutput(port, builder) for port in ports]
        self._diagram = builder.Build()

    def run(self, strip: Strip, config: SimulatorConfig, patience: float) -> Blow | None:
        """Simulates a blow; returns None if it takes longer than the patience, [s]."""
        context = self._diagram.CreateDefaultContext()
        plant_context = self._plant.GetMyMutableContextFromRoot(context)
        self._plant.SetPositionsAndVelocities(plant_context, self._arm, strip.x)
        simulator = Simulator(self._diagram, context)
        ApplySimulatorConfig(config, simulator)
        begun = time.perf_counter()
        for i, tau in enumerate(strip.tau):
            self._plant.get_actuation_input_port().FixValue(plant_context, tau)
            left = patience - (time.perf_counter() - begun)
            if not advance(simulator, self._diagram, (i + 1) * strip.control_period, left):
                return None
        seconds = time.perf_counter() - begun
        state, resistance, contact = (np.array(log.FindLog(context).data()) for log in self._logs)
        times = np.array(self._logs[0].FindLog(context).sample_times())
        return measure_blow(times, state[0], resistance[0], contact[0], seconds)
