"""Recordings of every format, read from files as their programs write them."""

import re
from pathlib import Path

import numpy as np
import pytest
from helpers.held_postures import write_table
from helpers.refusals import refuse
from numpy.testing import assert_allclose
from pydrake.math import RigidTransform, RollPitchYaw

from affordance.extensions.payload.recording.run_file import read_run
from affordance.extensions.payload.settings import SignalKind
from studies.payload.at_rest import draw_postures

_NUM, _TIMES = 40, np.arange(40) * 0.01
_Q = 0.3 * np.column_stack([np.sin(_TIMES), np.cos(_TIMES)])
_V = 0.3 * np.column_stack([np.cos(_TIMES), -np.sin(_TIMES)])
_HEADER = "time,q_1,q_2,tau_1,tau_2"
_TAU = np.column_stack([5.0 + _TIMES, -3.0 * _TIMES])
_PARTS = "joints: [a, b]\nsignal: joint_torque\n"
_HELD = draw_postures(6, 6, np.random.default_rng(0))
_FELT = np.random.default_rng(1).standard_normal((6, 6))


def _write(folder: Path, header: str, columns: list[np.ndarray], yaml: str, name: str = "run.csv") -> Path:
    delimiter = " " if name.endswith(".txt") else ","
    path = folder / name
    rows = np.column_stack(columns)
    lines = [header] if header else []
    lines += [delimiter.join(f"{value:.17g}" for value in row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    path.with_suffix(".yaml").write_text("joints: [a, b]\n" + yaml, encoding="utf-8")
    return path


def test_standard_columns_of_a_csv(tmp_path):
    header = "time,q_1,q_2,v_1,v_2,tau_1,tau_2"
    run = read_run(_write(tmp_path, header, [_TIMES, _Q, _V, _TAU], "gravity: [0, 9.81, 0]\nreference_mass: 1.5\n"))
    assert_allclose(run.q, _Q)
    assert_allclose(run.v, _V)
    assert_allclose(run.signal, _TAU)
    assert run.description.kind is SignalKind.JOINT_TORQUE
    assert run.description.gravity == (0.0, 9.81, 0.0)
    assert run.description.reference_mass == 1.5


def test_libfranka_logs_of_older_and_newer_versions(tmp_path):
    command = np.zeros((_NUM, 2))
    old = "duration, success rate, q[0], q[1],q_d[0], q_d[1],dq[0], dq[1],tau_J[0], tau_J[1],q_d[0], q_d[1]"
    columns = [1e3 * _TIMES, np.ones(_NUM), _Q, command, _V, _TAU, command]
    new = old.replace("duration, success rate", "time,success_rate")
    for name in ("q", "q_d", "dq", "tau_J"):
        new = new.replace(f" {name}[", f" state.{name}[").replace(f",{name}[", f",state.{name}[")
    for k, header in enumerate((old, new)):
        run = read_run(_write(tmp_path, header, columns, "columns: libfranka\n", f"run{k}.csv"))
        assert_allclose(run.times, _TIMES, atol=1e-12)
        assert_allclose(run.q, _Q)
        assert_allclose(run.v, _V)
        assert_allclose(run.signal, _TAU)


def test_ur_rtde_logs_with_blanks_between_columns(tmp_path):
    wanted, measured = "target_q_0 target_q_1", "actual_q_0 actual_q_1 actual_qd_0 actual_qd_1"
    header = f"timestamp {wanted} {measured} actual_current_0 actual_current_1"
    columns = [_TIMES, np.zeros((_NUM, 2)), _Q, _V, _TAU]
    run = read_run(_write(tmp_path, header, columns, "columns: ur_rtde\n", "run.txt"))
    assert run.description.kind is SignalKind.CURRENT
    assert_allclose(run.signal, _TAU)


def test_a_table_without_names_takes_those_of_the_description(tmp_path):
    yaml = "columns: [time, unused, q_1, q_2, current_1, current_2]\nunits: {q: deg, current: mA}\n"
    columns = [_TIMES, np.zeros(_NUM), np.degrees(_Q), 1e3 * _TAU]
    run = read_run(_write(tmp_path, "", columns, yaml))
    assert_allclose(run.q, _Q)
    assert_allclose(run.signal, _TAU)
    assert run.v is None


def test_a_wrist_wrench_pushes_the_robot_or_the_object(tmp_path):
    header = "time,q_1,q_2,fx,fy,fz,tx,ty,tz"
    wrench = np.arange(6.0) * np.ones((_NUM, 1))
    on_object = read_run(_write(tmp_path, header, [_TIMES, _Q, wrench], "", "a.csv"))
    on_robot = read_run(_write(tmp_path, header, [_TIMES, _Q, wrench], "force_on: robot\n", "b.csv"))
    assert on_object.description.kind is SignalKind.WRENCH
    assert_allclose(on_object.signal, wrench)
    assert_allclose(on_robot.signal, -wrench)
    in_base = read_run(_write(tmp_path, header, [_TIMES, _Q, wrench], "wrench_axes: base\n", "c.csv"))
    assert (on_object.description.wrench_in_base, in_base.description.wrench_in_base) == (False, True)


@pytest.mark.parametrize("key", ["arm", "gravity"])
def test_what_a_controller_took_out_is_ten_parameters_at_the_tip(tmp_path, key):
    yaml = f"compensates: {key}\ncompensated_payload: {{mass: 2, com: [0, 0, 0.1], inertia: [0.01, 0.02, 0.03]}}\n"
    description = read_run(_write(tmp_path, _HEADER, [_TIMES, _Q, _TAU], yaml)).description
    assert (description.compensates_arm, description.leaves_inertia) == (True, key == "gravity")
    assert_allclose(description.compensated_payload[:7], [2.0, 0.0, 0.0, 0.2, 0.03, 0.04, 0.03])


def test_rows_above_a_table_are_skipped_if_asked(tmp_path):
    path = _write(tmp_path, _HEADER, [_TIMES, _Q, _TAU], "")
    path.write_text("robot 7, serial 12\nstarted at noon\n" + path.read_text())
    assert "row 2: has 3 values, must have 4, one per column (skip_rows: N skips N rows" in refuse(read_run, path)
    path.with_suffix(".yaml").write_text("joints: [a, b]\nskip_rows: 2\n")
    run = read_run(path)
    assert_allclose(run.q, _Q)
    assert run.error_at(0, "q_1", "").key == "row 4, column q_1"


@pytest.mark.parametrize(
    ("header", "columns"),
    [
        ("stamp,pos_0,pos_1,eff_0,eff_1", "{time: stamp, q: 'pos_{}', tau: 'eff_{}'}"),
        ("stamp,pos_1,pos_2,eff_1,eff_2", "{time: stamp, q: 'pos_{}', tau: 'eff_{}'}"),
        ("t [s],base.q,arm.q,base.tau,arm.tau", "{time: 't [s]', q: [base.q, arm.q], tau: [base.tau, arm.tau]}"),
    ],
)
def test_names_of_a_log_are_mapped(tmp_path, header, columns):
    run = read_run(_write(tmp_path, header, [_TIMES, _Q, _TAU], f"columns: {columns}\n"))
    assert_allclose(run.times, _TIMES)
    assert_allclose(run.q, _Q)
    assert_allclose(run.signal, _TAU)


def test_missing_files_are_named(tmp_path):
    assert "run.csv: does not exist" in refuse(read_run, tmp_path / "run.csv")
    (tmp_path / "run.csv").write_text("time,q_1\n")
    said = refuse(read_run, tmp_path / "run.csv")
    assert "has no description: run.yaml in the same folder must state at least the joints" in said


@pytest.mark.parametrize("plugin", ["SQLITE3", "MCAP"])
def test_ros_bags_of_both_kinds(tmp_path, plugin):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    JointState, Wrench = store.types["sensor_msgs/msg/JointState"], store.types["geometry_msgs/msg/WrenchStamped"]
    Header, Time = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    Vector, Both = store.types["geometry_msgs/msg/Vector3"], store.types["geometry_msgs/msg/Wrench"]
    path = tmp_path / "bag"
    with rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[plugin]) as writer:
        states = writer.add_connection("/joint_states", JointState.__msgtype__, typestore=store)
        wrenches = writer.add_connection("/wrench", Wrench.__msgtype__, typestore=store)
        for k, time in enumerate(_TIMES):
            nanoseconds = round(1e9 * time) + 10**9
            header = Header(stamp=Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9), frame_id="")
            order = [0, 1] if k % 2 else [1, 0]  # a sender may list its joints as it likes, but for the first time
            order = order if k else [0, 1]
            message = JointState(header, [("a", "b")[i] for i in order], _Q[k, order], np.array([]), _TAU[k, order])
            writer.write(states, nanoseconds, store.serialize_cdr(message, JointState.__msgtype__))
            force, torque = Vector(1.0, 2.0, 3.0 + k), Vector(4.0, 5.0, 6.0)
            writer.write(
                wrenches, nanoseconds, store.serialize_cdr(Wrench(header, Both(force, torque)), Wrench.__msgtype__)
            )
    described = path.with_suffix(".yaml")
    described.write_text("signal: motor_torque\ntopic: /joint_states\n")
    run = read_run(path)
    assert run.description.joint_names == ("a", "b")
    assert_allclose(run.times, _TIMES + 1.0, atol=1e-9)
    assert_allclose(run.q, _Q)
    assert_allclose(run.signal, _TAU)
    assert run.v is None
    described.write_text("signal: wrench\nwrench_topic: /wrench\n")
    assert_allclose(read_run(path).signal[3], [1.0, 2.0, 6.0, 4.0, 5.0, 6.0])
    described.write_text("signal: current\n")
    assert_allclose(read_run(path).signal, _TAU)
    described.write_text("topic: /joint_states\n")
    assert "signal: is missing: the efforts in a bag may be" in refuse(read_run, path)
    described.write_text("signal: current\ntopic: /joints\n")
    said = refuse(read_run, path)
    assert "topic: is '/joints', must be a topic of sensor_msgs/msg/JointState: /joint_states" in said


def test_where_the_object_is_held_is_turned_about_fixed_axes_x_then_y_then_z(tmp_path):
    columns = [_TIMES, _Q, _TAU]
    placed = "object_pose: {position: [0.1, 0, -0.2], rpy_deg: [30, -40, 50]}\n"
    pose = read_run(_write(tmp_path, _HEADER, columns, placed)).description.object_pose
    expected = RigidTransform(RollPitchYaw(np.radians([30.0, -40.0, 50.0])), [0.1, 0.0, -0.2])
    assert_allclose(pose, expected.GetAsMatrix4(), atol=1e-12)
    assert_allclose(read_run(_write(tmp_path, _HEADER, columns, "")).description.object_pose, np.eye(4))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (
            "signal: torque",
            "run.yaml: signal: is 'torque', must be one of joint_torque, motor_torque, current, wrench; did you mean"
            " 'joint_torque' or 'motor_torque'?",
        ),
        ("signel: current", "run.yaml: signel: is not a key known here"),
        ("units: {q: grad}", "units.q: is 'grad', must be rad or deg"),
        (
            "signal: current",
            "run.csv: columns: has no columns of the signal current, must have current_1 to current_2; has tau_1,"
            " which fits signal: joint_torque or signal: motor_torque",
        ),
        (
            "signal: wrench",
            "columns: has no columns of the signal wrench, must have fx, fy, fz, tx, ty, tz; has tau_1",
        ),
        ("columns: [time, q_1]", "run.yaml: columns: lists 2 names, must list the 5 columns of run.csv"),
        ("columns: [time, 3]", "columns[1]: is 3, must be a non-empty text"),
        ("columns: {tork: x}", "columns: is 'tork', must be one of time, q, v"),
        ("columns: {q: [1, 2]}", "columns.q: is [1, 2], must be a name"),
        ("columns: frankalib", "columns: is 'frankalib', must be a list of names, a mapping, or standard"),
        ("skip_rows: 2.5", "skip_rows: is 2.5, must be a whole number"),
        ("compensates: legs", "compensates: is 'legs', must be nothing or arm or gravity"),
        ("wrench_axes: world", "wrench_axes: is 'world', must be sensor or base"),
        ("force_on: [robot]", "force_on: is ['robot'], must be object or robot"),
        ("object_pose: {rpy_deg: [0, 0, 1]}", "object_pose.position: is missing"),
        ("compensated_payload: {mass: -1, com: [0, 0, 0]}", "compensated_payload.mass: is -1, must be from 0"),
        ("gravity: [0, 0, -98.1]", "gravity[2]: is -98.1, must be from -20 to 20"),
    ],
)
def test_mistake_in_a_description_is_refused(tmp_path, more, said):
    assert said in refuse(read_run, _write(tmp_path, _HEADER, [_TIMES, _Q, _TAU], more))


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("time,q_1,q_2,tau_1,tau_3", "column tau_2: is missing, although there are tau_1"),
        ("time,q_1,q_3,tau_1,tau_2", "column q_2: is missing: has time, q_1, q_3, tau_1, tau_2; list other names"),
        (
            "time,pos1,pos2,tau_1,tau_2",
            "column q_1: is missing: has time, pos1, pos2, tau_1, tau_2; list other names under columns, as in"
            " 'columns: {q: \"pos{}\"}'",
        ),
        ("time,action_1,action_2,j1,j2", "as in 'columns: {q: \"j{}\"}'"),
        (
            "stamp,q_1,q_2,tau_1,tau_2",
            "column time: is missing: has stamp, q_1, q_2, tau_1, tau_2; list another name under columns, as in"
            " 'columns: {time: stamp}'",
        ),
        ("t,q_1,q_2,tau_1,tau_2", "column time: is missing"),
        ("time,q_1,q_2,q_3,tau_1", "column q_3: has q_3, must have as many joints as the 2 of run.yaml"),
        ("", "row 1: contains no column names"),
        ("time,q_1,q_2,x,y", "columns: has no signal"),
    ],
)
def test_columns_that_are_missing_are_named(tmp_path, header, said):
    assert said in refuse(read_run, _write(tmp_path, header, [_TIMES, _Q, _TAU], ""))


def test_joints_of_a_table_must_be_listed(tmp_path):
    path = _write(tmp_path, _HEADER, [_TIMES, _Q, _TAU], "")
    path.with_suffix(".yaml").write_text("signal: joint_torque\n")
    assert "run.yaml: joints: is missing: must list the joints in the order of the columns" in refuse(read_run, path)


@pytest.fixture
def parts(tmp_path):
    """Writes a run as a whole and in three parts, with descriptions of both; returns the folder."""
    times = np.arange(60) * 0.01
    rows = np.column_stack([times, np.sin(times), np.cos(times), 5.0 + times, -times])

    def write(name, rows):
        np.savetxt(tmp_path / name, rows, delimiter=",", header=_HEADER, comments="")

    write("whole.csv", rows)
    for number, part in enumerate(np.split(rows, [25, 40])):
        write(f"part_{number}.csv", part)
    (tmp_path / "whole.yaml").write_text(_PARTS)
    (tmp_path / "split.yaml").write_text(_PARTS + "files: [part_0.csv, part_1.csv, part_2.csv]\n")
    return tmp_path


def test_parts_are_the_recording_that_was_split(parts):
    whole, split = read_run(parts / "whole.csv"), read_run(parts / "split.yaml")
    for name in ("times", "q", "signal"):
        np.testing.assert_array_equal(getattr(split, name), getattr(whole, name))
    assert split.source == str(parts / "split.yaml")
    assert split.rows.tolist() == [*range(2, 27), *range(28, 43), *range(44, 64)]


@pytest.mark.parametrize(
    ("files", "said"),
    [
        (
            "[part_1.csv, part_0.csv]",
            "time: begins at 0.000000, must be later than the end of part_1.csv",
        ),
        ("[part_0.csv, part_0.csv]", "time: begins at 0.000000, must be later than the end of part_0.csv"),
        ("[part_0.csv, other.csv]", "other.csv: columns: differ from those of part_0.csv: are current_1, current_2"),
        ("[part_0.csv, bare.csv]", "bare.csv: columns: differ from those of part_0.csv"),
        ("[part_0.csv, part_3.csv]", "split.yaml: files[1]: is 'part_3.csv', must be the name of a file in the"),
        ("[../part_0.csv]", "files[0]: is '../part_0.csv', must be the name of a file in the same folder"),
        ("[]", "split.yaml: files: must list the parts of a recording if split.yaml is given as the run"),
        ("[part_0.csv, gap.csv]", "split.yaml: row 28, column time: jumps by"),
        ("part_0.csv", "files"),
    ],
)
def test_files_that_are_no_parts_of_one_recording_are_refused(parts, files, said):
    (parts / "split.yaml").write_text(_PARTS + f"files: {files}\n")
    whole = (parts / "part_1.csv").read_text()
    (parts / "other.csv").write_text(whole.replace("tau", "current"))
    (parts / "bare.csv").write_text(whole.partition("\n")[2])
    (parts / "gap.csv").write_text((parts / "part_2.csv").read_text().replace("e-01,", "e+01,"))
    assert said in refuse(read_run, parts / "split.yaml")


def test_a_description_of_parts_is_no_description_of_another_table(parts):
    said = refuse(read_run, parts / "whole.csv", parts / "split.yaml")
    assert "split.yaml: files: must list the parts of a recording if split.yaml is given as the run, and only" in said


def test_rows_of_a_stay_are_averaged_and_passages_are_left_out(tmp_path):
    passages = [np.linspace(_HELD[i], _HELD[i + 1], 10)[1:-1] for i in range(3)]
    stays = [np.repeat(_HELD[i : i + 1], length, axis=0) for i, length in enumerate((50, 30, 9, 5))]
    q = np.concatenate([stays[0], passages[0], stays[1], passages[1][:4], stays[2], passages[2][:4], stays[3]])
    signal = np.tile(np.arange(len(q), dtype=float)[:, None], 6)
    path = write_table(tmp_path / "run.csv", q, signal, is_wrench=True, more="postures: true\n")
    run = read_run(path)
    assert run.signal[:, 0].tolist() == pytest.approx([24.5, 72.5, 96.0, 107.0])
    assert run.rows is not None
    assert run.rows.tolist() == [2, 60, 94, 107]
    assert run.notes == ("110 rows show 4 postures, 16 rows in motion are left out",)


@pytest.mark.parametrize("is_wrench", [False, True])
def test_a_table_of_postures_needs_no_time(tmp_path, is_wrench):
    run = read_run(write_table(tmp_path / "run.csv", _HELD, _FELT, is_wrench=is_wrench))
    assert run.description.postures
    assert run.q == pytest.approx(_HELD, abs=1e-6)
    assert run.signal == pytest.approx(_FELT, abs=1e-6)
    assert "6 postures" in repr(run)


def test_a_recording_of_stays_is_read_as_postures_if_it_says_so(tmp_path):
    q, signal = np.repeat(_HELD, 40, axis=0), np.repeat(_FELT, 40, axis=0)
    time = 0.02 * np.arange(len(q))
    path = write_table(tmp_path / "run.csv", q, signal, is_wrench=True, time=time, more="postures: true\n")
    run = read_run(path)
    assert len(run.q) == 6
    assert run.rows is not None
    assert run.rows.tolist() == [2 + 40 * i for i in range(6)]
    assert run.notes == ("240 rows show 6 postures",)


@pytest.mark.parametrize(
    ("q", "more", "said"),
    [
        (
            np.linspace(_HELD[0], _HELD[1], 60),
            "",
            "column time: is missing: .*needs none if the description has 'postures: true'",
        ),
        (_HELD, "postures: false\n", "column time: is missing"),
        (_HELD[:3], "postures: true\n", "has 3 postures, must have at least 4"),
    ],
)
def test_a_table_without_time_that_holds_no_postures_is_refused(tmp_path, q, more, said):
    signal = np.resize(_FELT, (len(q), 6))
    path = write_table(tmp_path / "run.csv", q, signal, is_wrench=True, more=more)
    assert re.search(said, refuse(read_run, path))
