import shutil

import numpy as np
import pytest
from helpers.changed_files import change_file
from helpers.refusals import refuse
from pydrake.geometry import Role
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from affordance.exceptions import ModelFileError
from affordance.files.model_folder import MODELS
from affordance.objects.inertia import parameters_from_spatial_inertia
from affordance.plant.arm import ARM
from affordance.plant.load import add_arm, load_arm

ICE = 917.0
SEGMENTS = {
    "upper_arm": (0.1637, 0.0570, 0.0570),
    "forearm": (0.1285, 0.0486, 0.0486),
    "hand": (0.095, 0.0273, 0.044),
}


def test_arm_has_three_two_and_two_degrees_of_freedom(arm):
    assert [name.split("_")[0] for name in arm.joint_names] == ["shoulder"] * 3 + ["elbow", "forearm"] + ["wrist"] * 2
    assert arm.num_joints == 7


@pytest.mark.parametrize(("segment", "semi_axes"), SEGMENTS.items())
def test_segments_are_solid_ellipsoids_of_ice(arm, segment, semi_axes):
    expected = SpatialInertia.SolidEllipsoidWithDensity(ICE, *semi_axes).Shift([-semi_axes[0], 0, 0])
    actual = arm.plant.GetBodyByName(segment).default_spatial_inertia()
    np.testing.assert_allclose(
        parameters_from_spatial_inertia(actual), parameters_from_spatial_inertia(expected), rtol=1e-10, atol=1e-15
    )


def test_segments_are_seen_and_touched_as_the_ellipsoids_they_weigh(weight):
    builder = DiagramBuilder()
    arm = add_arm(builder, tool=weight.tools[0])
    inspector = builder.GetMutableSubsystemByName("scene_graph").model_inspector()
    for segment, semi_axes in SEGMENTS.items():
        body = arm.plant.GetBodyByName(segment)
        frame = arm.plant.GetBodyFrameIdOrThrow(body.index())
        for role in (Role.kIllustration, Role.kProximity):
            (geometry,) = inspector.GetGeometries(frame, role)
            shape = inspector.GetShape(geometry)
            assert (shape.a(), shape.b(), shape.c()) == semi_axes
            np.testing.assert_allclose(inspector.GetPoseInFrame(geometry).translation(), [semi_axes[0], 0, 0])


def test_small_bodies_between_axes_weigh_one_gram(arm):
    total = arm.plant.CalcTotalMass(arm.plant.CreateDefaultContext())
    segments = sum(ICE * 4 / 3 * np.pi * np.prod(semi_axes) for semi_axes in SEGMENTS.values())
    assert total == pytest.approx(segments + 5 * 0.001, abs=1e-9)


def test_gravity_is_that_of_the_earth(model):
    np.testing.assert_array_equal(model.gravity, [0, 0, -9.81])


def test_home_is_straight_out_and_horizontal_with_the_palm_down(model, arm):
    model.set_posture(arm.home)
    X_WH = model.compute_hand_pose()
    reach = 0.3274 + 0.2570 + 0.19
    np.testing.assert_allclose(X_WH.translation(), [reach, 0, 1.44], atol=1e-12)
    np.testing.assert_allclose(X_WH.rotation().matrix()[:, 0], [1, 0, 0], atol=1e-12)
    # At zero the palm faces +y of the hand; here it faces down.
    np.testing.assert_allclose(X_WH.rotation().matrix()[:, 1], [0, 0, -1], atol=1e-6)


def test_load_bends_the_elbow_and_flexes_the_wrist(arm, model):
    model.set_posture(arm.home)
    gravity = -model.compute_inverse_dynamics(np.zeros(7))
    by_name = dict(zip(arm.joint_names, gravity, strict=True))
    assert by_name["elbow_flexion"] > 0.5
    assert by_name["wrist_flexion"] > 0.3
    assert by_name["shoulder_elevation"] < -10


def test_limits_of_angle_come_nearer_by_a_margin_but_leave_the_start_posture(arm):
    elbow = arm.joint_names.index("elbow_flexion")  # 2 degrees from its limit at home
    near, far = arm.shrink_limits(0.01, arm.home), arm.shrink_limits(0.1, arm.home)
    np.testing.assert_allclose(near.q_lower, arm.limits.q_lower + 0.01, rtol=0, atol=1e-15)
    np.testing.assert_allclose(near.q_upper, arm.limits.q_upper - 0.01, rtol=0, atol=1e-15)
    assert far.q_lower[elbow] == arm.home[elbow]
    assert (far.q_lower <= arm.home).all()
    bent = arm.find_posture({"elbow_flexion": 0.05})
    assert arm.shrink_limits(0.1, bent).q_lower[elbow] == 0.05
    for name in ("v_max", "tau_max"):
        np.testing.assert_array_equal(getattr(near, name), getattr(arm.limits, name))


def test_home_is_within_limits_and_limits_are_finite(arm):
    assert (arm.limits.q_lower < arm.home).all()
    assert (arm.home < arm.limits.q_upper).all()
    assert np.isfinite(np.concatenate(arm.limits)).all()
    assert (arm.limits.v_max > 0).all()
    assert (arm.limits.tau_max > 0).all()
    with pytest.raises(ValueError, match="read-only"):
        arm.home[0] = 1.0


def test_torque_limits_bear_the_heaviest_object_of_the_experiment(arm, model, weight):
    model.set_payload(max(weight.tools, key=lambda tool: tool.mass).parameters)
    model.set_posture(arm.home)
    assert (np.abs(model.compute_inverse_dynamics(np.zeros(7))) < 0.7 * arm.limits.tau_max).all()


def test_payload_in_drake_is_the_tool_welded_to_the_hand(weight):
    tool = weight.tools[2]
    arm = add_arm(DiagramBuilder(), tool=tool)
    context = arm.plant.CreateDefaultContext()
    welded = arm.plant.CalcMassMatrix(context)
    arm.set_payload(context, np.zeros(10))
    assert abs(arm.plant.CalcMassMatrix(context) - welded).max() > 0.1
    arm.set_payload(context, tool.parameters)
    np.testing.assert_allclose(arm.plant.CalcMassMatrix(context), welded, atol=1e-15)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(ModelFileError, match=r"nowhere.dmd.yaml: .*") as error:
        load_arm(tmp_path / "nowhere.dmd.yaml")
    assert "\n" not in str(error.value)


def test_file_that_is_no_model_is_named(tmp_path):
    path = tmp_path / "arm.dmd.yaml"
    path.write_text("directives: 3\n", encoding="utf-8")
    assert "arm.dmd.yaml: " in refuse(load_arm, path, error=ModelFileError)


@pytest.fixture
def arm_file(tmp_path):
    for name in ("arm.dmd.yaml", "arm.sdf", "package.xml"):
        shutil.copy(MODELS / name, tmp_path / name)
    return tmp_path / ARM.name


def test_arm_without_a_moving_joint_is_refused(arm_file):
    change_file(arm_file.parent / "arm.sdf", 'type="revolute"', 'type="fixed"')
    before, _, rest = arm_file.read_text(encoding="utf-8").partition("      default_joint_positions:")
    arm_file.write_text(before + rest[rest.index("  - add_weld:") :], encoding="utf-8")
    with pytest.raises(ModelFileError, match=r"arm.dmd.yaml: has 0 joints and 0 actuators, must have one for each$"):
        load_arm(arm_file)


def test_base_that_floats_is_refused_by_name(arm_file):
    arm_file.write_text(arm_file.read_text(encoding="utf-8").partition("  - add_weld:")[0])
    with pytest.raises(ModelFileError, match=r"arm.dmd.yaml: leaves base floating, must weld it to the world with"):
        load_arm(arm_file)


def test_arm_is_loaded_anew_once_one_of_its_files_has_changed(arm_file):
    arm = load_arm(arm_file)
    assert load_arm(arm_file) is arm
    change_file(arm_file.parent / "arm.sdf", "<effort>67.9<", "<effort>50.0<")
    assert load_arm(arm_file).limits.tau_max[0] == 50.0
    assert arm.limits.tau_max[0] == 67.9
