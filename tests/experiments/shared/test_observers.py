"""Observers are kept; those that are kept are taken only while nothing that they run has changed."""

import dataclasses
import importlib
import os
import subprocess
import sys
import types
from functools import partial

import numpy as np
import pytest
import xarray as xr
from helpers.changed_files import change_file
from helpers.children import ROOT
from helpers.refusals import refuse

from affordance.arrays import about
from affordance.belief import kinds_learner
from affordance.belief.kinds_learner import Pick
from affordance.belief.learners import DENSITY, KINDS_MAP
from affordance.experiments.shared.observers import Setup, find_excursion, run_observers
from affordance.extensions.memory.lasting_memory import remember_in
from affordance.proprioception.torque_noise import WeberNoise
from affordance.runs.repeats import end_processes

# Program of a user in two files, with knobs of several types.
HELPER = """
import affordance.belief.kinds_learner as kinds

FACTOR = 2.0
WIDE = 5.0

def scale(value):
    return FACTOR * value

def widen(value):
    return value * sum(kinds.KAPPA.values())

def unused():
    return WIDE
"""
PROGRAM = """
import time
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from scipy.stats import norm

import my_helper
from my_helper import scale

STARTED = time.perf_counter()
NAMES = frozenset({"first", "second", "third"})

@dataclass
class Knobs:
    gain: float = 2.0
    limits: list = field(default_factory=lambda: [1.0, 2.0])

class Rule:
    MOST = 9.0

    def __init__(self, power):
        self.power = power

    def __call__(self, setup, observer):
        return observe(setup, observer) ** self.power

    def apply(self, value):
        return min(value, self.MOST)

TABLE = {"a": 1.0, "b": {"c": [1.0, 2.0]}}
ARRAY = np.arange(3.0)
KNOBS = Knobs()
RULES = {"double": lambda value: 2.0 * value}
RULE = Rule(1)

def think(value):
    return value + 1.0

def observe(setup, observer, shift=0.0, rule=None):
    value = TABLE["a"] + sum(TABLE["b"]["c"]) + ARRAY.sum() + KNOBS.gain + sum(KNOBS.limits) + len(NAMES)
    value = RULES["double"](scale(think(value))) + my_helper.widen(shift) + norm.cdf(RULE.apply(observer))
    return xr.Dataset({"value": ((), value, {"units": "1", "long_name": "a value"})})

def make(shift):
    def observe_shifted(setup, observer):
        return observe(setup, observer, shift)
    return observe_shifted
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


# What a user may change in memory, after the program was imported.
CHANGES = {
    "a dict": lambda my: my.TABLE.update(a=2.0),
    "a list in a dict in a dict": lambda my: my.TABLE["b"]["c"].append(3.0),
    "an array, in place": lambda my: my.ARRAY.__setitem__(1, 7.0),
    "a dataclass": lambda my: setattr(my.KNOBS, "gain", 3.0),
    "a list in a dataclass": lambda my: my.KNOBS.limits.append(3.0),
    "a class": lambda my: setattr(my.Rule, "MOST", 0.5),
    "a method": lambda my: setattr(my.Rule, "apply", lambda self, value: value),
    "an object": lambda my: setattr(my, "RULE", my.Rule(2)),
    "a set": lambda my: setattr(my, "NAMES", my.NAMES | {"fourth"}),
    "a function": lambda my: setattr(my, "think", my.scale),
    "a function of a table": lambda my: my.RULES.update(double=lambda value: 3.0 * value),
    "a default": lambda my: setattr(my.observe, "__defaults__", (1.0, None)),
    "what was imported": lambda my: setattr(my, "scale", my.think),
    "a constant of another file": lambda my: setattr(my.my_helper, "FACTOR", 3.0),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_knob_of_any_type_runs_observers_anew(folder, change):
    program = load()
    assert ran(folder, program.observe)
    assert not ran(folder, program.observe)
    change(program)
    assert ran(folder, program.observe)
    assert not ran(folder, program.observe)
    assert not ran(folder, load().observe)  # as it was


def test_table_of_the_library_runs_observers_anew(folder, monkeypatch):
    program = load()
    first, _ = run(folder, partial(program.observe, shift=1.0))
    monkeypatch.setitem(kinds_learner.KAPPA, Pick.MAP, 8.0)
    second, is_new = run(folder, partial(program.observe, shift=1.0))
    assert is_new
    assert (first.value != second.value).all()


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("my_program.py", "value + 1.0", "value + 2.0"),
        ("my_program.py", "[1.0, 2.0]}", "[1.0, 2.5]}"),
        ("my_helper.py", "FACTOR = 2.0", "FACTOR = 2.5"),
        ("my_helper.py", "return WIDE", "return 2.0 * WIDE"),  # of what nothing calls: the whole file counts
        ("my_helper.py", "def unused", "# Another comment.\ndef unused"),
    ],
)
def test_file_of_the_program_that_changes_runs_observers_anew(folder, file, old, new):
    assert ran(folder, load().observe)
    change_file(folder / file, old, new)
    assert ran(folder, load().observe)
    change_file(folder / file, new, old)
    assert not ran(folder, load().observe)


PACKAGE = {
    "my_package/__init__.py": "SHIFT = 1.0\n",
    "my_package/parts/__init__.py": "",
    "my_package/parts/rules.py": "from . import deep\n\ndef apply():\n    return deep.VALUE\n",
    "my_package/parts/deep.py": "VALUE = 1.0\n",
    "my_package/late.py": "def add():\n    return 1.0\n",
    "my_run.py": (
        "import xarray as xr\nimport my_package.parts.rules as rules\n\n"
        "def observe(setup, observer):\n    from my_package.late import add\n\n"
        "    return xr.Dataset({'value': ((), rules.apply() + add(), {})})\n"
    ),
}


@pytest.mark.parametrize("file", PACKAGE)
def test_every_file_that_is_imported_counts_packages_and_late_imports_too(folder, file):
    for name, text in PACKAGE.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    assert ran(folder, load("my_run").observe)
    assert not ran(folder, load("my_run").observe)
    (folder / file).write_text(f"{PACKAGE[file]}# changed\n", encoding="utf-8")
    assert ran(folder, load("my_run").observe)


WAYS = {
    "partial": lambda my, knob: partial(my.observe, shift=knob),
    "closure": lambda my, knob: my.make(knob),
    "object": lambda my, knob: my.Rule(knob),
    "method": lambda my, knob: my.Rule(knob).__call__,
}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_function_in_any_form_is_known_by_its_source_and_by_what_it_holds(folder, way):
    program = load()
    assert ran(folder, way(program, 1.0))
    assert not ran(folder, way(program, 1.0))
    assert ran(folder, way(program, 2.0))
    change_file(folder / "my_helper.py", "FACTOR = 2.0", "FACTOR = 2.5")
    assert ran(folder, way(load(), 1.0))


def look_up(setup, given, observer):
    return xr.Dataset({"value": ((), 0.0, {})})


def test_functions_and_objects_that_are_given_are_known_by_their_sources(folder):
    """The file that defines what is given is changed; the function that is run is of this file."""
    for make in (lambda my: {"rule": my.think}, lambda my: [my.Rule(1.0)], lambda my: my.Knobs()):
        assert ran(folder, look_up, make(load()))
        assert not ran(folder, look_up, make(load()))
        change_file(folder / "my_program.py", "value + 1.0", "value + 2.0")
        assert ran(folder, look_up, make(load()))
        change_file(folder / "my_program.py", "value + 2.0", "value + 1.0")


def test_noise_of_ones_own_is_known_by_its_source(folder):
    text = "from affordance.proprioception.torque_noise import WeberNoise\n\nclass MyNoise(WeberNoise):\n    pass\n"
    (folder / "my_noise.py").write_text(text, encoding="utf-8")

    def given():
        return Setup().change(noise=load("my_noise").MyNoise())

    assert ran(folder, look_up, 0, setup=Setup().change(noise=WeberNoise()))
    assert ran(folder, look_up, 0, setup=given())
    assert not ran(folder, look_up, 0, setup=given())
    (folder / "my_noise.py").write_text(f"{text}\n    BIAS = 1.0\n", encoding="utf-8")
    assert ran(folder, look_up, 0, setup=given())


@pytest.mark.parametrize(
    "others",
    [
        [1, 2],
        (1, 2),
        {1: 2},
        {"1": 2},
        np.array([1, 2]),
        np.array([1.0, 2.0]),
        np.array([[1, 2]]),
        np.array([1, None], dtype=object),
        xr.Dataset({"x": ("y", [1, 2])}),
        xr.Dataset({"x": ("y", [1, 3])}),
        DENSITY,
        KINDS_MAP,
        WeberNoise(),
        WeberNoise(threshold=1.0),
        None,
        True,
        1.0,
        "density",
        b"density",
        range(2),
        slice(1, 2),
    ],
    ids=repr,
)
def test_inputs_of_any_type_count_by_type_and_value(folder, others):
    assert ran(folder, look_up, 1)
    assert ran(folder, look_up, others)
    assert not ran(folder, look_up, others)


def test_seed_and_settings_count_and_number_jobs_and_folder_of_models_do_not(folder, models):
    assert ran(folder, look_up, 0)
    assert ran(folder, look_up, 0, setup=Setup(seed=1))
    assert ran(folder, look_up, 0, setup=Setup().change(learner=KINDS_MAP))
    assert not ran(folder, look_up, 0, setup=Setup(observers=7, jobs=3, models=models))
    setup = Setup().change(arm=models / "arm.dmd.yaml")
    assert not ran(folder, look_up, 0, setup=setup)
    change_file(models / "arm.sdf", "0.3274", "0.3275")
    assert ran(folder, look_up, 0, setup=setup)


def test_observers_of_another_version_or_library_are_not_taken(folder, monkeypatch):
    assert ran(folder, look_up, 0)
    with monkeypatch.context() as patch:
        patch.setattr("affordance.runs.repeats.__version__", "0.2.0")
        assert ran(folder, look_up, 0)
    monkeypatch.setattr("affordance.runs.repeats._find_version", lambda name: "0")
    assert ran(folder, look_up, 0)


def test_repeats_that_a_former_version_kept_are_not_taken(folder):
    """Before version 0.3 a folder of the same name held arrays without labels, under keys of another kind."""
    former = folder / "out" / "mine" / "repeats" / "0123456789abcdef"
    former.mkdir(parents=True)
    np.savez(former / "repeat_00000.npz", value=7.0, belongs_to="repeat 0 of 0123456789abcdef")
    data, is_new = run(folder, look_up, 0)
    assert is_new
    assert data.value.values.tolist() == [0.0, 0.0]
    assert (former / "repeat_00000.npz").exists()


CELLS = """
import xarray as xr

KNOB = {"a": 1.0}

def think(value):
    return value + KNOB["a"]

def observe(setup, observer):
    return xr.Dataset({"value": ((), think(1.0), {})})
"""


def execute(text, monkeypatch):
    """Executes cells of a notebook, whose module has no file."""
    notebook = types.ModuleType("my_notebook")
    monkeypatch.setitem(sys.modules, "my_notebook", notebook)
    exec(compile(text, "<cell>", "exec"), vars(notebook))
    return notebook


@pytest.mark.parametrize(
    ("old", "new"),
    [("return value + KNOB", "return value * KNOB"), ("think(1.0)", "think(2.0)"), ('{"a": 1.0}', '{"a": 2.0}')],
)
def test_experiment_of_a_notebook_is_known_by_its_code(folder, monkeypatch, old, new):
    assert ran(folder, execute(CELLS, monkeypatch).observe)
    assert not ran(folder, execute(f"{CELLS}\nresult = 3\n", monkeypatch).observe)
    assert ran(folder, execute(CELLS.replace(old, new), monkeypatch).observe)
    notebook = execute(CELLS, monkeypatch)
    notebook.KNOB["a"] = 5.0
    assert ran(folder, notebook.observe)


SCRIPT = """
from pathlib import Path
from affordance.extensions.memory.lasting_memory import remember_in
from affordance.experiments.shared.observers import Setup, run_observers
from my_program import observe as observe_one

def observe(setup, observer):
    return observe_one(setup, observer)

if __name__ == "__main__":
    run_observers("mine", Setup(observers=2, out=Path("out")), observe)
"""


def test_script_resumes_in_another_process(folder):
    """Nothing runs twice though hashes of texts, and so the order of sets, differ between processes."""
    (folder / "my_script.py").write_text(SCRIPT, encoding="utf-8")

    def count(seed):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
        subprocess.run([sys.executable, "my_script.py"], cwd=folder, env=environment, check=True, timeout=300)
        return len(list((folder / "out").rglob("repeat_*.npz")))

    assert count("1") == 2
    assert count("2") == 2
    change_file(folder / "my_script.py", "observe_one(setup, observer)", "observe_one(setup, observer + 1)")
    assert count("3") == 4


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
