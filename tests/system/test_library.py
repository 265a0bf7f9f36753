"""The library for users of Python: names at the top, forms of arguments, messages and output."""

import functools
import importlib

import numpy as np
import pytest
from helpers.results_files import read_numbers

import affordance
from affordance import (
    MODELS,
    AffordanceError,
    BadArgumentError,
    ImportOptions,
    Material,
    MaterialMemory,
    Prior,
    Reach,
    Run,
    Runs,
    Selection,
    Settings,
    Setup,
    Tool,
    TrialRunner,
    WeberNoise,
    WhiteNoise,
    change_settings,
    identify,
    import_arm,
    list_options,
    load_hammer,
    load_materials,
    load_path,
    load_robot,
    load_tools,
    open_memory,
    open_robot,
    rank,
    read_gains,
    read_run,
    run_suite,
    start_memory,
)
from affordance.belief.density_belief import EMPTY_BELIEF, DensityBelief
from affordance.belief.learners import LEARNERS
from affordance.extensions.memory.simulated_trial import describe_trial
from affordance.extensions.payload.recording.run import RunDescription
from affordance.extensions.people.experiments import linear
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Component, Grip

RODS = load_tools(str(MODELS / "tools" / "weight.yaml"))
STICK, *_ = load_tools(MODELS / "tools" / "novel.yaml")
OPTIONS = list_options(STICK)
PATH = str(MODELS / "paths" / "reach.yaml")
GREY = Material("grey", (0.5, 0.5, 0.5), 1000.0)
BALL = Ellipsoid((0.05, 0.05, 0.05))
RUNNER = TrialRunner()
NOVICE = MaterialMemory()
NAN = float("nan")


@pytest.fixture(scope="module")
def record():
    return RUNNER.run_hold(RODS[0], NOVICE, duration=1.0, seed=4)


@pytest.fixture(scope="module")
def ranking():
    known = MaterialMemory.from_densities({"steel": 7850, "beech": 720})
    return rank(OPTIONS, Reach(load_path(PATH)), known, num_samples=50, seed=(3,))


def test_every_name_at_the_top_is_there_and_documented():
    text = (MODELS.parent / "docs" / "python.md").read_text(encoding="utf-8")
    for name in affordance.__all__:
        assert getattr(affordance, name) is not None
        assert f"`{name}`" in text, name


def test_a_whole_number_and_a_tuple_of_it_are_one_seed(record):
    again = RUNNER.run_hold(RODS[0], NOVICE, duration=1.0, seed=(4,))
    np.testing.assert_array_equal(again.q, record.q)
    other = RUNNER.run_hold(RODS[0], NOVICE, duration=1.0, seed=(4, 1))
    assert other.memory.density("brass").mean != record.memory.density("brass").mean
    one, other = start_memory(LEARNERS["kinds_drawn"], 3), start_memory("kinds_drawn", (3,))
    assert (one.learner, one.seed) == (other.learner, other.seed)


def test_paths_may_be_texts(tmp_path):
    assert set(load_materials(str(MODELS / "materials.yaml"))) == set(load_materials())
    assert load_hammer(str(MODELS / "nail.yaml")) == load_hammer(MODELS / "nail.yaml")
    assert Settings(arm=str(MODELS / "arm.dmd.yaml")) == Settings()
    assert load_robot(str(MODELS / "arm.dmd.yaml")).num_joints == 7
    assert Setup(models=str(MODELS), out="results") == Setup()
    for read in (read_run, read_gains, load_path, load_tools):
        with pytest.raises(AffordanceError, match="nowhere"):
            read(str(tmp_path / "nowhere.yaml"))


def test_density_is_found_by_name_colour_or_material(record):
    brass = load_materials()["brass"]
    density = record.memory.density("brass")
    assert density == record.memory.density(brass) == record.memory.density(brass.colour)
    assert density == record.memory.density("#d4a017") == record.memory.density("brass", load_materials())
    belief = record.memory.belief
    assert density.mean == belief.compute_mean()[0]
    assert (density.p25, density.p75) == tuple(belief.compute_percentiles([0.25, 0.75])[:, 0])
    samples = belief.draw_samples(np.random.default_rng(0), 100_000)[:, 0]
    assert density.sd == pytest.approx(samples.std(), rel=0.01)


def test_spread_of_a_truncated_density_is_that_of_its_samples():
    memory = NOVICE.add_colours([GREY.colour], Prior())
    samples = memory.belief.draw_samples(np.random.default_rng(0), 200_000)[:, 0]
    assert memory.density(GREY).sd == pytest.approx(samples.std(), rel=0.01)


def test_memory_of_kinds_has_densities_by_name_too(record):
    memory = TrialRunner(Settings(learner="kinds_map")).start_memory()
    assert memory.learner == LEARNERS["kinds_map"]
    learned = RUNNER.run_hold(RODS[0], memory, duration=1.0, seed=4).memory
    # The first kind starts so broad that the prior of all materials, which draws one density along, hardly counts.
    belief, prior = record.memory.belief, Prior()
    told = belief.precision[0, 0] - prior.sd**-2
    felt = (belief.information_vector[0] - prior.mode * prior.sd**-2) / told
    assert learned.density("brass").mean == pytest.approx(felt, rel=0.02)


def test_lasting_memory_serves_every_learner(record, tmp_path):
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        assert ledger.append([describe_trial(record)]) == 1
        for learner in LEARNERS.values():
            recalled = ledger.recall(learner)
            assert recalled.learner == learner
            again = RUNNER.run_hold(RODS[1], recalled, duration=1.0).memory
            assert again.density("brass").sd < recalled.density("brass").sd
        assert ledger.recall().density("brass").mean == pytest.approx(record.memory.density("brass").mean, rel=1e-3)


@pytest.mark.usefixtures("unrendered")
def test_experiment_is_run_from_python(tmp_path):
    settings = change_settings(Settings(), {"noise.weber_fraction": 0.1})
    report = run_suite({"linear_plus": linear.LINEAR_PLUS}, Setup(observers=1, out=tmp_path, settings=settings))
    numbers = read_numbers(tmp_path / "linear_plus")
    assert report[:2] == (tmp_path / "report.html", {})
    assert numbers["repeats"] == 1
    assert numbers["setup"]["settings"] == {"noise.weber_fraction": 0.1}
    again = linear.LINEAR_PLUS.run(Setup(observers=1, out=tmp_path, settings=settings))
    assert again.numbers["end_N"] == numbers["end_N"]


def make_belief(precision, vector=(0.0, 0.0)):
    return DensityBelief(np.array(precision), np.array(vector))


def make_pose(scale=1.0, mirrored=False):
    X = np.eye(4)
    X[:3, :3] *= scale
    X[2, 2] *= -1.0 if mirrored else 1.0
    return X


hold = functools.partial(RUNNER.run_hold, duration=1.0)
expect = MaterialMemory.from_densities


def record_run(**changes):
    table = {"times": np.arange(50) * 0.01, "q": np.zeros((50, 1)), "signal": np.zeros((50, 1))}
    return Run(**{"source": "run", "description": RunDescription(("a",), "current"), **table, **changes})


def build_load(size):
    return Tool("load", (Component(Ellipsoid((size, size, size)), np.eye(4), GREY, GREY),))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        # Calls that ended the process, or never ended.
        (lambda: hold(RODS[0], NOVICE, duration=NAN), "duration: is nan, must be from 0.1 to 3600 s"),
        (lambda: hold(RODS[0], NOVICE, duration=-1.0), "duration: is -1.0, must be from 0.1 to 3600 s"),
        (lambda: hold(RODS[0], NOVICE, duration=1e9), "duration: is 1000000000.0, must be from 0.1"),
        (lambda: build_load(46.0), "components: weigh 4.08e[+]08 kg, must weigh at most 10000 kg; lengths are in m"),
        # Calls that returned the prior for a posterior.
        (lambda: hold(RODS[0], NOVICE, duration=0.05), "duration: is 0.05, must be from 0.1 to 3600 s, with"),
        (lambda: Settings(sample_period=NAN), "Settings: sample_period: is nan, must be from 0.0001 to 60"),
        (lambda: WeberNoise(weber_fraction=NAN), "WeberNoise: weber_fraction: is nan, must be from 0 to 1"),
        (lambda: WhiteNoise(sd=NAN), "WhiteNoise: sd: is nan, must be from 1e-06 to 10000"),
        # Calls that were accepted without a check.
        (lambda: WeberNoise(weber_fraction=-0.07), "WeberNoise: weber_fraction: is -0.07, must be from 0 to 1"),
        (lambda: WhiteNoise(-1.0), "WhiteNoise: sd: is -1.0, must be from 1e-06 to 10000"),
        (lambda: Prior(sd=-4000.0), "Prior: sd: is -4000.0, must be from 0.001 to 1e\\+12"),
        (lambda: Prior(deviation=-100.0), "Prior: deviation: is -100.0, must be from 0 to 1"),
        (
            lambda: Material("ice", (0.5,) * 3, -917.0),
            "Material: density: is -917.0, must be from 0.001 to 1000",
        ),
        (lambda: Material("brass", (212, 160, 23), 8500.0), r"Material: colour\[0\]: is 212, must be from 0 to 1"),
        (lambda: Component(BALL, make_pose(scale=1e-3), GREY, GREY), "X_TE: has axes of the lengths 0.001"),
        (lambda: Component(BALL, make_pose(mirrored=True), GREY, GREY), "X_TE: is a reflection, must be a rotation"),
        (lambda: Component(3, np.eye(4), GREY, GREY), "shape: is of type int, must be of type Shape"),
        (lambda: Grip("end", make_pose(scale=2.0)), "X_TG: has axes of the lengths 2, 2, 2"),
        (lambda: Tool("nothing", ()), "components: is empty, must hold at least one Component"),
        (lambda: make_belief([[1.0, 0.5], [0.0, 1.0]]), "precision: is not symmetric, must be symmetric"),
        (
            lambda: make_belief([[1.0, 2.0], [2.0, 1.0]]),
            "precision: is not positive definite, must be positive definite",
        ),
        (lambda: make_belief([[1.0]]), r"precision: has the shape \(1, 1\), must have \(2, 2\)"),
        (lambda: make_belief(np.eye(2), [NAN, 0.0]), r"information_vector\[0\]: is nan, must be finite"),
        (lambda: DensityBelief.from_moments([1.0], [[0.0]]), "covariance: is singular, must be positive definite"),
        (
            lambda: MaterialMemory.from_belief((GREY.colour,), EMPTY_BELIEF),
            "belief: is about 0 densities, must be about 1, one for each",
        ),
        (lambda: NOVICE.belief.compute_percentiles([25, 50, 75]), r"fractions\[0\]: is 25, must be from 0 to 1; 25"),
        (lambda: expect({"brass": -8500}), r"densities\['brass'\]: is -8500, must be from 0.001"),
        (lambda: expect({"bras": 8500}), "densities: is 'bras', must be one of .*did you mean"),
        (lambda: expect({(212, 160, 23): 8500}), r"densities\[0\]: is 212, must be from 0 to 1"),
        (lambda: expect([8500]), "densities: is of type list, must be a mapping"),
        (
            lambda: NOVICE.density("brass"),
            "material: is 'brass', but no object of its colour was met; colours met are none",
        ),
        # Calls that ended in errors of Python, or were accepted.
        (lambda: hold(RODS[0], NOVICE, duration="3"), "duration: is '3', must be a number"),
        (lambda: hold(RODS[0], NOVICE, seed=None), "seed: is empty, must be a number"),
        (lambda: Material("red", "#ff0000", 1000.0), "Material: colour: is '#ff0000', must be red, green and blue"),
        (lambda: open_robot(None, None, "."), "options: is of type NoneType, must be of type ImportOptions"),
        (lambda: load_robot("r.urdf", 3), "tip: is of type int, must be of type str"),
        (lambda: ImportOptions(None), "tip: is of type NoneType, must be of type str"),
        (lambda: ImportOptions("f", posture=3), "posture: is of type int, must be of type Mapping"),
        (lambda: ImportOptions("f", effort={"a": "x"}), r"effort\['a'\]: is 'x', must be a number"),
        (lambda: ImportOptions("f", effort={1: 2.0}), "joint of effort: is of type int, must be of type str"),
        (lambda: ImportOptions("f", height="1"), "height: is '1', must be a number"),
        (lambda: ImportOptions("f", damping="no"), "damping: is of type str, must be of type bool"),
        (lambda: record_run(description=None), "description: is of type NoneType, must be of type RunDescription"),
        (lambda: record_run(source=None), "source: is of type NoneType, must be of type str"),
        (lambda: record_run(times=None), r"times: has the shape \(\), must have \(n,\)"),
        (lambda: record_run(q="angles"), "q: is 'angles', must be numbers"),
        (lambda: RunDescription("ab", "current"), "joint_names: is of type str, must be of type tuple"),
        (lambda: RunDescription(("a", 2), "current"), r"joint_names\[1\]: is of type int, must be of type str"),
        (lambda: RunDescription(("a",), "volts"), "kind: is 'volts', must be one of"),
        (lambda: RunDescription(("a",), "current", base=3), "base: is of type int, must be of type str"),
        (lambda: RunDescription(("a",), "current", gravity=None), r"gravity: has the shape \(\), must have \(3,\)"),
        (lambda: change_settings(None, {}), "settings: is of type NoneType, must be of type Settings"),
        (lambda: change_settings(Settings(), 3), "changes: is of type int, must be of type Mapping"),
        (lambda: Tool(None, STICK.components), "name: is of type NoneType, must be of type str"),
        (lambda: Tool("t", None), "components: is of type NoneType, must be of type Sequence"),
        (lambda: Tool("t", STICK.components, None), "grips: is of type NoneType, must be of type Sequence"),
        (lambda: Selection(robot=3).narrow(), "robot: is of type int, must be of type str"),
        # Calls that were meant otherwise.
        (lambda: hold(RODS, NOVICE), "tool: is of type tuple, must be of type Tool; load_tools"),
        (lambda: hold(RODS[0], None), "memory: is of type NoneType, must be of type MaterialMemory"),
        (lambda: hold(RODS[0], NOVICE, seed=-3), "seed: is -3, must be from 0 to 4294967295"),
        (lambda: TrialRunner("density"), "settings: is of type str, must be of type Settings"),
        (lambda: rank(RODS, None, NOVICE), r"options\[0\]: is of type Tool, must be of type Option; list_options.to"),
        (lambda: rank(STICK, None, NOVICE), "options: is of type Tool, must be of type Sequence; list_options"),
        (lambda: rank(OPTIONS, PATH, NOVICE), "task: is of type str, must be of type TaskCostModel; such as Reach"),
        (lambda: rank(OPTIONS, Reach(load_path(PATH)), {}), "belief: is of type dict, must be of type M"),
        (lambda: list_options(RODS), "tool: is of type tuple, must be of type Tool"),
        (
            lambda: list_options(STICK, eye="eyes"),
            "eye: is 'eyes', must be a function of an object",
        ),
        (lambda: Reach(PATH), "path: is of type str, must be of type TimedPath; load_path"),
        (lambda: start_memory("kinds"), "learner: is 'kinds', must be one of density, kinds_map, kinds_drawn; did"),
        (lambda: load_tools("x.yaml", "materials.yaml"), "materials: is of type str, must be a mapping of names"),
        (lambda: open_memory({}), "place: is {}, must be the path of an SQLite file"),
        (lambda: import_arm("r.urdf", "tool0", "out"), "options: is of type str, must be of type ImportOptions"),
        (lambda: Setup(observers=0), "Setup: observers: is 0, must be from 1 to 100000"),
        (lambda: Setup(jobs=0), "Setup: jobs: is 0, must be from 1 to "),
        (lambda: Setup(seed=-1), "Setup: seed: is -1, must be from 0 to 4294967295"),
        (lambda: Setup(settings="density"), "Setup: settings: is 'density', must be a Settings"),
        (lambda: run_suite("wieght", Setup()), "experiment: is 'wieght', must be one of .*did you mean 'weight'"),
        (lambda: run_suite("weight", "out"), "setup: is of type str, must be of type Setup"),
        (lambda: identify("robot.urdf", Runs(None)), "arm: is of type str, must be of type SerialChain; load_robot"),
    ],
)
def test_arguments_are_checked_in_the_words_of_the_command_line(call, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadArgumentError, match=f"^{message}") as caught:
        call()
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("mass", [0.0, -1.0, NAN])
def test_weighed_mass_is_bounded(mass):
    checks = importlib.import_module("affordance.extensions.payload.identify")
    with pytest.raises(BadArgumentError, match=r"^reference_mass: is .*, must be from 0\.001 to 1000 kg"):
        checks.check_reference_mass("reference_mass", mass)


def test_what_is_printed_is_short_and_says_what_matters(record, ranking):
    printed = {
        "record": (record, "TrialRecord(duration 1 s, 101 rows, 7 joints, farthest height -21"),
        "memory": (record.memory, "MaterialMemory(#d4a017: "),
        "belief": (record.memory.belief, "DensityBelief("),
        "density": (record.memory.density("brass"), "Density("),
        "ranking": (ranking, "Ranking(2 of 2 usable: stick by steel, 6.8"),
        "best": (ranking.best, "RankedOption(stick by steel: 6.8"),
        "option": (ranking.best.option, "Option(stick by steel, 2 parts)"),
        "tool": (STICK, "Tool(stick: 0.606 kg of beech, steel, grips "),
        "runner": (start_memory("kinds_map"), "MaterialMemory(kinds_map, no colour: of no density)"),
        "robot": (load_robot(MODELS / "arm.dmd.yaml"), "SerialChain("),
    }
    for name, (each, start) in printed.items():
        assert repr(each).startswith(start), name
        assert len(repr(each)) < 400, name


def test_main_results_are_tables_in_notebooks(record, ranking):
    for each, cell in ((record, "farthest height"), (record.memory, "#d4a017"), (ranking, "stick by steel")):
        html = each._repr_html_()
        assert html.startswith("<table>")
        assert f"<td>{cell}</td>" in html


def test_defaults_are_those_of_the_simulations():
    assert TrialRunner().settings == Settings()
    assert Prior(sd=2000.0) == Prior(mode=1000.0, sd=2000.0, deviation=0.06)
    assert ImportOptions("tool0").up is None  # the axis of the robot's file
