"""Tables as arrays: what is read is what was written, and hostile files are refused in one line without memory."""

import io
import json
import struct
import tracemalloc
import zipfile
import zlib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from helpers.refusals import refuse
from scipy.io import savemat

from affordance.extensions.payload.recording import run_arrays
from affordance.extensions.payload.recording.run_arrays import read_arrays, read_lerobot
from affordance.extensions.payload.recording.run_file import read_run
from affordance.files import bounded

_TIMES = 0.01 * np.arange(200)
_Q = np.sin(_TIMES)[:, None] + [0.0, 1.0]
_TAU = np.cos(_TIMES)[:, None] * [1.0, 2.0]
_DESCRIPTION = "joints: [a, b]\nsignal: joint_torque\n"


def _write(folder, suffix):
    path = folder / f"run{suffix}"
    tables = {"time": _TIMES, "q": _Q, "tau": _TAU}
    if suffix == ".npz":
        np.savez(path, **tables, rate=100.0)
    elif suffix == ".mat":
        savemat(path, {**tables, "rate": 100.0}, do_compression=True)
    else:
        lists = {name: list(values) if values.ndim == 2 else values for name, values in tables.items()}
        pq.write_table(pa.table({**lists, "task": ["lift"] * len(_TIMES)}), path)
    path.with_suffix(".yaml").write_text(_DESCRIPTION)
    return path


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".parquet"])
def test_a_run_is_read_as_it_was_written(tmp_path, suffix):
    run = read_run(_write(tmp_path, suffix))
    for values, expected in ((run.times, _TIMES), (run.q, _Q), (run.signal, _TAU)):
        np.testing.assert_allclose(values, expected, atol=1e-12)


def test_columns_have_the_log_s_own_names_counted_from_0(tmp_path):
    path = tmp_path / "run.npz"
    columns = {f"pos_{i}": _Q[:, i] for i in range(2)} | {f"eff_{i}": _TAU[:, i] for i in range(2)}
    np.savez(path, stamp=_TIMES, **columns)
    own = 'columns: {time: stamp, q: "pos_{}", tau: "eff_{}"}\n'
    path.with_suffix(".yaml").write_text(_DESCRIPTION + own)
    np.testing.assert_allclose(read_run(path).q, _Q)


def test_matrices_of_matlab_may_have_time_along_their_rows(tmp_path):
    path = tmp_path / "run.mat"
    savemat(path, {"time": _TIMES, "q": _Q.T, "tau": _TAU.T})
    path.with_suffix(".yaml").write_text(_DESCRIPTION)
    np.testing.assert_allclose(read_run(path).q, _Q)


def _zip(path, content):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("q.npy", content)
    return path


def _build_npy(shape, data=b"\0" * 80):
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"shape": shape, "fortran_order": False, "descr": "<f8"})
    return file.getvalue() + data


def _write_hostile(folder, kind):
    path = folder / f"hostile{kind.partition(' ')[0]}"
    if kind == ".npz object":
        np.savez(path, q=np.array([{"a": 1}], dtype=object))
    elif kind == ".npz promise":
        _zip(path, _build_npy((10**12,)))
    elif kind == ".npz bomb":
        _zip(path, _build_npy((10**7,), b"\0" * 80_000_000))
    elif kind == ".mat structure":
        savemat(path, {"run": {"q": _Q}})
    elif kind == ".mat cell":
        savemat(path, {"q": np.array([[1.0], "a"], dtype=object)})
    elif kind == ".mat bomb":
        head = b"MATLAB 5.0".ljust(124) + b"\x00\x01IM"
        packed = zlib.compress(b"\0" * 80_000_000)
        path.write_bytes(head + struct.pack("<II", 15, len(packed)) + packed)
    elif kind == ".mat 7.3":
        path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(200))
    elif kind == ".mat torn":
        savemat(path, {"q": _Q})
        path.write_bytes(path.read_bytes()[:300])
    elif kind == ".parquet bomb":
        pq.write_table(pa.table({"q": np.zeros(10**7)}), path)
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
        (".npz object", "holds object, must hold numbers"),
        (".npz promise", "declares 8e+12 bytes but has"),
        (".npz bomb", "unpacks to more than 20 MB"),
        (".npz noise", "is not a .npz file of numbers"),
        (".mat structure", "is of class struct, must be a matrix of numbers"),
        (".mat cell", "is of class cell, must be"),
        (".mat bomb", "unpacks to more than 20 MB"),
        (".mat 7.3", "save it with save(..., '-v7')"),
        (".mat noise", "is not a MATLAB 5 file"),
        (".mat torn", "hostile.mat"),
        (".parquet bomb", "unpacks to more than 20 MB"),
        (".parquet text", "has no column of numbers among task"),
        (".parquet missing", "lacks 1 values"),
        (".parquet noise", "is not a .parquet file of numbers"),
    ],
)
def test_hostile_files_are_refused_in_one_line_and_little_memory(tmp_path, kind, says, monkeypatch):
    path = _write_hostile(tmp_path, kind)
    monkeypatch.setattr(run_arrays, "_MOST", 20_000_000)  # a bomb of 400 MB takes longer to write than to refuse
    monkeypatch.setattr(bounded, "RECORDING", 10_000_000)  # as much is set aside for what a file may have
    tracemalloc.start()
    said = refuse(read_arrays, path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert says in said
    assert said.isprintable()
    assert peak < 60_000_000


def _write_lerobot(folder, features):
    (folder / "meta").mkdir()
    (folder / "data" / "chunk-000").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(json.dumps({"features": {name: {} for name in features}}))
    columns = {name: list(_TAU) for name in features}
    columns |= {"timestamp": np.tile(_TIMES[:100], 2), "episode_index": np.repeat([0, 1], 100)}
    pq.write_table(pa.table(columns), folder / "data" / "chunk-000" / "episode_000000.parquet")
    return folder


def test_a_lerobot_folder_is_refused_without_torque_and_its_first_episode_read_with_it(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    without = _write_lerobot(tmp_path / "a", ["observation.state", "action"])
    assert "without torques, currents or forces a load" in refuse(read_lerobot, without)
    table = read_lerobot(_write_lerobot(tmp_path / "b", ["observation.state", "observation.effort"]))
    assert len(table.values) == 100
    assert {"time", "observation.state_1", "observation.effort_2"} <= set(table.names)
