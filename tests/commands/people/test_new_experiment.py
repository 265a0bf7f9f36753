"""An experiment of one's own: it is written, runs in processes, resumes, and its mistakes are named by line."""

import inspect
import sys

import pandas as pd
import pytest
from helpers.answers import answer
from helpers.changed_files import change_file
from helpers.refusals import refuse_command
from helpers.results_files import read_numbers

from affordance.extensions.people.experiments import starting_point

pytestmark = pytest.mark.usefixtures("unrendered")


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A new experiment with few lifts."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    assert (
        answer("new-experiment", "mine").out
        == "mine.py: change it as you like, then run it: affordance run mine.py\n"
    )
    path = change_file(tmp_path / "mine.py", "[*FAMILY], 10", "[*FAMILY], 2", '"odd"], 10', '"odd"], 3')
    yield path
    for name in [name for name in sys.modules if name.startswith("mine_")]:
        del sys.modules[name]


def run(*words, status=0):
    return answer("run", "mine.py", "--jobs", 1, *words, status=status)


def test_it_is_short():
    lines = inspect.getsource(starting_point).splitlines()
    assert len([line for line in lines if line.strip()]) <= 60


def test_new_experiment_runs_in_processes_and_is_predicted(mine, tmp_path):
    said = answer("run", "mine.py", "--repeats", 2, "--jobs", 2).out
    assert said.splitlines()[0] == "One observer passed the whole analysis; now all others are run."
    numbers = read_numbers(tmp_path / "results" / "mine")
    assert numbers["repeats"] == 2
    assert set(numbers["learners"]) == {"density", "kinds_map", "kinds_drawn"}
    lifts = pd.read_csv(tmp_path / "results" / "mine" / "lifts.csv")
    assert len(lifts) == 3 * 2 * (2 * 3 + 3 * 4)
    files = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")}
    said = answer("predict", "mine.py", "--repeats", 2, "--jobs", 1, "--details").out
    assert "first_N: force in the first lift of the odd object, N" in said
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")} == files  # nothing was run again
    run("--repeats", 3)
    assert len(list(tmp_path.rglob("*.npz"))) == 9


def test_one_observer_goes_first(mine, tmp_path):
    change_file(mine, '"finding": f"The odd object', '"finding": f"{numbers[\'nothing\']}The odd object')
    said = refuse_command_after("run", "mine.py", "--repeats", 5, "--jobs", 1)
    assert said.endswith("in describe: KeyError: 'nothing'")
    assert f"mine.py: line {find_line(mine, 'nothing')}, in describe" in said
    assert len(list(tmp_path.rglob("*.npz"))) == 3  # one of each learner
    assert not (tmp_path / "results" / "mine" / "metrics.json").exists()


def refuse_command_after(*words):
    """Returns the line that a command ends with, though it kept an observer."""
    answered = answer(*words, status=2)
    return answered.err.splitlines()[-1]


def find_line(path, text):
    return next(n for n, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1) if text in line)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["import numpy as np", "import numpie as np"], "line {numpie}: cannot be run: ModuleNotFoundError"),
        (["def measure(", "def measure("[:-1]], "SyntaxError"),
        (
            ["EXPERIMENT =", "EXAMPLE ="],
            "mine.py: EXPERIMENT: is missing, must be an Experiment(run), last in the file",
        ),
        (['odd["force"].iloc[0]', 'odd["forse"].iloc[0]'], "line {forse}, in measure: KeyError: 'forse'"),
        (["mass=10.0 * height", "mass=1e6 * height"], "mass: is 60000"),
        (["repeat([*FAMILY], 2, rng", 'repeat([*FAMILY, "x"], 2, rng'], "'x'"),
        (
            ['partial(draw_forces, lifts, ["odd"]', 'partial(draw_forces, lifts, ["od"]'],
            "mine.py: ValueError: zero-size array",
        ),
    ],
)
def test_mistake_is_named_by_its_line(mine, changes, said):
    change_file(mine, *changes)
    lines = {word: find_line(mine, word) for word in ("numpie", "forse") if word in said}
    assert said.format(**lines) in refuse_command_after("run", "mine.py", "--repeats", 2, "--jobs", 1)


def test_mistake_in_another_process_is_named_by_its_line(mine):
    change_file(mine, "    family = repeat(", "    1 / (observer - 1)\n    family = repeat(")
    said = refuse_command_after("run", "mine.py", "--repeats", 3, "--jobs", 2)
    assert f"mine.py: line {find_line(mine, 'observer - 1')}, in design: ZeroDivisionError" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["new-experiment", "mine"], "mine.py: exists already, must be a new file"),
        (["new-experiment", "weight"], "weight.py: would write to the results of weight"),
        (["new-experiment", "my experiment"], "name: is 'my experiment', must be letters, digits and '_', a letter"),
        (["new-experiment", "../other"], "name: is '../other', must be letters"),
        (["run", "mime.py"], "mime.py"),
        (["predict", "mine.py", "--repeats", "1"], "--repeats: is 1, must be at least 2"),
        (["run", "mine.py", "--learner", "density"], "--learner: has no effect on mine, which always simulates"),
    ],
)
def test_what_cannot_be_done_is_refused(mine, words, said):
    assert said in refuse_command(*words)


def test_python_file_that_is_no_experiment_of_the_command_line_is_not_run(mine, tmp_path):
    (tmp_path / "weight.py").write_text("open('ran', 'w')\n", encoding="utf-8")
    assert "would write to the results of weight" in refuse_command("run", "weight.py")
    refuse_command("watch", "mine.py")
    assert not (tmp_path / "ran").exists()
