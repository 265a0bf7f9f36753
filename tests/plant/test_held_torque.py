"""A torque that is held gives the mean acceleration it was computed for, however strong the damping."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

from affordance.plant.arm import ARM, Arm
from affordance.plant.arm_model import ArmModel, HeldTorqueModel, compute_stiffness
from affordance.plant.load import load_arm
from affordance.settings import Settings
from affordance.simulation.diagram import TrialDiagram

TICK = 0.005


def write_damped_arm(folder: Path, damping: dict[str, float]) -> Path:
    """Our own arm with damping in some joints."""
    text = (ARM.parent / "arm.sdf").read_text()
    for name, value in damping.items():
        start = text.index("<axis>", text.index(f'joint name="{name}"')) + len("<axis>")
        text = text[:start] + f"<dynamics><damping>{value}</damping></dynamics>" + text[start:]
    (folder / "arm.sdf").write_text(text)
    for name in (ARM.name, "package.xml"):
        (folder / name).write_text((ARM.parent / name).read_text())
    return folder / ARM.name


def simulate_tick(arm: Arm, x: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Rates after a tick of a held torque, by Drake's explicit integrator at a hundredth of a microradian."""
    plant = arm.plant
    simulator = Simulator(plant)
    scheme = SimulatorConfig(integration_scheme="runge_kutta3", accuracy=1e-9, max_step_size=1e-4)
    ApplySimulatorConfig(scheme, simulator)
    context = simulator.get_mutable_context()
    plant.SetPositionsAndVelocities(context, x)
    plant.get_actuation_input_port().FixValue(context, tau)
    simulator.Initialize()
    simulator.AdvanceTo(TICK)
    return plant.GetVelocities(context)


@pytest.mark.parametrize("damping", [0.0, 0.01, 0.3, 10.0])
def test_a_held_torque_gives_the_mean_acceleration_it_was_computed_for(tmp_path: Path, damping: float) -> None:
    arm = load_arm(write_damped_arm(tmp_path, {"wrist_deviation": damping, "elbow_flexion": damping}))
    held = HeldTorqueModel(arm, TICK)
    bent = np.array([0.1, -0.4, -0.3, 1.2, -0.8, 0.3, -0.1])  # the home posture is singular
    x = np.concatenate([bent, np.full(arm.num_joints, 0.05)])
    planned = np.linspace(-1.0, 1.0, arm.num_joints)
    tau = held.compute_held_torque(x, planned)
    found = (simulate_tick(arm, x, tau) - 0.05) / TICK
    # The error that remains, without damping too, is by curvature of gravity and mass matrix within the tick.
    np.testing.assert_allclose(found, planned, atol=5e-3)


def test_mass_matrix_and_inverse_dynamics_agree(tmp_path: Path) -> None:
    arm = load_arm(write_damped_arm(tmp_path, {"wrist_deviation": 1.0, "shoulder_azimuth": 0.4}))
    model = HeldTorqueModel(arm, TICK)
    model.set_state(np.linspace(0.0, 1.0, 2 * arm.num_joints))
    M, bias = model.compute_mass_matrix(), model.compute_inverse_dynamics(np.zeros(arm.num_joints))
    np.testing.assert_allclose(M, M.T, atol=1e-14)
    vdot = np.linspace(-1.0, 1.0, arm.num_joints)
    np.testing.assert_allclose(model.compute_inverse_dynamics(vdot), M @ vdot + bias, atol=1e-13)


def test_without_damping_it_is_the_plain_model_to_the_last_bit() -> None:
    arm = load_arm()
    x, vdot = np.linspace(0.0, 1.0, 2 * arm.num_joints), np.linspace(-1.0, 1.0, arm.num_joints)
    plain, held = ArmModel(arm), HeldTorqueModel(arm, TICK)
    for model in (plain, held):
        model.set_state(x)
    np.testing.assert_array_equal(held.compute_inverse_dynamics(vdot), plain.compute_inverse_dynamics(vdot))
    np.testing.assert_array_equal(held.compute_mass_matrix(), plain.compute_mass_matrix())


def test_stiffness_is_the_tick_over_the_shortest_time_constant_of_damping(tmp_path: Path) -> None:
    assert compute_stiffness(load_arm(), TICK) == 0.0
    arm = load_arm(write_damped_arm(tmp_path, {"wrist_deviation": 3.0, "elbow_flexion": 0.5}))
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(tmp_path / "package.xml"))
    parser.AddModels(str(tmp_path / ARM.name))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    D = np.zeros((7, 7))
    D[3, 3], D[6, 6] = 0.5, 3.0
    rates = np.linalg.eigvals(np.linalg.solve(plant.CalcMassMatrix(context), D))
    assert compute_stiffness(arm, TICK) == pytest.approx(TICK * rates.real.max(), rel=1e-9)


def test_only_a_stiff_arm_is_simulated_with_the_accuracy_for_stiff_arms(tmp_path: Path) -> None:
    settings = Settings(arm=write_damped_arm(tmp_path, {"wrist_deviation": 3.0}))
    stiff = TrialDiagram(settings)
    assert stiff.is_stiff
    assert stiff.integrator.accuracy == settings.integrator.stiff_accuracy
    plain = TrialDiagram(Settings())
    assert not plain.is_stiff
    assert plain.integrator.accuracy == settings.integrator.accuracy
