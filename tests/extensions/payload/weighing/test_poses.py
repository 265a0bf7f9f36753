"""Tables of poses: each form of orientation, stays and motion between them, and what is refused."""

import numpy as np
import pytest
from helpers.refusals import refuse
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from affordance.extensions.payload.weighing.poses import FORMS, read_poses
from studies.weigh.simulated import simulate_poses

WRENCH = "fx,fy,fz,tx,ty,tz"


@pytest.mark.parametrize("repeat", range(6), ids=FORMS)
def test_each_form_shows_the_direction_of_gravity(tmp_path, repeat):
    simulated = simulate_poses(3, repeat)
    poses = read_poses(simulated.write(tmp_path / "poses.csv"))
    assert poses.form == tuple(FORMS)[repeat]
    expected = simulated.rotations.inv().apply([0.0, 0.0, -1.0])
    assert_allclose(poses.down_S, expected, atol=0.03)  # orientations are stated with errors of 0.3 degrees
    if poses.R_BS is not None:
        assert_allclose(poses.R_BS, simulated.rotations.as_matrix(), atol=0.03)


def write(path, rows, names=f"{WRENCH},gx,gy,gz"):
    path.write_text("\n".join([names, *(",".join(map(str, row)) for row in rows)]))
    return path


def hold(direction, num, force=1.0):
    return [[force, 0, 0, 0, 0, 0, *direction]] * num


def test_rows_of_a_stay_are_averaged_and_motion_is_left_out(tmp_path):
    x, y, z = np.eye(3).tolist()
    way = [row for part in np.linspace(0.1, 0.9, 8) for row in hold([part, 1 - part, 0], 1, 99.0)]
    rows = [*hold(y, 10), *hold(y, 10, 3.0), *way, *hold(x, 15), *hold(z, 20), *hold([0, 0, -1], 20)]
    poses = read_poses(write(tmp_path / "p.csv", rows))
    assert poses.counts.tolist() == [20, 15, 20, 20]
    assert poses.num_left_out == 8
    assert poses.wrench[:, 0].tolist() == [2.0, 1.0, 1.0, 1.0]


def test_a_column_numbers_the_poses(tmp_path):
    rows = [[*hold([0, 0, 1], 1)[0], k // 2] for k in range(10)]
    assert read_poses(write(tmp_path / "p.csv", rows, f"{WRENCH},gx,gy,gz,pose")).counts.tolist() == [2] * 5


def test_names_that_programs_of_ros_write_and_degrees_are_read(tmp_path):
    names = "time," + ",".join(f"/ft/wrench.force.{axis}" for axis in "xyz") + ",Mx,My,Mz (Nm)"
    rows = [[0.1, 1, 2, 3, 4, 5, 6, *angles] for angles in ([0, 0, 0], [90, 0, 0], [0, 90, 0], [30, 40, 50])]
    poses = read_poses(write(tmp_path / "p.csv", rows, f"{names},roll_deg,Pitch (deg),yaw [°]"))
    assert_allclose(poses.R_BS[3], Rotation.from_euler("xyz", [30, 40, 50], degrees=True).as_matrix(), atol=1e-12)
    assert poses.wrench[0].tolist() == [1, 2, 3, 4, 5, 6]


def test_a_table_of_universal_robots_recorder_is_read(tmp_path):
    names = ["timestamp", *(f"actual_TCP_{what}_{i}" for what in ("pose", "force") for i in range(6))]
    rows = [[0.1, 0.4, 0.2, 0.5, *turn, 1, 2, 3, 4, 5, 6] for turn in np.r_[np.eye(3), -np.eye(3)[:1]].tolist()]
    poses = read_poses(write(tmp_path / "p.csv", rows, ",".join(names)))
    assert_allclose(poses.R_BS[2], Rotation.from_rotvec([0.0, 0.0, 1.0]).as_matrix(), atol=1e-12)
    assert (poses.form, poses.wrench[0].tolist()) == ("rotation_vector", [1, 2, 3, 4, 5, 6])


def test_one_of_several_forms_is_chosen(tmp_path):
    rows = [[*hold(axis, 1)[0], *(-9.81 * np.array(axis))] for axis in [*np.eye(3).tolist(), [0, 0, -1]]]
    path = write(tmp_path / "p.csv", rows, f"{WRENCH},gx,gy,gz,ax,ay,az")
    assert "has the forms gravity, accelerometer, must be read by one" in refuse(read_poses, path)
    one, other = (read_poses(path, form) for form in ("gravity", "accelerometer"))
    assert_allclose(one.down_S, other.down_S)
    assert "has no columns qw, qx, qy, qz" in refuse(read_poses, path, "quaternion")
    assert "is 'quaternoin', must be one of" in refuse(read_poses, path, "quaternoin")


@pytest.mark.parametrize(
    ("names", "row", "said"),
    [
        ("fx,fy,fz,tx,ty,gx,gy,gz", [0] * 8, "p.csv: tz: is missing, must be a column"),
        (
            WRENCH,
            [0] * 6,
            "has no orientation of the sensor, must have columns of one form: qw qx qy qz (quaternion)",
        ),
        (f"{WRENCH},gx,gy,gz", [0] * 9, "row 2, column gx: is part of a direction of length 0"),
        (
            f"{WRENCH},qw,qx,qy,qz",
            [0] * 6 + [1, 1, 0, 0],
            "row 2, column qw: is part of a quaternion, must have length",
        ),
        (f"{WRENCH},roll,pitch,yaw", [0] * 6 + [0, 90, 0], "row 2, column pitch: is beyond a turn"),
        (f"{WRENCH},rx,ry,rz", [0] * 6 + [0, 0, 9], "row 2, column rz: is beyond a turn"),
        (
            f"{WRENCH}," + ",".join(FORMS["matrix"]),
            [0] * 6 + [1, 0, 0, 0, 1, 0, 0, 0, -1],
            "row 2, column r11: is part of a matrix that is not a rotation",
        ),
        (f"{WRENCH},raw.force.z,gx,gy,gz", [0] * 10, "p.csv: fz: could be 'fz', 'raw.force.z', must be one column"),
        ("Fx [kgf],fy,fz,tx,ty,tz,gx,gy,gz", [0] * 9, "column Fx [kgf]: is in kgf, must be in N (1 kgf is 9.807 N)"),
        ("fx,fy,fz,tx,My (N*mm),tz,gx,gy,gz", [0] * 9, "column My (N*mm): is in N*mm, must be in N m"),
        (f"{WRENCH},gx,gy,gz", ["nan", *[0] * 8], "row 2, column fx: is 'nan', must be a finite number"),
        (
            f"{WRENCH},gx,gy,gz",
            [*[0] * 8, 1],
            "has 1 poses that differ by two degrees or more, must have at least 4: three determine mass",
        ),
    ],
)
def test_bad_tables_are_refused(tmp_path, names, row, said):
    assert said in refuse(read_poses, write(tmp_path / "p.csv", [row] * 4, names))
