"""Learners of one's own: from a file on the command line to lifts, processes and the arm."""

import json
import sys

import numpy as np
import pytest
from helpers.answers import answer
from helpers.children import ROOT
from helpers.refusals import refuse

from affordance.belief.density_belief import Prior
from affordance.belief.holds import Felt
from affordance.belief.learner import Learner, Seen
from affordance.belief.learner_file import load_learner
from affordance.belief.learners import LEARNERS, check_learner, list_learners
from affordance.belief.material_memory import start_memory
from affordance.belief.memory_file import format_memory, parse_memory
from affordance.commands.options import read_learner
from affordance.exceptions import AffordanceError
from affordance.experiments import weight
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments.lifts import cylinder, repeat, run_lifts
from affordance.files.model_folder import MODELS
from affordance.named_settings import change_settings
from affordance.objects.load import load_tools
from affordance.simulation.trial import TrialRunner

FORGETTING = f"{ROOT / 'examples' / 'forgetting.py'}:Forgetting"
# A learner with annotations as strings, and with a helper function in the same file.
MINE = """
from __future__ import annotations
from dataclasses import dataclass
from typing import Annotated
from affordance.belief.normals import Normals
from affordance.belief.one_density import OneDensity
from affordance.files.constraints import Setting, Within
from my_helper import FACTOR

class Mine(OneDensity):
    @dataclass(frozen=True)
    class Parameters:
        gain: Annotated[float, Within(0.0, 2.0), Setting("1", "mine")] = 1.0

    def expect(self, state, seen):
        believed = super().expect(state, seen)
        return Normals(believed.mean + FACTOR * state["gain"][:, None], believed.covariance)

class Abstract(OneDensity.__mro__[1]):
    pass

def other():
    pass
"""


@pytest.fixture
def mine(tmp_path):
    (tmp_path / "my_helper.py").write_text("FACTOR = 300.0\n")
    path = tmp_path / "mine.py"
    path.write_text(MINE)
    yield path
    sys.modules.pop("my_helper", None)
    sys.path[:] = [each for each in sys.path if each != str(tmp_path)]


def design(observer, rng):
    return repeat(["small", "large"], 6, rng, block="lifts")


TOOLS = (
    cylinder("small", radius=0.04, height=0.08, mass=0.5),
    cylinder("large", radius=0.04, height=0.12, mass=0.9),
)


def test_forgetting_is_a_kalman_filter():
    """Mean and variance of one colour are those of a scalar filter written by hand, for observers of other drifts."""
    drift, prior = np.array([0.0, 100.0, 400.0]), Prior(1000.0, 4000.0, 0.05)
    learner = load_learner(FORGETTING).change(drift=tuple(drift))
    rng = np.random.default_rng(0)
    state = learner.start(rng, learner.parameters, prior, 1, 3)
    mean, variance = np.full(3, 1000.0), np.full(3, 4000.0**2)
    for number in range(20):
        felt, sd = rng.normal(2000.0, 300.0, 3), rng.uniform(50.0, 300.0, 3)
        scaled = Felt.from_torques((felt / sd)[:, None], np.zeros(1), 1.0 / sd[:, None, None], (1.0, 0.0))
        seen = Seen((0,), np.full(3, number % 4))
        state, densities, _ = learner.learn(state, seen, scaled, rng)
        own = variance + 0.05**2 * (mean**2 + variance)
        np.testing.assert_allclose(densities.mean[:, 0], mean + own / (own + sd**2) * (felt - mean), rtol=1e-9)
        gain = variance / (own + sd**2)
        mean, variance = mean + gain * (felt - mean), (1.0 - gain) * variance + drift**2
        np.testing.assert_allclose(learner.believe(state).mean[:, 0], mean, rtol=1e-9)
        np.testing.assert_allclose(learner.believe(state).covariance[:, 0, 0], variance, rtol=1e-9)


@pytest.mark.parametrize("jobs", [1, 2])
def test_own_learner_lifts_beside_those_of_the_program_in_processes(tmp_path, mine, jobs):
    """Another process has neither the file nor its helper; a learner has a drift of zero as one density does."""
    setup = Setup(observers=3, out=tmp_path / "out", jobs=jobs).change(learner=load_learner(f"{mine}:Mine"))
    lifts = run_lifts("mine", setup, TOOLS, design)
    assert [*lifts["learner"].unique()] == [*LEARNERS, "Mine"]
    wide = setup.change(learner=setup.settings.learner.change(gain=0.0))
    again = run_lifts("mine", wide, TOOLS, design, [wide.settings.learner])
    density = lifts[lifts["learner"] == "density"]
    np.testing.assert_allclose(again["force"], density["force"], rtol=1e-9)
    assert not np.allclose(lifts[lifts["learner"] == "Mine"]["force"], density["force"], rtol=1e-3)


def test_observers_of_a_changed_file_or_helper_are_run_anew(tmp_path, mine):
    def count():
        learner = load_learner(f"{mine}:Mine")
        run_lifts("mine", Setup(observers=1, out=tmp_path / "out").change(learner=learner), TOOLS, design, [learner])
        return len([*(tmp_path / "out" / "mine" / "repeats").iterdir()])

    assert count() == count() == 1
    mine.write_text(MINE + "\n# a remark\n")
    assert count() == 2
    (mine.parent / "my_helper.py").write_text("FACTOR = 200.0\n")
    assert count() == 3


def test_own_learner_holds_in_the_diagram_of_the_arm_and_forgets(tmp_path):
    tools = load_tools(MODELS / "tools" / "weight.yaml")
    learner = load_learner(FORGETTING)
    memory = TrialRunner(change_settings(weight_settings(learner), {})).start_memory()
    runner = TrialRunner(weight_settings(learner))
    sds = []
    for number, tool in enumerate((tools[0], tools[0], tools[1])):
        memory = runner.run_hold(tool, memory, duration=0.3, seed=(number,)).memory
        sds.append(memory.density(tool.components[0].material).sd)
    assert memory.learner == learner
    assert min(sds) > 100.0  # never surer than a drift
    again = parse_memory(format_memory(memory), learner)
    np.testing.assert_array_equal(again.belief.precision, memory.belief.precision)
    assert "memory: learner: is 'Forgetting', must be 'density'" in refuse(
        parse_memory, format_memory(memory), LEARNERS["density"]
    )


def weight_settings(learner):
    return Setup().change(learner=learner).settings


def test_command_line_runs_an_experiment_of_the_arm_and_one_of_lifts(tmp_path):
    said = ("--repeats", 2, "--jobs", 1, "--out", tmp_path, "--learner", FORGETTING, "--set", "learner.drift=50")
    answer("run", "linear_plus", *said)
    numbers = json.loads((tmp_path / "linear_plus" / "metrics.json").read_text())
    assert [*numbers["learners"]] == [*LEARNERS, "Forgetting"]
    assert {"learner": "Forgetting", "learner.drift": 50.0}.items() <= numbers["setup"]["settings"].items()
    assert weight.run(Setup(observers=2, out=tmp_path).change(learner=load_learner(FORGETTING))).numbers


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("kinds", "--learner: is 'kinds', must be one of density, kinds_map, kinds_drawn"),
        ("nowhere.py:Mine", "--learner: is 'nowhere.py', which is not a Python file"),
        ("{mine}", "kinds_drawn, nothing_remembered, own_memory, own_and_shared, or your own, as {mine}:CLASS"),
        ("{mine}:mine", "mine.py: class: is 'mine', must be one of Mine; did you mean Mine?"),
        ("{mine}:other", "mine.py: class: is 'other', must be one of Mine"),
        ("{mine}:Abstract", "mine.py: Abstract: has no method 'believe', which a learner must have"),
    ],
)
def test_what_is_no_learner_is_refused_in_a_line(mine, word, said):
    refused = refuse(read_learner, word.format(mine=mine))
    assert said.replace("; did you mean Mine?", "").format(mine=mine) in refused
    assert "\n" not in refused


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import nothing_such", "line 1: cannot be run: ModuleNotFoundError: No module named 'nothing_such'"),
        ("x = 1\ny = 1 / 0\n", "line 2: cannot be run: ZeroDivisionError: division by zero"),
        ("def f(:\n", "line 1: cannot be run: SyntaxError"),
        ("raise SystemExit(3)", "line 1: cannot be run: SystemExit: 3"),
        ("x = 1", "class: is 'Mine', but the file has no learner"),
        (MINE.replace("from my_helper import FACTOR", "").replace("class Mine", "class density"), "class: is 'Mine'"),
    ],
)
def test_files_that_cannot_be_run_are_named_with_their_line(tmp_path, text, said):
    path = tmp_path / "broken.py"
    path.write_text(text)
    assert said in refuse(load_learner, f"{path}:Mine")


def test_only_the_option_loads_code(tmp_path, mine):
    """A setting names learners of the program, and no memory or record names a file."""
    refused = answer("run", "weight", "--set", f"learner={mine}:Mine", "--out", tmp_path, status=2).err
    assert "must be one of density, kinds_map, kinds_drawn" in refused
    assert "my_helper" not in sys.modules


@pytest.mark.parametrize(("name", "value"), [("drift", -1.0), ("drift", [1.0, np.inf]), ("speed", 1.0)])
def test_parameters_out_of_bounds_are_refused(name, value):
    with pytest.raises(ValueError, match=name):
        load_learner(FORGETTING).change(**{name: value})


def test_values_by_observer_must_be_one_for_each():
    learner = load_learner(FORGETTING).change(drift=(1.0, 2.0, 3.0))
    assert learner.of_observers([2, 0]).parameters.drift == (3.0, 1.0)
    assert "drift: has 3 values, must have at least 6" in refuse(learner.of_observers, [5])


class Bare(Learner):
    """A learner with what it must have, and nothing more."""

    def start(self, rng, parameters, prior, num_colours, size):
        return LEARNERS["density"].start(rng, parameters, prior, num_colours, size)

    def believe(self, state):
        return LEARNERS["density"].believe(state)

    def expect(self, state, seen):
        return LEARNERS["density"].expect(state, seen)

    def learn(self, state, seen, felt, rng):
        return LEARNERS["density"].learn(state, seen, felt, rng)


def test_a_learner_without_colours_met_later_says_so():
    memory = start_memory(Bare()).add_colours([(0.1, 0.2, 0.3)], Prior())
    with pytest.raises(AffordanceError, match="Bare met a new colour after its start, which needs a method 'meet'"):
        memory.add_colours([(0.9, 0.2, 0.3)], Prior())
    both = start_memory(Bare()).add_colours([(0.1, 0.2, 0.3), (0.9, 0.2, 0.3)], Prior())
    with pytest.raises(AffordanceError, match="Bare has to forget a colour, which needs a method 'select'"):
        both.restrict_to([(0.9, 0.2, 0.3)])


def test_own_learner_is_compared_with_those_of_the_program():
    assert list_learners(Bare())[-1] == Bare() == check_learner("learner", Bare)
    assert list_learners(LEARNERS["kinds_map"]) == [*LEARNERS.values()]
    assert "learner: is 3, must be a Learner or the name of one" in refuse(check_learner, "learner", 3)
