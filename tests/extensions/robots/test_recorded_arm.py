import re
import shutil

import numpy as np
import pinocchio
import pytest
from helpers.changed_files import change_file
from helpers.generated_runs import write_urdf
from helpers.refusals import refuse
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from affordance.exceptions import AffordanceError
from affordance.extensions.robots import report
from affordance.extensions.robots.importer import ImportOptions
from affordance.extensions.robots.kept import import_arm
from affordance.extensions.robots.recorded_arm import find_flange, find_imported_tip, load_robot
from affordance.files.model_folder import MODELS
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


# A tip that is turned and displaced, on the flange of the generated robot.
_TURNED = (
    "<link name='turned'/><joint name='turned_joint' type='fixed'><parent link='flange'/><child link='turned'/>"
    "<origin xyz='0.01 -0.02 0.03' rpy='0.3 -0.4 0.5'/></joint></robot>"
)


@pytest.fixture(autouse=True)
def _without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves out the picture of the report, which takes longer than the import."""
    monkeypatch.setattr(report, "draw_posture", lambda _: Figure())


@pytest.fixture(scope="module")
def urdf(tmp_path_factory):
    path = write_urdf(tmp_path_factory.mktemp("robot"))
    path.write_text(path.read_text().replace("</robot>", _TURNED))
    return path


def _import(urdf, folder, tip, **options):
    import_arm(urdf, ImportOptions(tip, **options), folder, with_meshes=False, fits_tasks=False)
    return folder


def _measure(urdf, one, other):
    """The pose of a frame in another one, by Pinocchio."""
    model = pinocchio.buildModelFromUrdf(str(urdf))
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, pinocchio.neutral(model))
    X_WF, X_WT = (data.oMf[model.getFrameId(name)] for name in (one, other))
    return X_WF.actInv(X_WT).homogeneous


def test_the_tip_of_a_robots_file_is_its_flange_unless_another_frame_is_named(urdf):
    robot = load_robot(urdf, "turned")
    assert find_flange(robot).name == "turned"
    assert np.array_equal(find_flange(robot).X_FT, np.eye(4))
    named = find_flange(robot, "flange")
    assert named.name == "flange"
    assert_allclose(named.X_FT, _measure(urdf, "flange", "turned"), atol=1e-12)


@pytest.mark.parametrize(("tip", "axis"), [("turned", "-y"), ("flange", "x"), ("link_6", "z")])
def test_an_imported_folder_knows_the_tip_of_the_robots_file(urdf, tmp_path, tip, axis):
    """Also where the tip is the last link itself, or the hand is not turned; x of the hand is the named axis."""
    folder = _import(urdf, tmp_path / "arm", tip, out_axis=axis)
    assert find_imported_tip(folder) == tip
    robot = load_robot(folder)
    flange = find_flange(robot)
    assert flange.name == tip
    out = {"x": [1, 0, 0], "-y": [0, -1, 0], "z": [0, 0, 1]}[axis]
    assert_allclose(flange.X_FT[:3, 0], out, atol=1e-9)
    assert_allclose(flange.X_FT[:3, 3], 0.0, atol=1e-9)
    # From the base to the tip the folder and the file agree.
    q = np.linspace(0.1, 0.6, 6)[None]
    of_file = load_robot(urdf, tip).compute_positions(q, np.array([0.1, 0.2, 0.3]))
    in_hand = np.linalg.inv(flange.X_FT) @ [0.1, 0.2, 0.3, 1.0]
    assert_allclose(robot.compute_positions(q, in_hand[:3]), of_file, atol=1e-9)


def test_a_folder_without_the_tip_does_not_guess_it(urdf, tmp_path):
    """Folders of version 0.2 have the hand only; one of ours, and one that was edited, know no robot's file."""
    folder = _import(urdf, tmp_path / "arm", "turned")
    sdf = folder / "arm.sdf"
    text = sdf.read_text()
    changed = {
        "old": re.sub(r'<frame name="turned".*?</frame>', "", text, flags=re.DOTALL),
        "moved": re.sub(r'(<frame name="turned"[^>]*>\s*<pose>)\S+', r"\g<1>0.5", text),
        "hand": text.replace("tip turned.", "tip hand_grip."),
    }
    for new in changed.values():
        assert new != text
        sdf.write_text(new)
        assert find_imported_tip(folder) == ""
        assert find_flange(load_robot(folder)) is None
    shutil.copy(MODELS / "arm.sdf", sdf)
    assert find_imported_tip(folder) is None
    assert find_flange(load_robot(MODELS)) is None
    assert find_flange(load_robot(MODELS), "hand_grip").name == "hand_grip"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("link_5", "--flange: is 'link_5', which moves relative to the tip, turned, must be fixed to it"),
        ("flang", "--flange: is 'flang', which "),
    ],
)
def test_a_frame_that_is_none_or_moves_is_refused(urdf, name, message):
    assert message in refuse(find_flange, load_robot(urdf, "turned"), name)
