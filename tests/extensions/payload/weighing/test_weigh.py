"""Weighing: the truth is found, conventions are found and named, and mistakes are doubted."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from affordance.extensions.payload.weighing.poses import Poses, read_poses
from affordance.extensions.payload.weighing.weigh import weigh

MASS, CENTRE = 1.5, np.array([0.02, -0.03, 0.08])
DOWN = np.array([0.0, 0.0, -1.0])
OFFSETS = np.array([3.0, -5.0, 2.0, 0.1, 0.2, 0.3])


def make(num=8, *, change=None, turn=None, noise=0.05, mass=MASS, seed=0):
    """Makes poses of a load; ``change`` edits wrenches, (N, 6), and ``turn`` the stated orientations, (N, 3, 3)."""
    rng = np.random.default_rng(seed)
    R = Rotation.random(num, rng=rng)
    weight = mass * R.inv().apply(9.81 * DOWN)
    wrench = np.column_stack([weight, np.cross(CENTRE, weight)])
    if change is not None:
        wrench = change(wrench, R)
    wrench = wrench + OFFSETS
    wrench = wrench + noise * rng.standard_normal((num, 6)) * [1.0, 1.0, 1.0, 0.05, 0.05, 0.05]
    stated = R.as_matrix() if turn is None else turn(R).as_matrix()
    return Poses("poses.csv", "quaternion", stated, DOWN @ stated, wrench, np.ones(num, dtype=int), np.zeros(0))


def test_mass_centre_and_offsets_are_found():
    found = weigh(make())
    truth = [MASS, *CENTRE, *OFFSETS]
    mean = [found.mass, *found.centre_of_mass, *found.samples[:, 4:].mean(axis=0)]
    assert np.abs((np.array(mean) - truth) / found.sd).max() < 4.0
    assert found.sd[0] < 0.02
    assert (found.is_trusted, found.shows_mass, found.axes, found.force_on) == (True, True, "sensor", "robot")
    assert not found.unseen


def test_without_noise_only_gains_are_uncertain():
    found = weigh(make(12, noise=0.0))
    assert found.mass == pytest.approx(MASS, rel=2e-3)
    assert_allclose(found.centre_of_mass, CENTRE, atol=5e-4)
    assert found.sd[0] / MASS == pytest.approx(0.005, rel=0.3)  # of the gain that all axes share


def test_axes_of_the_base_are_found_where_offsets_are_the_sensors():
    def to_base(wrench, R):
        return np.column_stack([R.apply(wrench[:, :3]), R.apply(wrench[:, 3:])])

    poses = make()
    poses = poses._replace(wrench=to_base(poses.wrench, Rotation.from_matrix(poses.R_BS)))
    found = weigh(poses)
    assert (found.axes, found.is_trusted) == ("base", True)
    assert "the wrench is in the base's axes" in found.notes[0]
    assert found.mass == pytest.approx(MASS, rel=0.03)
    assert "the wrench seems to be in the base's axes, not in the sensor's" in weigh(poses, axes="sensor").doubts


def test_orientations_of_the_base_in_the_sensor_are_found():
    found = weigh(make(turn=lambda R: R.inv()))
    assert "orientations are those of the base in the sensor's axes" in found.notes[0]
    assert found.mass == pytest.approx(MASS, rel=0.03)


def test_the_opposite_sign_is_named_and_doubted_only_if_another_was_stated():
    poses = make(change=lambda wrench, R: -wrench)
    found = weigh(poses)
    assert (found.force_on, found.is_trusted) == ("object", True)
    assert_allclose(found.centre_of_mass, CENTRE, atol=0.01)
    assert "seems to act on the object, not on the robot" in weigh(poses, force_on="robot").doubts[0]


def test_gravity_on_a_wall_is_given():
    poses = make()
    down = (1.0, 0.0, 0.0)
    turned = Rotation.from_rotvec([0.0, -np.pi / 2.0, 0.0]).as_matrix() @ poses.R_BS
    assert_allclose(np.array(down) @ turned, poses.down_S, atol=1e-12)
    assert weigh(poses._replace(R_BS=turned), down_B=down).mass == pytest.approx(MASS, rel=0.03)


def apply_to_forces(matrix):
    return lambda wrench, R: np.column_stack([wrench[:, :3] @ np.transpose(matrix), wrench[:, 3:]])


def turn_by(angle):
    T = Rotation.from_rotvec([0.0, 0.0, np.radians(angle)])
    return lambda wrench, R: np.column_stack([T.apply(wrench[:, :3]), T.apply(wrench[:, 3:])])


def step(wrench, R):
    return wrench - (np.arange(len(wrench)) >= 4)[:, None] * wrench[3]


def lag(wrench, R):
    return np.concatenate([wrench[:1], 0.85 * wrench[1:] + 0.15 * wrench[:-1]])


def drift(wrench, R):
    return wrench + np.linspace(0.0, 1.0, len(wrench))[:, None] * [4.0, 2.0, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (apply_to_forces(np.diag([1.0, 1.0, 0.85])), "the axes disagree about the mass: x 1."),
        (apply_to_forces(np.diag([-1.0, 1.0, 1.0])), "fx, fy, fz follow gravity along -x, +y, +z"),
        (apply_to_forces(np.eye(3)[[1, 0, 2]]), "fx, fy, fz follow gravity along +y, +x, +z"),
        (turn_by(12.0), "the sensor's axes are turned by about 12 deg about (0.0, "),
        (step, "the offsets change before pose 5: the sensor was zeroed"),
        (lag, "the wrench still shows the pose before: it is filtered"),
        (drift, "the offsets drift from pose to pose"),
        (lambda wrench, R: wrench[:, [0, 1, 2, 3, 5, 4]], "tx, ty, tz follow a load's along +x, +z, +y"),
        (lambda wrench, R: wrench * [1, 1, 1, 1e3, 1e3, 1e3], "torques vary as those of a load 157 m away"),
        (lambda wrench, R: np.random.default_rng(5).permutation(wrench), "% of the forces unexplained"),
    ],
)
def test_mistakes_are_doubted(change, said):
    doubts = weigh(make(10, change=change)).doubts
    assert any(said in doubt for doubt in doubts), doubts


@pytest.mark.parametrize(
    ("names", "axes", "said"),
    [
        ("roll,pitch,yaw", "xyz", None),
        (
            "roll,pitch,yaw",
            "XYZ",
            "roll, pitch, yaw seem to be about the turned axes of the sensor, not about the base's",
        ),
        ("rx,ry,rz", "rotvec", None),
        ("rx,ry,rz", "xyz", "rx, ry, rz seem to be angles about the base's axes x, then y, then z, and no rotation"),
        (
            "rx,ry,rz",
            "XYZ",
            "rx, ry, rz seem to be angles about the turned axes of the sensor, and no rotation vector",
        ),
    ],
)
def test_angles_of_another_kind_are_doubted(tmp_path, names, axes, said):
    poses = make()
    R = Rotation.from_matrix(poses.R_BS)
    angles = R.as_rotvec() if axes == "rotvec" else R.as_euler(axes)
    table = np.column_stack([poses.wrench, angles])
    np.savetxt(tmp_path / "p.csv", table, delimiter=",", header=f"fx,fy,fz,tx,ty,tz,{names}", comments="")
    doubts = weigh(read_poses(tmp_path / "p.csv")).doubts
    assert doubts[-1].startswith(said) if said else not doubts


def test_forces_in_the_columns_of_torques_are_no_empty_hand():
    found = weigh(make(mass=0.0, change=lambda wrench, R: wrench + np.eye(6)[4] * np.arange(8.0)[:, None]))
    assert (found.is_light, found.is_trusted) == (True, False)


def test_lengths_of_an_accelerometer_that_differ_are_doubted():
    poses = make()._replace(R_BS=None, lengths=np.array([9.8, 9.8, 9.9, 9.8, 9.8, 9.2, 9.8, 9.8]))
    assert weigh(poses).doubts == (
        "the accelerometer's readings differ in length by 7 %: it has offsets, or it moved",
    )


def test_nothing_is_little_or_nothing():
    found = weigh(make(mass=0.0))
    assert (found.is_light, found.shows_mass, found.is_trusted) == (True, True, True)
    assert found.intervals[0, 3] < 0.05


def measure(R):
    """Computes the wrenches, (N, 6), of the load in poses, without any error."""
    weight = MASS * R.inv().apply(9.81 * DOWN)
    return np.column_stack([weight, np.cross(CENTRE, weight)])


def pose(R, noise=0.0):
    """Makes poses with these orientations."""
    stated = R.as_matrix()
    return make(len(R))._replace(R_BS=stated, down_S=DOWN @ stated, wrench=measure(R) + noise)


def test_turning_about_gravity_alone_shows_no_mass():
    assert not weigh(pose(Rotation.from_euler("z", [[0.1], [0.5], [0.9], [1.3], [2.0]]))).shows_mass


def test_gravity_up_and_down_alone_leaves_the_centre_along_it_unseen():
    found = weigh(pose(Rotation.from_euler("x", [[0.0], [np.pi], [0.0], [np.pi], [0.0]])))
    assert found.unseen == ("the centre of mass along z: tilt the sensor about two axes",)
    assert found.centre_of_mass[:2] == pytest.approx(CENTRE[:2], abs=1e-3)


def test_the_next_pose_narrows_as_is_said():
    """Gravity has hardly any x in these poses; measuring what is advised narrows the SDs to about what was said."""
    R = Rotation.from_euler("xyz", [[angle, 0.05, 0.0] for angle in (0.0, 0.6, 1.2, -0.8, 2.0)])
    noise = np.random.default_rng(4).standard_normal((6, 6)) * [0.1, 0.1, 0.1, 0.01, 0.01, 0.01]
    before = weigh(pose(R, noise[:5]))
    assert "x" in before.next_pose.partition(":")[0]
    after = weigh(pose(Rotation.concatenate([R, Rotation.from_rotvec([0.0, np.pi / 2.0, 0.0])]), noise))
    assert after.sd[1:4].max() < 0.8 * before.sd[1:4].max()


def test_four_poses_ask_for_a_fifth_that_shows_a_turned_sensor():
    assert "a fifth would also show whether the sensor is turned" in weigh(make(4)).next_pose
    assert "a fifth" not in weigh(make(5)).next_pose
