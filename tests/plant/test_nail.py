"""The nail, its resistance, and a mass that drives it."""

import dataclasses

import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, CoulombFriction
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from affordance.choice.hammer import load_hammer
from affordance.files.model_folder import MODELS
from affordance.plant.contact import CONTACT_STIFFNESS
from affordance.plant.nail import NailPlacement, NailRecord, NailResistance, add_nail

DOWN = np.array([0.0, 0.0, -1.0])


@pytest.fixture(scope="module")
def nail():
    return load_hammer(MODELS / "nail.yaml").nail


def drive(nail, mass, speed, duration, accuracy=1e-5):
    """Lets a block fall on the nail with a speed; returns times, state and resistance at every step."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    instance = plant.AddModelInstance("ram")
    ram = plant.AddRigidBody("ram", instance, SpatialInertia.SolidCubeWithDensity(mass / 0.05**3, 0.05))
    slide = plant.AddJoint(PrismaticJoint("slide", plant.world_frame(), ram.body_frame(), [0.0, 0.0, 1.0]))
    plant.RegisterCollisionGeometry(ram, RigidTransform(), Box(0.05, 0.05, 0.05), "ram", CoulombFriction(0.5, 0.5))
    joint = add_nail(plant, NailPlacement(nail, np.array([0.0, 0.0, -0.026]), DOWN))
    plant.set_contact_model(ContactModel.kPoint)
    plant.Finalize()
    wood = builder.AddSystem(
        NailResistance(nail, num_velocities=plant.num_velocities(), index=joint.velocity_start())
    )
    builder.Connect(plant.GetOutputPort("nail_state"), wood.GetInputPort("state"))
    builder.Connect(wood.GetOutputPort("force"), plant.GetInputPort("applied_generalized_force"))
    state_log = LogVectorOutput(plant.GetOutputPort("nail_state"), builder)
    force_log = LogVectorOutput(wood.GetOutputPort("resistance"), builder)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    slide.set_translation_rate(plant.GetMyMutableContextFromRoot(context), -speed)
    simulator = Simulator(diagram, context)
    config = SimulatorConfig(
        integration_scheme="implicit_euler", accuracy=accuracy, max_step_size=5e-5, use_error_control=True
    )
    ApplySimulatorConfig(config, simulator)
    simulator.AdvanceTo(duration)
    log = force_log.FindLog(context)
    return np.array(log.sample_times()), np.array(state_log.FindLog(context).data()), np.array(log.data())[0]


def test_numbers_follow_from_nail_and_wood(nail):
    # 54.12 x 0.48^2.5 x 2.87 mm = 24.8 N/mm; six diameters of 2.87 mm.
    assert nail.stiffness == pytest.approx(24.8e3, rel=1e-3)
    assert nail.force_demanded == pytest.approx(427, rel=1e-3)
    assert 0.002 < nail.mass < 0.005


def test_tip_speed_is_that_of_the_energy_lost_to_friction_and_stored_in_the_contact(nail):
    """Kinetic energy is the work of the nail's resistance from the set to the demanded depth, integrated numerically.

    The work of the contact's force from zero to the same peak is added.
    """
    depths = np.linspace(nail.depth_set, nail.depth_demanded, 10_001)
    work = np.trapezoid(nail.stiffness * depths, depths)
    given_way = np.linspace(0.0, nail.force_demanded / CONTACT_STIFFNESS, 10_001)
    work += np.trapezoid(CONTACT_STIFFNESS * given_way, given_way)
    masses = np.array([0.3, 0.6])
    speeds = nail.compute_tip_speed(np.array(nail.force_demanded), masses)
    np.testing.assert_allclose(0.5 * masses * speeds**2, work, rtol=1e-8)


def test_force_below_that_of_the_set_nail_needs_no_speed(nail):
    assert nail.compute_tip_speed(np.array(0.5 * nail.stiffness * nail.depth_set), np.array(0.5)) == 0.0


@pytest.mark.parametrize("mass", [0.2, 0.6, 1.5])
def test_free_mass_meets_the_demanded_peak(nail, mass):
    """A free mass meets the demanded peak to 1 %, apart from the share that a nail of a few grams has in its mass."""
    speed = float(nail.compute_tip_speed(np.array(nail.force_demanded), np.array(mass)))
    _, states, resistance = drive(nail, mass, speed, 0.03)
    assert resistance.max() == pytest.approx(nail.force_demanded, rel=nail.mass / mass + 0.01)
    assert states[0, -1] == pytest.approx(nail.depth_demanded - nail.depth_set, rel=0.05)


def test_nail_goes_in_and_stays_in(nail):
    times, states, _ = drive(nail, 0.6, 3.0, 0.1)
    travel = states[0]
    assert (np.diff(travel) > -1e-9).all()  # no rebound
    assert travel[-1] > 0.005
    after = travel[times > 0.05]
    assert np.ptp(after) < 1e-6


def test_momentum_of_the_ram_is_the_impulse_of_the_resistance(nail):
    """Momentum of the ram is the impulse to 12 %, its rebound and the nail's share at first touch."""
    mass, speed = 0.6, 3.0
    times, _, resistance = drive(nail, mass, speed, 0.03)
    impulse = np.trapezoid(resistance, times)
    assert impulse == pytest.approx(mass * speed, rel=0.12)


@pytest.mark.parametrize("yield_force", [None, 300.0])
def test_resistance_opposes_motion_either_way_until_the_nail_is_out(nail, yield_force):
    """Resistance grows with depth, or is the same at any depth for a yielding nail."""
    system = NailResistance(dataclasses.replace(nail, yield_force=yield_force), num_velocities=3, index=1)
    context = system.CreateDefaultContext()
    for travel, rate in ((0.01, 1.0), (0.02, 1.0), (0.01, -1.0), (0.01, 0.0), (-2.0 * nail.depth_set, -1.0)):
        system.GetInputPort("state").FixValue(context, [travel, rate])
        depth = nail.depth_set + travel
        resistance = (yield_force or nail.stiffness * depth) if depth > 0.0 else 0.0
        expected = np.sign(rate) * resistance
        assert system.GetOutputPort("resistance").Eval(context)[0] == pytest.approx(expected, rel=1e-9)
        np.testing.assert_allclose(system.GetOutputPort("force").Eval(context), [0.0, -expected, 0.0], rtol=1e-9)


def test_nail_is_at_rest_when_it_has_come_its_way(nail):
    times = np.linspace(0.0, 0.1, 1001)
    travel = np.clip((times - 0.05) / 0.02, 0.0, 1.0) * 0.01
    contact = np.where((times > 0.05) & (times < 0.07), 300.0, 0.0)
    record = NailRecord(times, travel, np.gradient(travel, times), contact, contact)
    assert record.time_of_touch == pytest.approx(0.05, abs=2e-4)
    assert record.time_of_rest == pytest.approx(0.07, abs=2e-4)


def test_nail_weighs_what_shank_and_head_weigh(nail):
    """Mass of the nail is that of Drake's own cylinder and ball."""
    shank = SpatialInertia.SolidCylinderWithDensity(nail.density, nail.diameter / 2.0, nail.length, [0.0, 0.0, 1.0])
    head = SpatialInertia.SolidSphereWithDensity(nail.density, nail.head_radius)
    assert nail.mass == pytest.approx(shank.get_mass() + head.get_mass(), rel=1e-12)
