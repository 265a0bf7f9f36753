"""Observers are kept; those that are kept are taken only while nothing that they run has changed."""

import copy
import dataclasses
import importlib
import os
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
import xarray as xr
from helpers.changed_files import change_file
from helpers.children import ROOT
from helpers.refusals import refuse

from affordance.arrays import about
from affordance.belief.learners import DENSITY, KINDS_MAP
from affordance.experiments.shared.observers import Setup, find_excursion, run_observers
from affordance.extensions.memory.simulated_trial import remember_in
from affordance.proprioception.torque_noise import WeberNoise
from affordance.runs.repeats import end_processes

# Program of a user in two files.
HELPER = "def scale(value):\n    return 2.0 * value\n"
PROGRAM = """
import xarray as xr
from my_helper import scale

def observe(setup, observer):
    return xr.Dataset({"value": ((), scale(1.0), {})})
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Temporary folder with the program, from which it is imported."""
    (tmp_path / "my_helper.py").write_text(HELPER, encoding="utf-8")
    (tmp_path / "my_program.py").write_text(PROGRAM, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("my_")]:
        del sys.modules[name]


def load(name="my_program"):
    """Imports the program as another process would."""
    for each in [each for each in sys.modules if each.startswith("my_")]:
        del sys.modules[each]
    importlib.invalidate_caches()
    return importlib.import_module(name)


def run(folder, observe, *inputs, setup=None, **options):
    """Runs two observers; returns their data, and whether any was run."""
    setup = dataclasses.replace(setup or Setup(), observers=2, out=folder / "out")
    before = set((folder / "out").rglob("repeat_*.npz"))
    data = run_observers("mine", setup, observe, *inputs, **options)
    return data, set((folder / "out").rglob("repeat_*.npz")) != before


def ran(folder, observe, *inputs, **options):
    return run(folder, observe, *inputs, **options)[1]


@pytest.mark.parametrize("file", ["my_program.py", "my_helper.py", "my_new_file.py"])
def test_any_file_of_the_programs_folder_that_changes_runs_observers_anew(folder, file):
    assert ran(folder, load().observe)
    assert not ran(folder, load().observe)
    assert not ran(folder, partial(load().observe))
    with (folder / file).open("a", encoding="utf-8") as changed:
        changed.write("# changed\n")
    assert ran(folder, load().observe)


def look_up(setup, given, observer):
    return xr.Dataset({"value": ((), 0.0, {})})


def test_functions_and_a_noise_model_of_ones_own_are_known_by_their_files(folder):
    """The function that is run is of this file; what it is given is of another."""
    text = "from affordance.proprioception.torque_noise import WeberNoise\n\nclass MyNoise(WeberNoise):\n    pass\n"
    (folder / "my_noise.py").write_text(text, encoding="utf-8")
    own = [
        lambda: ran(folder, look_up, load().observe),
        lambda: ran(folder, look_up, 0, setup=Setup().change(noise=load("my_noise").MyNoise())),
    ]
    for again in own:
        assert again()
        assert not again()
    change_file(folder / "my_noise.py", "pass", "BIAS = 1.0")
    assert all(again() for again in own)


@pytest.mark.parametrize(
    "others",
    [
        *([1, 2], {1: 2}, None, True, 1.0, "density", range(2)),
        np.array([1.0, 2.0]),
        DENSITY,
        KINDS_MAP,
        WeberNoise(threshold=1.0),
    ],
    ids=repr,
)
def test_inputs_count_by_value(folder, others):
    assert ran(folder, look_up, 1)
    assert ran(folder, look_up, others)
    assert not ran(folder, look_up, copy.deepcopy(others))


def test_seed_and_settings_count_and_number_jobs_and_folder_of_models_do_not(folder, models):
    assert ran(folder, look_up, 0)
    assert ran(folder, look_up, 0, setup=Setup(seed=1))
    assert ran(folder, look_up, 0, setup=Setup().change(learner=KINDS_MAP))
    assert ran(folder, look_up, 0, setup=Setup().change(learner=KINDS_MAP.change(kappa=0.3)))
    assert not ran(folder, look_up, 0, setup=Setup(observers=7, jobs=3, models=models))
    arm = models / "arm.dmd.yaml"
    assert not ran(folder, look_up, 0, setup=Setup().change(arm=arm))
    change_file(models / "arm.sdf", "0.3274", "0.3275")
    assert ran(folder, look_up, 0, setup=Setup().change(arm=arm))


def test_observers_of_another_version_or_library_are_not_taken(folder, monkeypatch):
    assert ran(folder, look_up, 0)
    with monkeypatch.context() as patch:
        patch.setattr("affordance.runs.repeats.__version__", "0.2.0")
        assert ran(folder, look_up, 0)
    monkeypatch.setattr("affordance.runs.repeats._find_version", lambda name: "0")
    assert ran(folder, look_up, 0)


SCRIPT = """
from pathlib import Path
from affordance.experiments.shared.observers import Setup, run_observers
from my_program import observe as observe_one

NAMES = {"first", "second", "third"}

def observe(setup, observer):
    return observe_one(setup, observer)

run_observers("mine", Setup(observers=2, out=Path("out")), observe)
"""


@pytest.mark.parametrize("has_file", [True, False])
def test_script_resumes_in_another_process(folder, has_file):
    """Nothing runs twice though hashes of texts, and so the order of sets, differ between processes.

    A notebook has no file, as a program that is given with -c.
    """

    def count(seed, text):
        (folder / "my_script.py").write_text(text, encoding="utf-8")
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": f"{ROOT}{os.pathsep}{folder}"}
        words = ["my_script.py"] if has_file else ["-c", text]
        subprocess.run([sys.executable, *words], cwd=folder, env=environment, check=True, timeout=300)
        return len(list((folder / "out").rglob("repeat_*.npz")))

    assert count("1", SCRIPT) == 2
    assert count("2", SCRIPT) == 2
    assert count("3", SCRIPT.replace("observe_one(setup, observer)", "observe_one(setup, observer + 1)")) == 4


def draw(setup, scale, observer):
    """Draws three numbers, as an observer would."""
    rng = np.random.default_rng([setup.seed, observer])
    return xr.Dataset(
        {
            "drawn": (("trial", "time"), scale * rng.random((2, 3)), about("m", "what was drawn")),
            "count": ((), observer, about("1", "number of the observer")),
            "name": ("trial", ["a", "bc"], about("1", "names")),
        },
        {"time": ("time", [0.0, 0.1, 0.2], about("s", "time")), "trial": ["first", "second"]},
    )


def test_datasets_are_joined_with_their_labels(tmp_path):
    data, _ = run(tmp_path, draw, 2.0)
    assert data.drawn.dims == ("observer", "trial", "time")
    assert data["count"].values.tolist() == [0, 1]
    assert data.drawn.attrs == {"units": "m", "long_name": "what was drawn"}
    assert data.time.attrs == {"units": "s", "long_name": "time"}
    assert (data.trial.values.tolist(), data.time.values.tolist()) == (["first", "second"], [0.0, 0.1, 0.2])
    assert data.name.values.tolist() == [["a", "bc"]] * 2
    for observer in range(2):
        expected = 2.0 * np.random.default_rng([0, observer]).random((2, 3))
        np.testing.assert_array_equal(data.drawn.sel(observer=observer), expected)
    xr.testing.assert_identical(run(tmp_path, draw, 2.0)[0], data)  # those that were kept


def test_any_number_of_jobs_gives_the_same_data_and_more_observers_are_added(tmp_path):
    one, two = (Setup(observers=3, jobs=jobs, out=tmp_path / str(jobs)) for jobs in (1, 2))
    xr.testing.assert_identical(run_observers("mine", one, draw, 2.0), run_observers("mine", two, draw, 2.0))
    end_processes()
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("repeat_*.npz")}
    more = run_observers("mine", one, draw, 2.0, count=5)
    assert more.sizes["observer"] == 5
    after = {path: path.stat().st_mtime_ns for path in (tmp_path / "1").rglob("repeat_*.npz")}
    assert len(after) == 5
    assert {path: time for path, time in after.items() if path in before}.items() <= before.items()


def test_what_inputs_follow_from_takes_their_place(tmp_path):
    assert ran(tmp_path, draw, 2.0, follows_from="a file")
    assert not ran(tmp_path, draw, 3.0, follows_from="a file")
    assert ran(tmp_path, draw, 3.0, follows_from="another")


def test_excursion_is_the_farthest_height_with_its_sign():
    height = xr.DataArray([[0.0, 0.2, -0.3], [0.0, 0.4, -0.3]], dims=("trial", "time"))
    assert find_excursion(height).values.tolist() == [-0.3, 0.4]


def test_memory_is_of_one_observer(tmp_path):
    said = refuse(remember_in, Setup(observers=2), tmp_path / "memory.sqlite")
    assert said == "--repeats: is 2, must be 1 with a memory, which belongs to one observer"
