import pytest
from helpers.changed_files import change_file
from helpers.generated_runs import write_urdf
from helpers.refusals import refuse
from numpy.testing import assert_allclose

from affordance.exceptions import AffordanceError
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.plant.arm import ARM
from affordance.plant.chain_plant import build_chain
from affordance.plant.load import load_arm


def test_our_own_arm_is_read_as_it_is():
    ours = load_robot(ARM)
    chain = build_chain(load_arm())
    # Where the base stands in the world is nothing to the robot's own frame.
    assert_allclose(ours.p_PF[1:], chain.p_PF[1:], atol=1e-12)
    assert_allclose(ours.p_MT, chain.p_MT, atol=1e-12)
    assert len(ours.joint_names) == 7


def test_fixed_links_count_to_the_link_they_hang_on_and_the_base_is_the_lowest_one(tmp_path):
    path = write_urdf(tmp_path)
    inertia = "<inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/>"
    extra = (
        f"<link name='hand'><inertial><mass value='0.7'/>{inertia}</inertial></link>"
        "<joint name='hand_joint' type='fixed'><parent link='flange'/><child link='hand'/></joint>"
        "<link name='mount'/><joint name='mount_joint' type='fixed'><parent link='mount'/><child link='base'/>"
        "<origin xyz='0 0 0.5'/></joint></robot>"
    )
    bare = load_robot(path, "flange")
    path.write_text(path.read_text().replace("</robot>", extra))
    robot = load_robot(path, "flange")
    assert_allclose((robot.link_parameters - bare.link_parameters)[:, 0], [0.0] * 5 + [0.7])
    assert_allclose(robot.p_PF[0], bare.p_PF[0] + [0.0, 0.0, 0.5])
    assert_allclose(load_robot(path, "flange", "base").p_PF[0], bare.p_PF[0])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("mass value='3.0'", "mass value='-3'", "link link_3: has a mass of -3 kg"),
        ("type='revolute'", "type='prismatic'", "joint joint_6: is of type prismatic, must be revolute"),
        ("<robot", "<robt", "mismatched tag"),
    ],
)
def test_mistake_in_the_file_of_a_recorded_robot_is_refused(tmp_path, old, new, said):
    path = change_file(write_urdf(tmp_path), old, new)
    assert said in refuse(load_robot, path, "flange", error=AffordanceError)


def test_ends_of_a_recorded_robot_are_links_of_its_file(tmp_path):
    path = write_urdf(tmp_path)
    assert refuse(load_robot, path, "flanje") == f"--tip: is 'flanje', which is not in {path}; nearest: flange"
    assert refuse(load_robot, path, "flange", "bass") == f"--base: is 'bass', which is not in {path}; nearest: base"
