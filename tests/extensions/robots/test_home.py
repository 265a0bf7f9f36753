"""The posture in which objects are held."""

from pathlib import Path

import numpy as np
import pytest
from helpers.robot_files import write_urdf
from scipy.spatial.transform import Rotation

from affordance.extensions.robots.home import (
    TEST_DISTANCE,
    HomePosture,
    compute_static_torques,
    find_home,
    get_shoulder,
    plant_arm,
)
from affordance.extensions.robots.importer import ImportOptions, compute_roll, extract_arm, read_arm
from affordance.extensions.robots.reduced_arm import ReducedArm, turn_up
from affordance.files.model_folder import MODELS
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm

OURS = ImportOptions("hand_grip")


def test_the_hand_is_level_points_outwards_and_joints_keep_clear_of_their_limits() -> None:
    arm, home = extract_arm(MODELS / "arm.sdf", OURS)
    model, q = ArmModel(plant_arm(arm)), home.q
    model.set_posture(q)
    X_WH = model.compute_hand_pose().GetAsMatrix4()
    away = X_WH[:3, 3] - model.compute_frame_position(get_shoulder(model.arm))
    assert abs(X_WH[2, 0]) < 1e-5
    assert X_WH[:3, 0] @ away / np.linalg.norm(away) > np.cos(np.radians(20.1))
    for link, angle in zip(arm.links, q, strict=True):
        clear = min(np.radians(10.0), 0.5 * (link.upper - link.lower)) - 1e-6
        assert link.lower + clear <= angle <= link.upper - clear
    assert home.smallest_singular_value > 0.03 * home.length


def test_given_angles_are_kept_and_with_all_given_nothing_is_searched() -> None:
    arm, home = extract_arm(MODELS / "arm.sdf", ImportOptions("hand_grip", posture={"elbow_flexion": 1.2}))
    assert home.q[arm.joint_names.index("elbow_flexion")] == pytest.approx(1.2, abs=1e-9)
    angles = {name: 0.1 * k for k, name in enumerate(arm.joint_names)}
    angles["wrist_deviation"] = 0.2
    _, home = extract_arm(MODELS / "arm.sdf", ImportOptions("hand_grip", posture=angles))
    assert home.q.tolist() == list(angles.values())


def test_the_payload_loads_the_weakest_joint_to_its_limit_and_no_other_beyond(tmp_path: Path) -> None:
    arm, home = extract_arm(write_urdf(tmp_path), ImportOptions("right_tool"))
    model = ArmModel(plant_arm(arm))
    load = np.abs(compute_static_torques(model, home.q, home.payload)) / model.arm.limits.tau_max
    assert load.max() == pytest.approx(1.0)
    assert arm.joint_names[int(load.argmax())] == home.weakest


def test_static_torques_are_those_of_the_strict_programs_arm() -> None:
    arm = load_arm()
    model = ArmModel(arm)
    m, x, q = 0.7, TEST_DISTANCE, np.linspace(0.1, 0.6, arm.num_joints)
    model.set_payload(np.array([m, m * x, 0, 0, 0, m * x**2, m * x**2, 0, 0, 0]))
    model.set_state(np.concatenate([q, np.zeros(arm.num_joints)]))
    imported = ArmModel(plant_arm(extract_arm(MODELS / "arm.sdf", OURS)[0]))
    expected = model.compute_inverse_dynamics(np.zeros(arm.num_joints))
    np.testing.assert_allclose(compute_static_torques(imported, q, m), expected, rtol=0.0, atol=1e-12)


def test_the_base_is_turned_so_that_the_hand_points_forward(tmp_path: Path) -> None:
    arm, home = extract_arm(write_urdf(tmp_path), ImportOptions("right_tool", height=0.9))
    model = ArmModel(plant_arm(arm))
    model.set_posture(home.q)
    R_WH = model.compute_hand_pose().rotation().matrix()
    np.testing.assert_allclose(R_WH[:, 0], [1.0, 0.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(arm.X_WB.translation(), [0.0, 0.0, 0.9], atol=1e-15)


@pytest.mark.parametrize(("option", "column"), [("x", [1, 0, 0]), ("-z", [0, 0, -1]), ("y", [0, 1, 0])])
def test_the_axis_that_points_out_is_the_one_that_is_given(option: str, column: list[int]) -> None:
    R_LH = read_arm(MODELS / "arm.sdf", ImportOptions("hand_grip", out_axis=option)).X_LH.rotation().matrix()
    np.testing.assert_allclose(R_LH[:, 0], column, atol=1e-15)
    assert np.linalg.det(R_LH) == pytest.approx(1.0)


@pytest.mark.parametrize("up", ["x", "-x", "y", "-y", "z", "-z"])
def test_the_axis_that_points_up_does(up: str) -> None:
    R = turn_up(up).rotation().matrix()
    np.testing.assert_allclose(R[:, "xyz".index(up[-1])] * (-1 if "-" in up else 1), [0.0, 0.0, 1.0], atol=1e-15)


def turn_about_x(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def measure_hand(path: Path, options: ImportOptions) -> tuple[np.ndarray, ReducedArm, HomePosture]:
    """Measures the axes of the hand at home in the arm as it is written."""
    arm, home = extract_arm(path, options)
    model = ArmModel(plant_arm(arm))
    model.set_posture(home.q)
    return model.compute_hand_pose().rotation().matrix(), arm, home


@pytest.mark.parametrize("tip", ["right_tool", "left_tool"])
def test_the_hands_z_is_up_at_home_and_the_posture_stays(tmp_path: Path, tip: str) -> None:
    """The posture is that of the hand with the axes of the tip; the hand alone is turned."""
    path = write_urdf(tmp_path)
    R_WH, arm, home = measure_hand(path, ImportOptions(tip))
    assert R_WH[:, 2] == pytest.approx([0.0, 0.0, 1.0], abs=1e-5)
    assert home.tilt < 1e-4
    as_tip = read_arm(path, ImportOptions(tip))
    R_LH = as_tip.X_LH.rotation().matrix() @ turn_about_x(arm.roll)
    np.testing.assert_allclose(arm.X_LH.rotation().matrix(), R_LH, atol=1e-12)
    np.testing.assert_array_equal(arm.X_LH.translation(), as_tip.X_LH.translation())
    np.testing.assert_array_equal(find_home(ArmModel(plant_arm(as_tip)), {}).q, home.q)


def test_a_given_roll_turns_the_hand_from_the_axes_of_its_tip(tmp_path: Path) -> None:
    path = write_urdf(tmp_path)
    R_WH, arm, home = measure_hand(path, ImportOptions("right_tool", roll=0.5))
    at_tip = read_arm(path, ImportOptions("right_tool")).X_LH.rotation().matrix()
    np.testing.assert_allclose(arm.X_LH.rotation().matrix(), at_tip @ turn_about_x(0.5), atol=1e-12)
    assert home.tilt == pytest.approx(np.arccos(R_WH[2, 2]), abs=1e-6)


@pytest.mark.parametrize("roll", [-2.0, 0.0, 1.0])
def test_the_home_of_a_given_roll_has_the_hands_z_up(roll: float) -> None:
    R_WH, arm, home = measure_hand(MODELS / "arm.sdf", ImportOptions("hand_grip", roll=roll))
    assert R_WH[2, 2] == pytest.approx(1.0, abs=1e-6)
    assert (arm.roll, home.tilt) == (roll, pytest.approx(0.0, abs=1e-4))


def test_the_roll_that_is_found_lifts_z_higher_than_any_other(rng: np.random.Generator) -> None:
    for _ in range(20):
        R_WH = Rotation.from_rotvec(rng.uniform(-3.0, 3.0, 3)).as_matrix()
        heights = [(R_WH @ turn_about_x(angle))[2, 2] for angle in np.linspace(-np.pi, np.pi, 2001)]
        found = (R_WH @ turn_about_x(compute_roll(R_WH)))[2, 2]
        if np.hypot(*R_WH[2, 1:]) > 0.18:
            assert found >= max(heights) - 1e-9


def test_a_hand_that_points_up_is_not_turned() -> None:
    R_WH = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    assert compute_roll(R_WH) == 0.0
    assert compute_roll(R_WH @ turn_about_x(1.0)) == 0.0
