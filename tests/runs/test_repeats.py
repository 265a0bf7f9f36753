import dataclasses
import json
import logging
import os
import shutil
from enum import Enum
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from affordance.exceptions import BadValueError
from affordance.files.atomic import remove_leftovers, to_plain, write_atomic, write_json, write_text
from affordance.files.model_folder import MODELS
from affordance.runs.repeats import compute_key, end_processes, prepare_folder, run_repeats


def square(repeat):
    return {"square": np.array([repeat**2]), "pid": np.array([os.getpid()])}


def refuse(repeat):
    raise AssertionError(f"repeat {repeat} was to be kept, not run")


def run(folder, function=square, repeats=5, jobs=1):
    return run_repeats(folder, function, repeats=repeats, jobs=jobs, description="test")


def test_repeats_come_back_in_order_and_are_not_run_again(tmp_path):
    first = run(tmp_path)
    np.testing.assert_array_equal(first["square"], [[0], [1], [4], [9], [16]])
    again = run(tmp_path, refuse)
    np.testing.assert_array_equal(first["square"], again["square"])


def test_more_repeats_add_to_those_kept(tmp_path):
    run(tmp_path, repeats=2)
    run(tmp_path, repeats=6)
    assert len(list(tmp_path.glob("repeat_*.npz"))) == 6
    np.testing.assert_array_equal(run(tmp_path, refuse, repeats=3)["square"], [[0], [1], [4]])


def test_repeats_run_in_other_processes(tmp_path):
    pids = run(tmp_path, repeats=4, jobs=2)["pid"]
    assert os.getpid() not in pids


def test_processes_that_were_ended_serve_no_others(tmp_path):
    first = run(tmp_path / "first", repeats=6, jobs=2)["pid"]
    end_processes()
    second = run(tmp_path / "second", repeats=6, jobs=2)["pid"]
    assert not np.intersect1d(first, second).size


def test_unreadable_repeat_is_set_aside_and_run_again(tmp_path, caplog):
    run(tmp_path)
    victim = tmp_path / "repeat_00003.npz"
    victim.write_bytes(victim.read_bytes()[:40])
    (tmp_path / "repeat_00001.npz").write_text("not an archive")
    with caplog.at_level(logging.WARNING):
        np.testing.assert_array_equal(run(tmp_path)["square"], [[0], [1], [4], [9], [16]])
    assert "repeat_00003.npz could not be read" in caplog.text
    assert (tmp_path / "repeat_00003.broken").exists()
    assert (tmp_path / "repeat_00001.broken").exists()


def test_file_appears_whole_or_not_at_all(tmp_path):
    path = tmp_path / "deep" / "numbers.txt"

    def fail_halfway(temporary):
        temporary.write_text("half")
        raise RuntimeError("killed")

    with pytest.raises(RuntimeError, match="killed"):
        write_atomic(path, fail_halfway)
    assert list(path.parent.iterdir()) == []
    write_text(path, "whole")
    with pytest.raises(RuntimeError, match="killed"):
        write_atomic(path, fail_halfway)
    assert path.read_text() == "whole"


def test_leftovers_of_a_killed_run_are_removed(tmp_path):
    def leave(temporary):
        temporary.write_text("half")
        os.link(temporary, temporary.with_name(temporary.name + "x"))  # survives the clean-up of write_whole
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write_atomic(tmp_path / "a" / "numbers.txt", leave)
    write_text(tmp_path / "a" / "whole.txt", "whole")
    remove_leftovers(tmp_path)
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["whole.txt"]


class Colour(Enum):
    RED = "red"


class Pair(NamedTuple):
    a: float
    b: tuple


def test_configurations_become_plain_json(tmp_path):
    content = {"pair": Pair(1.5, (np.float64(0.1), np.array([1, 2]))), "colour": Colour.RED, "path": Path("a/b.yaml")}
    assert to_plain(content) == {"pair": {"a": 1.5, "b": [0.1, [1, 2]]}, "colour": "red", "path": "b.yaml"}
    write_json(tmp_path / "x.json", content)
    assert json.loads((tmp_path / "x.json").read_text())["pair"]["b"] == [0.1, [1, 2]]
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(tmp_path / "y.json", {"bad": np.nan})
    assert not (tmp_path / "y.json").exists()


def test_key_changes_with_configuration_and_models(weight, tmp_path):
    key = compute_key(weight, MODELS)
    assert compute_key(weight, MODELS) == key
    assert compute_key(dataclasses.replace(weight, seed=1), MODELS) != key
    finer = dataclasses.replace(weight.settings, control_period=0.004)
    assert compute_key(dataclasses.replace(weight, settings=finer), MODELS) != key
    copy = tmp_path / "models"
    shutil.copytree(MODELS, copy)
    assert compute_key(weight, copy) == key
    (copy / "arm.sdf").write_text((copy / "arm.sdf").read_text().replace("0.3274", "0.3275"))
    assert compute_key(weight, copy) != key


def test_key_depends_on_further_sources(weight, tmp_path):
    (tmp_path / "study.py").write_text("DURATION = 3.0")
    key = compute_key(weight, MODELS, tmp_path)
    assert key != compute_key(weight, MODELS)
    (tmp_path / "study.py").write_text("DURATION = 2.0")
    assert compute_key(weight, MODELS, tmp_path) != key


def test_folder_for_results_is_made(tmp_path):
    assert prepare_folder(tmp_path / "a" / "b").is_dir()
    assert prepare_folder(tmp_path / "a" / "b").is_dir()


def test_path_that_is_or_lies_below_a_file_is_refused(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    for path in (file, file / "below"):
        with pytest.raises(BadValueError, match=r"--out: is '.*', which is or lies below a file, must be a folder"):
            prepare_folder(path)
    assert file.read_text() == ""


def test_folder_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(BadValueError, match=r"--out: is '.*', which is not writable"):
        prepare_folder(tmp_path)
