"""What an SDF file says of links and joints; what Drake reads too is compared with what Drake makes of the file."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.robot_files import SDF
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from affordance.exceptions import AffordanceError
from affordance.extensions.robots.home import plant_arm
from affordance.extensions.robots.importer import ImportOptions, read_arm
from affordance.extensions.robots.reduced_arm import ReducedArm
from affordance.extensions.robots.report import list_dropped

TIP = ImportOptions("grip")
INF = math.inf
# Pieces of the file: end of the joint tilt, inertia of the link wrist, pose of the inertia of the link upper, and
# type and limits of the joint bend.
TILT = '</axis></joint>\n<joint name="bend"'
WRIST = "<inertia><ixx>0.001</ixx><iyy>0.001</iyy><izz>0.001</izz></inertia>"
POSE = "<pose>0.2 0 0 0.1 0 0</pose>"
BEND = 'type="revolute"><parent>lower'
LIMIT = "<lower>-2</lower><upper>2</upper><velocity>2</velocity><effort>20</effort>"


def write(folder: Path, old: str = "</sdf>", new: str = "</sdf>") -> Path:
    """Writes the robot with a text exchanged, and without the mesh that is nowhere."""
    text = SDF[: SDF.index("<collision")] + SDF[SDF.index("</collision>") + len("</collision>") :]
    assert text.count(old) == 1, old
    path = folder / "swinger.sdf"
    path.write_text(text.replace("<sdf ", '<sdf xmlns:drake="http://drake.mit.edu" ').replace(old, new))
    return path


def read(folder: Path, old: str = "</sdf>", new: str = "</sdf>") -> ReducedArm:
    return read_arm(write(folder, old, new), TIP)


def extend(addition: str) -> tuple[str, str]:
    """Returns the end of the joint tilt, and the same with something added."""
    return TILT, TILT.replace("</joint>", f"{addition}</joint>")


ROTOR = "<drake:rotor_inertia>0.003</drake:rotor_inertia>"
RATIO = "<drake:gear_ratio>{}</drake:gear_ratio>"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        *(extend(ROTOR + RATIO.format(ratio)) for ratio in (100, 0.5, -50, 0)),
        extend(ROTOR),
        extend(RATIO.format(100)),
        ("<mass>0.5</mass>", ""),
        (WRIST, ""),
        (WRIST, "<inertia><izz>1.5</izz><ixy>0.1</ixy></inertia>"),
        (POSE, '<pose degrees="true">0.2 0 0 10 20 30</pose>'),
        (POSE, '<pose rotation_format="quat_xyzw">0.2 0 0 0 0 0.6 0.8</pose>'),
    ],
)
def test_arm_has_the_mass_matrix_that_drake_makes_of_the_file(tmp_path: Path, old: str, new: str) -> None:
    """Rotors behind gears, what is left out of an inertia, and its pose in any form count as in Drake."""
    path, whole = write(tmp_path, old, new), MultibodyPlant(0.0)
    Parser(whole).AddModels(str(path))
    whole.WeldFrames(whole.world_frame(), whole.GetFrameByName("foot"))
    whole.Finalize()
    ours = plant_arm(read_arm(path, TIP)).plant
    own, context = ours.CreateDefaultContext(), whole.CreateDefaultContext()
    for q in np.random.default_rng(0).uniform(-1.5, 1.5, (3, 3)):
        ours.SetPositions(own, q)
        whole.SetPositions(context, q)
        np.testing.assert_allclose(ours.CalcMassMatrix(own), whole.CalcMassMatrix(context), rtol=0.0, atol=1e-12)


def test_rotor_that_turns_a_hundred_times_as_fast_counts_ten_thousand_times(tmp_path: Path) -> None:
    arm = read(tmp_path, *extend(ROTOR + RATIO.format(100)))
    assert [link.rotor_inertia for link in arm.links] == pytest.approx([0.0, 30.0, 0.0])


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (*extend(ROTOR.replace(">0", ">-0")), "joint tilt: has a rotor inertia of -0.003 kg m^2"),
        ("<friction>0.7</friction>", "<damping>-1</damping>", "joint pan: has a damping of -1 N m s/rad"),
        ("<lower>-3</lower>", "<lower>4</lower>", "joint pan: has position limits from 4 to 3 rad"),
        ("<xyz>0 0 1</xyz>", "<xyz>0 0 0</xyz>", "joint pan: has an axis of zero length"),
    ],
)
def test_joint_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, fault: str) -> None:
    assert fault in refuse(read, tmp_path, old, new, error=AffordanceError)


@pytest.mark.parametrize(
    ("old", "new", "limits"),
    [
        ("</sdf>", "</sdf>", (-2.0, 2.0, 2.0, 20.0)),
        (LIMIT, "<lower>-1</lower><upper>2</upper><velocity>3</velocity><effort>4</effort>", (-1.0, 2.0, 3.0, 4.0)),
        (LIMIT, "<effort>20</effort>", (-INF, INF, INF, 20.0)),
        (LIMIT, "<velocity>-1</velocity><effort>20</effort>", (-INF, INF, INF, 20.0)),  # unlimited in SDF
        (LIMIT, "<velocity>inf</velocity><effort>20</effort>", (-INF, INF, INF, 20.0)),
        (BEND, BEND.replace("revolute", "continuous"), (-INF, INF, 2.0, 20.0)),
    ],
)
def test_limits_are_those_of_the_file(tmp_path: Path, old: str, new: str, limits: tuple[float, ...]) -> None:
    last = read(tmp_path, old, new).links[-1]
    assert (last.lower, last.upper, last.velocity, last.effort) == limits


@pytest.mark.parametrize(("value", "limit"), [("6", 6.0), ("0", None), ("-1", None), ("inf", None)])
def test_limit_of_acceleration_is_that_of_drake(tmp_path: Path, value: str, limit: float | None) -> None:
    given = f'<drake:acceleration xmlns:drake="http://drake.mit.edu">{value}</drake:acceleration>'
    assert read(tmp_path, LIMIT, LIMIT + given).links[-1].acceleration == limit


def test_position_limits_of_a_continuous_joint_do_not_matter(tmp_path: Path) -> None:
    path = write(tmp_path, BEND, BEND.replace("revolute", "continuous"))
    path.write_text(path.read_text().replace(LIMIT, LIMIT.replace("-2", "7")))
    last = read_arm(path, TIP).links[-1]
    assert (last.lower, last.upper, last.velocity) == (-INF, INF, 2.0)


@pytest.mark.parametrize(
    ("effort", "said"),
    [
        ("", "has no torque limit (effort)"),
        ("<effort>-1</effort>", "has no torque limit (effort)"),
        ("<effort>inf</effort>", "has no torque limit (effort)"),
        ("<effort>0</effort>", "has a torque limit (effort) of 0 N m"),
    ],
)
def test_torque_must_be_limited(tmp_path: Path, effort: str, said: str) -> None:
    assert said in refuse(read, tmp_path, "<effort>20</effort>", effort, error=AffordanceError)


def test_friction_springs_and_damping_are_read(tmp_path: Path) -> None:
    arm = read(tmp_path, "<friction>0.7</friction>", "<friction>0.7</friction><damping>0.3</damping>")
    assert [link.damping for link in arm.links] == [0.3, 0.0, 0.0]
    dropped = list(list_dropped(arm))
    assert "Coulomb friction (N m), which Drake's joints do not have: pan 0.7" in dropped
    assert "springs (N m/rad): pan 4" in dropped


@pytest.mark.parametrize(
    ("where", "coupling", "angle"),
    [
        ("axis", '<mimic joint="pan"><multiplier>3</multiplier><offset>0.1</offset></mimic>', 3 * 0.2 + 0.1),
        ("axis", '<mimic joint="pan"/>', 0.2),
        ("joint", '<drake:mimic joint="pan" multiplier="-2" offset="0.5"/>', -2 * 0.2 + 0.5),
        ("joint", '<drake:mimic joint="pan"/>', 0.2),
    ],
)
def test_joint_that_follows_is_where_its_leader_puts_it(
    tmp_path: Path, where: str, coupling: str, angle: float
) -> None:
    """A side joint that follows the joint pan, which is above the arm's base and put at 0.2 rad."""
    axis = f"<axis><xyz>0 0 1</xyz>{coupling if where == 'axis' else ''}</axis>{coupling if where == 'joint' else ''}"
    side = (
        f'<link name="ear"><inertial/></link><joint name="side" type="revolute"><parent>foot</parent>'
        f'<child>ear</child>{axis}</joint><joint name="pan"'
    )
    options = ImportOptions("grip", base="upper", posture={"pan": 0.2})
    arm = read_arm(write(tmp_path, '<joint name="pan"', side), options)
    assert arm.frozen["side"] == pytest.approx(angle)
    assert any(said.startswith("couplings of joints") and "side" in said for said in list_dropped(arm))


@pytest.mark.parametrize(
    ("inertial", "fault"),
    [
        ("", "has no <inertial>, for which SDF's default is 1 kg"),
        ('<inertial auto="true"/>', 'has an <inertial auto="true">, must have its inertia written out'),
    ],
)
def test_inertia_that_is_not_written_out_is_refused(tmp_path: Path, inertial: str, fault: str) -> None:
    whole = f"<inertial><mass>0.5</mass>{WRIST}</inertial>"
    assert f"link wrist: {fault}" in refuse(read, tmp_path, whole, inertial, error=AffordanceError)


def test_models_within_a_model_have_names_of_their_own(tmp_path: Path) -> None:
    """A link and a joint in an inner model are not those of the same names in the outer one."""
    inner = (
        '<model name="inner"><link name="foot"><inertial><mass>3</mass></inertial></link>'
        '<link name="wrist"><inertial/></link>'
        '<joint name="bend" type="revolute"><parent>foot</parent><child>wrist</child>'
        "<axis><xyz>1 0 0</xyz><limit><effort>7</effort></limit></axis></joint></model>"
    )
    arm = read(tmp_path, "</model>", f"{inner}</model>")
    assert [link.effort for link in arm.links] == [30.0, 30.0, 20.0]
    notes = arm.tree.description
    assert {name: note.effort for name, note in notes.joints.items()}["swinger::inner::bend"] == 7.0
    assert notes.inertials["swinger::inner::foot"].mass == 3.0


def test_shapes_posed_in_another_frame_are_not_drawn(tmp_path: Path) -> None:
    shape, red = '<visual name="v">', "<material><diffuse>1 0 0</diffuse></material>"
    drawn = read(tmp_path, shape, f"{shape}<pose>0.1 0 0 0 0.2 0</pose>{red}").tree.description
    (box,) = drawn.visuals["swinger::upper"]
    assert (box.shape, box.sizes, box.place, box.rpy) == ("box", (0.4, 0.05, 0.05), (0.1, 0.0, 0.0), (0.0, 0.2, 0.0))
    assert (box.colour, drawn.undrawn) == ((1.0, 0.0, 0.0, 1.0), set())
    elsewhere = read(tmp_path, shape, f'{shape}<pose relative_to="foot">0.1 0 0 0 0 0</pose>').tree.description
    assert (elsewhere.visuals["swinger::upper"], elsewhere.undrawn) == ((), {"swinger::upper"})
