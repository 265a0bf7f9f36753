"""Tables of recordings are read as they were written, or refused in one line that names row and column."""

import json
import zipfile

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from helpers.refusals import refuse

from affordance.extensions.payload.recording.run_file import read_run
from affordance.extensions.payload.recording.run_table import read_arrays, read_lerobot, read_text
from affordance.files import bounded

_TIMES = 0.01 * np.arange(200)
_Q = np.sin(_TIMES)[:, None] + [0.0, 1.0]
_TAU = np.cos(_TIMES)[:, None] * [1.0, 2.0]
_DESCRIPTION = "joints: [a, b]\nsignal: joint_torque\n"


@pytest.fixture
def write(tmp_path):
    def write(content, name="run.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_rows_numbers_and_names_are_as_in_the_file(write):
    table = read_text(write('\ufefftime;"q 1"\r\n0;1.5\r\n\r\n0.1;2e-3\r\n'))
    assert list(table.columns) == ["time", "q 1"]
    np.testing.assert_array_equal(table, [[0.0, 1.5], [0.1, 2e-3]])
    assert table.index.tolist() == [2, 4]
    table = read_text(write("0  1\n0.1   2\n"))
    assert (list(table.columns), table.index.tolist()) == (["", ""], [1, 2])
    assert read_text(write("time,q\n")).shape == (0, 2)


def test_numbers_are_read_to_the_last_digit(write, rng):
    values = rng.standard_normal((1000, 2)) * 10.0 ** rng.integers(-8, 8, (1000, 2))
    text = "\n".join(",".join(map(repr, row)) for row in values.tolist())
    np.testing.assert_array_equal(read_text(write(text)), values)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("", "is empty"),
        ("\n\n", "is empty"),
        (b"\x80\x81", "is not a text file in UTF-8"),
        ("time,q\n" + "1" * 50 + ",x\n", "row 2, column q: is 'x', must be a finite number"),
        ("time,q\n0,abcdefghijklmnopqrstuvwxyzabcdefghij\n", "is 'abcdefghijklmnopqrstuvwxyzabcd', must be"),
        ("time;q\n0,5;1\n", "row 2, column time: is '0,5', must be a finite number with a decimal point, 0.5"),
        ("time,q\n0,1\n0.1,nan\n", "row 3, column q: is 'nan', must be a finite number"),
        ("time,q\n0,1\n0.1,2,3\n", "row 3: has 3 values, must have 2"),
        ("time,q\n0,1\n0.1\n", "row 3: has 1 values, must have 2, one per column"),
        ("robot 7\ntime,q,tau\n0,1,2\n", "row 2: has 1 values, must have 2, one per column (skip_rows: N skips"),
    ],
)
def test_text_that_is_no_table_is_one_line(write, content, problem):
    said = refuse(read_text, write(content))
    assert "run.csv" in said
    assert problem in said


def test_recordings_are_bounded_in_size(write, monkeypatch):
    monkeypatch.setattr(bounded, "RECORDING", 1000)
    assert "has 0.002 MB, must have at most 0.001 MB" in refuse(read_text, write("1,2\n" * 500))


def _write_arrays(folder, suffix):
    path = folder / f"run{suffix}"
    tables = {"time": _TIMES, "q": _Q, "tau": _TAU}
    if suffix == ".npz":
        np.savez(path, **tables, rate=100.0)
    else:
        lists = {name: list(values) if values.ndim == 2 else values for name, values in tables.items()}
        pq.write_table(pa.table({**lists, "task": ["lift"] * len(_TIMES)}), path)
    path.with_suffix(".yaml").write_text(_DESCRIPTION)
    return path


@pytest.mark.parametrize("suffix", [".npz", ".parquet"])
def test_a_run_is_read_as_it_was_written(tmp_path, suffix):
    run = read_run(_write_arrays(tmp_path, suffix))
    for values, expected in ((run.times, _TIMES), (run.q, _Q), (run.signal, _TAU)):
        np.testing.assert_array_equal(values, expected)


def test_columns_have_the_log_s_own_names_counted_from_0(tmp_path):
    path = tmp_path / "run.npz"
    columns = {f"pos_{i}": _Q[:, i] for i in range(2)} | {f"eff_{i}": _TAU[:, i] for i in range(2)}
    np.savez(path, stamp=_TIMES, **columns)
    own = 'columns: {time: stamp, q: "pos_{}", tau: "eff_{}"}\n'
    path.with_suffix(".yaml").write_text(_DESCRIPTION + own)
    np.testing.assert_array_equal(read_run(path).q, _Q)


def _write_hostile(folder, kind):
    path = folder / f"hostile{kind.partition(' ')[0]}"
    if kind == ".npz object":
        np.savez(path, q=np.array([{"a": 1}], dtype=object))
    elif kind == ".npz bomb":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("q.npy", b"\0" * 2_000_000)
    elif kind == ".npz lengths":
        np.savez(path, time=_TIMES, tau=_TIMES, q=_TIMES[1:])
    elif kind == ".parquet bomb":
        pq.write_table(pa.table({"q": np.zeros(10**5), "tau": [[0.0, 0.0]] * 10**5}), path)
    elif kind == ".parquet text":
        pq.write_table(pa.table({"task": ["a"]}), path)
    elif kind == ".parquet missing":
        pq.write_table(pa.table({"q": [1.0, None]}), path)
    else:
        path.write_bytes(b"no such file \x1b[31m")
    return path


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        (".npz object", "is not a .npz file of numbers"),
        (".npz bomb", "unpacks to 2 MB, must be at most 1 MB"),
        (".npz lengths", "q: has shape (199,), must have the 200 samples of the others"),
        (".npz noise", "is not a .npz file of numbers"),
        (".parquet bomb", "unpacks to 2.4 MB, must be at most 1 MB"),
        (".parquet text", "has no array of numbers along time"),
        (".parquet missing", "q: lacks a value"),
        (".parquet noise", "is not a .parquet file of numbers"),
    ],
)
def test_files_that_are_no_table_are_refused_in_one_line(tmp_path, kind, says, monkeypatch):
    monkeypatch.setattr(bounded, "RECORDING", 1_000_000)
    said = refuse(read_arrays, _write_hostile(tmp_path, kind))
    assert says in said
    assert said.isprintable()


def _write_lerobot(folder, names):
    (folder / "meta").mkdir(parents=True)
    (folder / "data" / "chunk-000").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(json.dumps({"features": {name: {} for name in names}}))
    columns = {name: list(_TAU) for name in names}
    columns |= {"timestamp": np.tile(_TIMES[:100], 2), "episode_index": np.repeat([0, 1], 100)}
    pq.write_table(pa.table(columns), folder / "data" / "chunk-000" / "episode_000000.parquet")
    return folder


def test_a_lerobot_folder_is_refused_without_torque_and_its_first_episode_read_with_it(tmp_path):
    without = _write_lerobot(tmp_path / "a", ["observation.state", "action"])
    assert "without torques, currents or forces a load" in refuse(read_lerobot, without)
    names = ["action", "observation.state", "observation.effort"]
    table = read_lerobot(folder := _write_lerobot(tmp_path / "b", names))
    assert len(table) == 100
    assert {"time", "observation.state_1", "observation.effort_2"} <= set(table.columns)
    (description := tmp_path / "b.yaml").write_text(_DESCRIPTION)
    signal = read_run(folder, description).signal
    np.testing.assert_array_equal(signal, table[["observation.effort_1", "observation.effort_2"]])
