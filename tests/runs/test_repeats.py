import dataclasses
import functools
import importlib
import logging
import os
import shutil
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from helpers.changed_files import change_file

import affordance
from affordance.exceptions import AffordanceError, BadValueError, UnavailableError
from affordance.experiments import weight as weight_experiment
from affordance.extensions.people.experiments.lifts import lift
from affordance.files.bounded import read_bytes
from affordance.files.model_files import list_arm_files
from affordance.files.model_folder import MODELS
from affordance.runs import repeats
from affordance.runs.repeats import compute_key, end_processes, prepare_folder, run_batches, run_repeats, run_tasks


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


@pytest.mark.parametrize(
    "change",
    [
        lambda arrays: arrays.pop("square"),
        lambda arrays: arrays.update(square=arrays["square"][None]),
        lambda arrays: arrays.update(square=np.array(["9"])),
        lambda arrays: arrays.update(other=arrays["square"]),
    ],
    ids=["missing", "shape", "text", "more"],
)
def test_a_stored_repeat_that_was_changed_is_set_aside_and_run_again(tmp_path, caplog, change):
    first = run(tmp_path)
    path = tmp_path / "repeat_00003.npz"
    with np.load(path) as archive:
        arrays = dict(archive)
    change(arrays)
    np.savez(path, **arrays)
    np.testing.assert_array_equal(run(tmp_path)["square"], first["square"])
    assert "repeat_00003.npz has other arrays than were stored; set aside as repeat_00003.broken" in caplog.text


def test_a_pipe_among_stored_repeats_is_set_aside(tmp_path, caplog):
    os.mkfifo(tmp_path / "repeat_00000.npz")
    assert len(run(tmp_path, repeats=1)["square"]) == 1
    assert "is no file; set aside" in caplog.text


def test_arrays_are_kept_however_they_lie_in_memory(tmp_path):
    def strided(repeat):
        return {"x": np.arange(12.0).reshape(3, 4)[:, 1::2].T, "y": np.array(2.0), "z": np.array(["a", "bc"])[:1]}

    first = run(tmp_path, strided, repeats=1)
    np.testing.assert_array_equal(run(tmp_path, refuse, repeats=1)["x"], first["x"])


def square_all(asked, repeats):
    asked.append(len(repeats))
    return [square(repeat) for repeat in repeats]


def test_batches_are_as_large_as_they_may_be_and_kept_one_by_one(tmp_path):
    asked = []
    run(tmp_path, repeats=2)
    function = functools.partial(square_all, asked)
    found = run_batches(tmp_path, function, repeats=10, jobs=1, description="test", at_once=3)
    np.testing.assert_array_equal([each["square"][0] for each in found], np.arange(10) ** 2)
    assert asked == [3, 3, 2]  # two were kept
    assert len(list(tmp_path.glob("repeat_*.npz"))) == 10


def fail_at_one_of_all(repeats):
    return [fail_at_one(AffordanceError("cannot be answered"), repeat) for repeat in repeats]


def test_one_of_a_batch_that_fails_takes_no_other_with_it(tmp_path, caplog):
    with pytest.raises(AffordanceError, match="cannot be answered"):
        run_batches(tmp_path, fail_at_one_of_all, repeats=5, jobs=1, description="test", at_once=5)
    assert [path.stem for path in sorted(tmp_path.iterdir())] == [f"repeat_0000{each}" for each in (0, 2, 3, 4)]
    assert "observer 1 of 5 could not be run (1 failed in all); the results of the 4 others are kept" in caplog.text


def fail_at_one(error, repeat):
    if repeat == 1:
        raise error
    return square(repeat)


def test_repeat_that_fails_takes_no_other_with_it(tmp_path, caplog):
    with pytest.raises(AffordanceError, match="cannot be answered"):
        run(tmp_path, functools.partial(fail_at_one, AffordanceError("cannot be answered")))
    assert [path.stem for path in sorted(tmp_path.iterdir())] == [f"repeat_0000{each}" for each in (0, 2, 3, 4)]
    assert (
        "test: observer 1 of 5 could not be run (1 failed in all); the results of the 4 others are kept"
        in caplog.text
    )
    with pytest.raises(AssertionError, match="repeat 1 was to be kept"):
        run(tmp_path, refuse)


def test_what_is_missing_on_the_machine_ends_a_run_at_once(tmp_path):
    with pytest.raises(UnavailableError):
        run(tmp_path, functools.partial(fail_at_one, UnavailableError("rendering", "no display")))
    assert len(list(tmp_path.iterdir())) == 1


@pytest.fixture
def in_two_processes():
    """The number of jobs; ends their processes."""
    yield 2
    end_processes()


def test_repeats_run_in_other_processes(tmp_path, in_two_processes):
    pids = run(tmp_path, repeats=4, jobs=in_two_processes)["pid"]
    assert os.getpid() not in pids


def test_processes_that_were_ended_serve_no_others_and_are_gone(tmp_path, in_two_processes):
    first = run(tmp_path / "first", repeats=6, jobs=in_two_processes)["pid"]
    end_processes()
    assert not any(psutil.pid_exists(int(pid)) for pid in np.unique(first))
    second = run(tmp_path / "second", repeats=6, jobs=in_two_processes)["pid"]
    assert not np.intersect1d(first, second).size


def sleep_and_name(number):
    """Sleeps for a time that is shorter for later numbers."""
    time.sleep(0.05 * (5 - number))
    return number, os.getpid()


def test_tasks_come_back_in_their_order_from_other_processes(in_two_processes):
    done = run_tasks([functools.partial(sleep_and_name, k) for k in range(6)], jobs=in_two_processes, description="t")
    assert [number for number, _ in done] == [0, 1, 2, 3, 4, 5]
    assert os.getpid() not in {pid for _, pid in done}
    assert run_tasks([], jobs=2, description="none") == []
    assert run_tasks([lambda: 3], jobs=1, description="one") == [3]


def fail(repeat):
    raise BadValueError("file", "key", f"is {repeat}")


def test_error_of_a_task_is_that_of_the_caller(in_two_processes):
    with pytest.raises(BadValueError, match=r"^file: key: is 0$"):
        run_tasks([functools.partial(fail, 0)] * 2, jobs=in_two_processes, description="test")


def test_unreadable_repeat_is_set_aside_and_run_again(tmp_path, caplog):
    run(tmp_path)
    victim = tmp_path / "repeat_00003.npz"
    victim.write_bytes(victim.read_bytes()[:40])
    (tmp_path / "repeat_00001.npz").write_text("not an archive", encoding="utf-8")
    with caplog.at_level(logging.WARNING):
        np.testing.assert_array_equal(run(tmp_path)["square"], [[0], [1], [4], [9], [16]])
    assert "repeat_00003.npz could not be read" in caplog.text
    assert (tmp_path / "repeat_00003.broken").exists()
    assert (tmp_path / "repeat_00001.broken").exists()


def test_key_changes_with_configuration_and_models(weight, models):
    key = compute_key(weight, MODELS)
    assert compute_key(weight, MODELS) == key
    assert compute_key(weight._replace(tools=weight.tools[1:]), MODELS) != key
    finer = dataclasses.replace(weight.settings, control_period=0.004)
    assert compute_key(weight._replace(settings=finer), MODELS) != key
    assert compute_key(weight, models) == key
    (models / "README.md").write_text("not a model", encoding="utf-8")
    assert compute_key(weight, models) == key
    change_file(models / "arm.sdf", "0.3274", "0.3275")
    assert compute_key(weight, models) != key


@pytest.fixture
def program(tmp_path, monkeypatch):
    """A copy of this very program, whose key is computed."""
    folder = tmp_path / "affordance"
    shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr("affordance.runs.repeats._PACKAGE", folder)
    return folder


PACKAGE = Path(affordance.__file__).parent
SOURCES = sorted(str(path.relative_to(PACKAGE)) for path in PACKAGE.rglob("*.py"))
ONLY_REPORT = [name for name in SOURCES if name.split("/")[0] in ("commands", "reporting")]


def test_key_stays_where_only_what_reports_changes(program):
    """The key does not change with a caption, which would otherwise discard the repeats of a night."""
    assert len(ONLY_REPORT) > 10
    key = compute_key("", MODELS)
    for name in (*ONLY_REPORT, "reporting/templates/report.html.j2"):
        path = program / name
        path.write_text(f"{path.read_text(encoding='utf-8')}# another caption")
    (program / "reporting" / "more.py").write_text("MORE = True", encoding="utf-8")
    assert compute_key("", MODELS) == key


def test_key_of_a_program_from_elsewhere_counts_the_extensions(program):
    keys = [compute_key("", (), each) for each in (weight_experiment.observe, square)]
    path = program / "extensions" / "people" / "participant.py"
    path.write_text(f"{path.read_text(encoding='utf-8')}# another number")
    again = [compute_key("", (), each) for each in (weight_experiment.observe, square)]
    assert again[0] == keys[0]
    assert again[1] != keys[1]


def test_key_changes_with_every_other_source(program, monkeypatch):
    read = []
    monkeypatch.setattr(repeats, "read_bytes", lambda path, *rest: read.append(path) or read_bytes(path, *rest))
    keys = [compute_key("", ())]
    deciding = [
        program / name
        for name in SOURCES
        if name not in ONLY_REPORT and not {*Path(name).parts} & {"commands", "reporting", "extensions"}
    ]
    assert {*read} == {*deciding}
    assert len(deciding) > 80
    for path in deciding[:: len(deciding) // 10]:
        path.write_text(f"{path.read_text(encoding='utf-8')}# another number")
        keys.append(compute_key("", ()))
    assert len(set(keys)) == len(keys) > 10
    (program / "belief" / "more.py").write_text("MORE = True", encoding="utf-8")
    assert compute_key("", ()) not in keys
    moved = program / "belief" / "moved.py"
    (program / "belief" / "more.py").rename(moved)
    assert compute_key("", ()) not in keys


def test_key_changes_with_every_model(models):
    keys = [compute_key("", models)]
    key = keys[0]
    decides_nothing = ("demo", "tasks")
    for folder in decides_nothing:
        for path in sorted((models / folder).iterdir()):
            path.write_bytes(path.read_bytes() + b" ")
    assert compute_key("", models) == key
    deciding = [path for path in models.rglob("*") if path.parent.name not in (*decides_nothing, "__pycache__")]
    for path in sorted(path for path in deciding if path.is_file() and path.suffix not in (".md", ".py", ".txt")):
        path.write_bytes(path.read_bytes() + b" ")
        keys.append(compute_key("", models))
    assert len(keys) > 8
    assert len(set(keys)) == len(keys)


def test_key_stays_where_a_file_is_added_that_nothing_reads(models):
    key = compute_key("", models)
    stray = ("notes.txt", "arm.sdf~", "tools/__pycache__/weight.pyc", "workshop/__pycache__/x.pyc")
    for name in (*stray, "workshop/meshes/y.obj", ".DS_Store", "tools/.weight.yaml.swp", "results/metrics.json"):
        (models / name).parent.mkdir(exist_ok=True)
        (models / name).write_bytes(b"stray")
    assert compute_key("", models) == key


def test_key_of_an_experiment_is_of_what_it_reads(weight, models):
    """Objects and tasks held by the configuration are not read from the folder for the key; the arm's files are."""
    key = compute_key(weight, list_arm_files(models / "arm.dmd.yaml"))
    (models / "tools" / "mine.yaml").write_text("tools: []", encoding="utf-8")
    (models / "nail.yaml").write_text("none", encoding="utf-8")
    assert compute_key(weight, list_arm_files(models / "arm.dmd.yaml")) == key
    with (models / "arm.sdf").open("a", encoding="utf-8") as file:
        file.write("<!-- another arm -->")
    assert compute_key(weight, list_arm_files(models / "arm.dmd.yaml")) != key


def test_key_changes_with_the_versions_of_libraries(monkeypatch):
    key = compute_key("", MODELS)
    monkeypatch.setattr("affordance.runs.repeats.list_versions", lambda: {"numpy": "0"})
    assert compute_key("", MODELS) != key


def test_extensions_count_if_one_of_them_is_run(program):
    def compute(run):
        return compute_key(None, (), run)

    keys = compute(weight_experiment.observe), compute(lift)
    for path in (program / "extensions").rglob("*.py"):
        path.write_text(f"{path.read_text(encoding='utf-8')}# another number")
    assert compute(weight_experiment.observe) == keys[0]
    assert compute(lift) != keys[1]


def test_key_depends_on_the_whole_package_of_a_program(tmp_path, monkeypatch):
    (tmp_path / "mine" / "commands").mkdir(parents=True)
    for name in ("mine/__init__.py", "mine/commands/__init__.py", "mine/other.py"):
        (tmp_path / name).touch()
    (tmp_path / "mine" / "commands" / "run.py").write_text("def run():\n    pass\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    run = importlib.import_module("mine.commands.run").run
    keys = [compute_key(None, MODELS, run)]
    for name in ("other.py", "commands/run.py"):
        (tmp_path / "mine" / name).write_text("DURATION = 2.0", encoding="utf-8")
        keys.append(compute_key(None, MODELS, run))
    assert len(set(keys)) == 3
    assert compute_key(None, MODELS) not in keys


def test_folder_for_results_is_made(tmp_path):
    assert prepare_folder(tmp_path / "a" / "b").is_dir()
    assert prepare_folder(tmp_path / "a" / "b").is_dir()


def test_path_that_is_or_lies_below_a_file_is_refused(tmp_path):
    file = tmp_path / "file"
    file.write_text("", encoding="utf-8")
    for path in (file, file / "below"):
        with pytest.raises(BadValueError, match=r"--out: is '.*', which is a file or is inside one, must be"):
            prepare_folder(path)
    assert file.read_text(encoding="utf-8") == ""


def test_folder_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(BadValueError, match=r"--out: is '.*', which is not writable"):
        prepare_folder(tmp_path)


def test_progress_is_not_written_into_a_file(tmp_path, capfd):
    """Standard error is no terminal here, and a bar would fill a log with hundreds of lines."""
    run(tmp_path, jobs=1)
    run_tasks([functools.partial(square, repeat) for repeat in range(3)], jobs=1, description="test")
    assert capfd.readouterr().err == ""
