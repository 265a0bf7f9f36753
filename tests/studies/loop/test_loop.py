"""Study of the loop, small: recordings are those of the robot, lives teach, and choices are judged by the truth."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.answers import answer
from helpers.generated_runs import write_urdf
from helpers.loop_runs import QUIET, TASKS, build_bench, remember, run_lives
from helpers.workshop import HAMMERS

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.pricing import plan_options
from affordance.identification.identify import identify
from affordance.memory.ledger import open_memory
from affordance.robots.robot import Robot
from affordance.settings import DEFAULT_SETTINGS, Settings
from studies.active.world import find_true_costs
from studies.loop import study
from studies.loop.execution import execute
from studies.loop.figure import draw_loop
from studies.loop.ledger_speed import count_double, make_trials
from studies.loop.lives import LEVELS, draw_truth, judge, live
from studies.loop.record import STOCK, record_stock
from studies.loop.recordings import MOTORS, build_recorder, draw_errors, move

PRIOR = DEFAULT_SETTINGS.prior


@pytest.fixture(scope="module")
def bench():
    return build_bench()


@pytest.mark.parametrize("signals", [QUIET, MOTORS._replace(noise_sd=4e-4, friction=(1e-3, 1e-3, 1e-3))])
def test_recorded_pieces_are_identified(bench, signals):
    rng = np.random.default_rng(3)
    recorder = build_recorder(bench.robot, signals, rng)
    truth = draw_truth(bench.pieces[0], PRIOR.deviation, rng)
    belief = identify(recorder.chain, recorder.record(truth, rng, "bar"))
    assert belief.is_trusted, belief.doubts
    assert abs(belief.mass - truth[0]) < 3.0 * belief.mass_sd
    assert belief.mass_sd < 0.2 * truth[0]


def test_motions_keep_limits_and_are_derivatives():
    robot = Robot()
    q, v, vdot = move(robot, np.random.default_rng(0))
    limits = robot.limits
    assert ((limits.q_lower < q) & (q < limits.q_upper) & (np.abs(v) < limits.v_max)).all()
    np.testing.assert_allclose(np.gradient(q, 0.01, axis=0)[5:-5], v[5:-5], atol=1e-3)
    np.testing.assert_allclose(np.gradient(v, 0.01, axis=0)[5:-5], vdot[5:-5], atol=5e-3)


def test_errors_have_unit_variance_and_agree_for_their_time():
    errors = draw_errors(200_000, 1, 20.0, np.random.default_rng(1))[:, 0]
    assert errors.std() == pytest.approx(1.0, rel=0.05)
    means = errors.reshape(-1, 1000).mean(axis=1)
    assert 1000.0 * means.var() == pytest.approx(20.0, rel=0.2)


def test_life_teaches_piece_by_piece(bench, tmp_path):
    rng = np.random.default_rng(1)
    recorder = build_recorder(bench.robot, QUIET, rng)
    memories = list(live(tmp_path / "m.sqlite", recorder, bench.pieces, bench.settings, rng))
    assert [len(memory.colours) for memory in memories] == [0, 1, 2, 3]
    densities = memories[-1].belief
    for piece in bench.pieces:
        (material,) = {part.material for part in piece.components}
        place = memories[-1].colours.index(material.colour)
        sd = np.sqrt(densities.covariance[place, place])
        assert abs(densities.untruncated_mean[place] - material.density) < 3.0 * sd


def test_true_costs_are_those_of_known_densities_and_who_knows_them_is_right(bench):
    choice, rng = bench.choices["reach"], np.random.default_rng(0)
    truths = {tool.name: draw_truth(tool, 0.0, rng) for tool in bench.tools}
    densities = {part.material.colour: part.material.density for tool in bench.tools for part in tool.components}
    known = MaterialMemory.from_densities(densities)
    for criterion in Criterion:
        judged = judge(choice, known, truths, criterion, 200, rng)
        assert judged.is_right == 1.0
        assert judged.regret == 0.0
    works = find_true_costs(choice, truths, Criterion.WORK)
    rho = np.array([[densities[colour] for colour in choice.add_colours(known).colours]])
    expected = choice.compute_costs(choice.compute_parameters(known, rho)).work[:, 0]
    np.testing.assert_allclose(works, expected, rtol=0.05)  # a drawing's errors are of the first order


def test_numbers_and_figure_of_a_small_study():
    arrays = run_lives()
    metrics, details = study.describe_robot(arrays, TASKS)
    coverage = {"coverage_mass", "coverage_tools", "coverage_by_experience"}
    assert set(metrics) == {"by", "right", "regret", "right_if_known", "regret_if_known", "taught"} | coverage
    assert metrics["regret_if_known"] <= metrics["regret"]["before"]
    assert list(metrics["right"]) == list(metrics["regret"]) == list(LEVELS)
    assert metrics["regret"]["after_5"] <= metrics["regret"]["before"]
    assert set(details["reach"]) == {"work", "grip"}
    low, high = details["reach"]["work"]["after_5"]["right_ci95"]
    assert low <= details["reach"]["work"]["after_5"]["right"] <= high
    figure = draw_loop({"ours": details})
    assert [axes.get_title() for axes in figure.axes[:2]] == ["reach, compared by work", "reach, compared by grip"]


@pytest.mark.parametrize(("right", "regret", "settled"), [(0.95, 0.2, 1.0), (0.5, 0.01, 1.0), (0.94, 0.011, 0.5)])
def test_robot_chooses_well_if_it_is_right_or_loses_little(right, regret, settled):
    """The share of settled robots counts one whose other numbers are beyond doubt along with the one under test."""
    good = {"right": dict.fromkeys(LEVELS, 1.0), "regret": dict.fromkeys(LEVELS, 0.0), "coverage_mass": 0.9}
    other = {"right": dict.fromkeys(LEVELS, right), "regret": dict.fromkeys(LEVELS, regret), "coverage_mass": 0.9}
    assert study.summarise_robots({"good": good, "other": other})["settled"] == settled


def test_trials_of_the_timed_ledger_differ_and_recall_their_materials():
    trials = make_trials(0, 12)
    assert len({trial.id for trial in trials}) == 12
    assert remember()["forget_error"] < 1e-9
    assert remember(forgets_nothing=True)["forget_error"] > 1e-9


def test_chosen_reach_is_executed_within_its_tolerance(bench):
    found = execute(bench, MaterialMemory(), Criterion.WORK, 0)["reach"]
    assert found["option"] in [option.name for option in bench.choices["reach"].options]
    assert 0.0 < found["error_m"] < found["tolerance_m"]


def test_loop_is_closed_on_an_imported_robot(tmp_path):
    """From a robot's file to a reach and a blow with the tools that its own recordings made it choose."""
    folder, memory = tmp_path / "six", tmp_path / "memory.sqlite"
    answer("import-arm", write_urdf(tmp_path), "--tip", "flange", "--out", folder, "--tasks", "keep", "--no-meshes")
    robot = Robot.load(folder)
    recorded = record_stock(robot, tmp_path / "logs", QUIET, 0)
    words = ["--object", STOCK, "--size-error", 0.02, "--unseen", 0.02, "--memory", memory, "--samples", 200]
    for name in ("bar of oak", "rod of cast steel", "block of rubber"):
        piece = recorded[name]
        runs = ["--empty", piece.empty, "--loaded", piece.loaded, "--object-name", name]
        found = answer("identify", "--robot", folder, *runs, *words, "--json").content
        assert found["mass_kg"] == pytest.approx(piece.mass, abs=3.0 * found["mass_sd_kg"])
    with open_memory(memory) as ledger:
        assert {trial.robot for trial in ledger.list_trials()} == {"six"}
        believed = ledger.recall()
    settings, tools = Settings(arm=robot.directives), [HAMMERS[name] for name in ("machinist hammer", "mallet")]
    tasks = {name: robot.load_task(name) for name in ("reach", "hammer")}
    choices = {name: plan_options(list_drawn_options(tools), task, settings) for name, task in tasks.items()}
    done = execute(study.Bench(robot, settings, [], tools, tasks, choices), believed, Criterion.GRIP, 0)
    words = ["--robot", folder, "--samples", 1000, "--only", tools[0].name, "--only", tools[1].name, "--json"]
    changed = []
    for name in tasks:
        ranked = answer("rank", name, "--memory", memory, "--know", "nothing", *words).content
        changed += [answer("rank", name, "--know", "nothing", *words).content["choice"] != ranked["choice"]]
        assert (ranked["by"], ranked["unknown"], ranked["trials_of_other_arms"]) == ("grip", [], 0)
        assert done[name]["option"] == "{tool} by {grip}".format(**ranked["choice"])
    assert any(changed)  # by what was recorded
    assert done["reach"]["error_m"] < done["reach"]["tolerance_m"]
    # One piece of each material was held, which deviates; the force of a blow goes with the square of its speed.
    assert abs(done["hammer"]["force_error"]) < 3.0 * 2.0 * settings.prior.deviation


def test_a_trial_that_is_there_twice_by_two_ids_is_counted():
    first, second = make_trials(0, 2)
    assert count_double([first, second]) == 0
    twice = replace(first, source_hash="another id")
    assert twice.id != first.id
    assert count_double([first, twice, second]) == 1
