"""Protocols of users: every action of a presentation, simulated, with few observers."""

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.results_files import read_numbers
from helpers.short_holds import shorten

from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError
from affordance.experiments.closed_form import ClosedForm
from affordance.experiments.prediction import predict_protocol
from affordance.experiments.protocol_runs import load_hold_experiment, load_protocol_experiment
from affordance.experiments.runner import run_experiment
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.experiments.simulated import Simulated
from affordance.experiments.suite import run_suite
from affordance.files.atomic import to_plain
from affordance.named_settings import describe_changes

PROTOCOL = """
name: mine
question: What is expected?
objects:
  materials:
    oak: {{colour: "#aa7744", density: 700, density_sd: 70, source: a book}}
  tools:
    - name: short
      components: [{{semi_axes: [0.05, 0.02, 0.02], position: [0.05, 0, 0], material: oak}}]
    - name: long
      components: [{{semi_axes: [0.1, 0.02, 0.02], position: [0.1, 0, 0], material: oak}}]
observers: {observers}
settings: {settings}
blocks:
{blocks}
numbers:
  expected: {{measure: expected mass}}
{numbers}
report: {{title: Mine, summary: Some objects.}}
"""


@pytest.fixture
def load(tmp_path):
    def load(blocks, observers="{}", numbers="", settings="{}", **options):
        path = tmp_path / "mine.yaml"
        path.write_text(PROTOCOL.format(blocks=blocks, observers=observers, numbers=numbers, settings=settings))
        return load_protocol_experiment(str(path), **options)

    return load


HOLD = "  - {name: a, do: {hold: {duration: 0.1}}}"


def test_protocol_changes_settings_by_name_and_a_user_has_the_last_word(load):
    written = "{prior.sd: 8000, noise: {weber_fraction: 0.1}}"
    assert describe_changes(load(HOLD, settings=written).settings) == {
        "prior.sd": 8000.0,
        "noise.weber_fraction": 0.1,
    }
    asked = load(HOLD, settings=written, changes={"prior.sd": 2000.0, "mpc.num_steps": 6}).settings
    assert describe_changes(asked) == {"prior.sd": 2000.0, "noise.weber_fraction": 0.1, "mpc.num_steps": 6}


def test_kinds_of_protocols_are_told_by_what_is_done(load):
    assert isinstance(load("  - {name: a, do: {hold: {duration: 0.1}}}").means, Simulated)
    assert isinstance(load("  - {name: a, do: {clamp: {closed_form: false}}}").means, Simulated)
    said = r"numbers.far.measure: for these presentations in closed form is 'drop', must be one of force"
    with pytest.raises(BadValueError, match=said):
        load("  - {name: a, do: {clamp: {closed_form: true}}}", numbers="  far: {measure: drop}")
    assert isinstance(load_protocol_experiment("linear_plus").means, ClosedForm)
    said = r"blocks\[1\].do: is simulated, must be a clamp in closed form or a look"
    with pytest.raises(BadValueError, match=said):
        load("  - {name: a, do: {clamp: {}}}\n  - {name: b, do: {hold: {}}}")


@pytest.mark.parametrize("closed_form", ["true", "false"])
def test_both_means_take_any_learner_and_give_the_same_arrays(load, closed_form):
    """Runs with a clamp, the one action of both means, have the same class and arrays, in closed form or not."""
    blocks = f"  - {{name: a, do: {{clamp: {{closed_form: {closed_form}, duration: 0.1}}}}}}"
    experiment = load(blocks, observers="{learners: [density, kinds_map]}", numbers="  force: {measure: force}")
    assert type(experiment) is PresentationExperiment
    arrays = experiment.run_observer(None, None, 0)
    wanted = {"presented", "force", "weight", "founds_a_kind", "p_value", "density_mode", "row force", "row expected"}
    for prefix in ("", "kinds_map: "):
        assert {prefix + name for name in wanted} <= set(arrays)
        np.testing.assert_allclose(arrays[f"{prefix}force"][0], 9.81 * arrays[f"{prefix}row expected"][0], rtol=0.02)
    np.testing.assert_array_equal(arrays["presented"], arrays["kinds_map: presented"])
    numbers = experiment.compute_metrics(None, None, {name: array[None] for name, array in arrays.items()})
    assert set(numbers["learners"]) == {"density", "kinds_map"}


def test_who_only_looks_learns_nothing_and_who_holds_does(load):
    looks = "  - {{name: {0}, objects: all, do: {{look: {{}}}}}}\n"
    blocks = looks.format("before") + "  - {name: hold, do: {hold: {duration: 0.3}}}\n" + looks.format("after")
    arrays = load(blocks).run_observer(None, None, 0)
    masses = arrays["parameters_predicted"][:, 0]
    assert masses.shape == (6,)
    assert arrays["presented"].tolist() == [0, 1] * 3
    true = arrays["parameters_true"][:, 0]
    np.testing.assert_array_equal(arrays["density_quantiles"][0], arrays["density_quantiles"][2])
    assert abs(masses[4] / true[4] - 1.0) < abs(masses[0] / true[0] - 1.0)
    assert np.isnan(arrays["height_centre"][[0, 1, 4, 5]]).all()
    assert np.isfinite(arrays["height_centre"][[2, 3]]).all()


def test_who_is_told_expects_what_it_is(load):
    blocks = "  - {name: look, do: {look: {}}}\n"
    arrays = load(blocks, observers="{told: [oak]}").run_observer(None, None, 0)
    np.testing.assert_allclose(arrays["parameters_predicted"][:, 0], arrays["parameters_true"][:, 0], rtol=1e-3)
    with pytest.raises(BadValueError, match=r"told\[0\]: is 'oka', must be one of oak; did you mean 'oak'"):
        load(blocks, observers="{told: [oka]}")
    with pytest.raises(BadValueError, match=r"observers.told: is given, .* where observers learn by kinds"):
        load(blocks, observers="{told: [oak], learners: [kinds_map]}")


def test_clamp_gives_a_force_and_reach_gives_work(load):
    blocks = """
  - {name: clamp, do: {clamp: {closed_form: false, duration: 0.2}}, teaches: false}
"""
    clamp = load(blocks, numbers="  force: {measure: force}").run_observer(None, None, 0)
    expected = 9.81 * clamp["parameters_predicted"][:, 0]
    np.testing.assert_allclose(clamp["force"], expected, rtol=0.01)
    reach = load(
        "  - {name: reach, do: {reach: {path: paths/reach.yaml}}, teaches: false}", observers="{told: [oak]}"
    )
    found = reach.run_observer(None, None, 0)
    assert (found["work"] > 1.0).all()
    assert (found["path_error"] < 0.02).all()


def test_weight_changes_and_learners_stand_side_by_side(load, tmp_path):
    blocks = """
  - name: grow
    repetitions: 2
    order: latin square
    gradual: {object: short, mass_from: 0.05, mass_to: 0.2}
    do: {hold: {duration: 0.1}}
"""
    experiment = load(blocks, observers="{learners: [density, kinds_map]}", numbers="  weight: {measure: weight}")
    arrays = experiment.run_observer(None, None, 0)
    weights = arrays["weight"][arrays["presented"] == 0]
    np.testing.assert_allclose(weights, 9.81 * np.array([0.05, 0.2]), rtol=1e-3)
    np.testing.assert_array_equal(arrays["kinds_map: presented"], arrays["presented"])
    run_experiment(experiment, None, tmp_path / "mine", repeats=2, jobs=1)
    numbers = read_numbers(tmp_path / "mine")
    assert set(numbers["learners"]) == {"density", "kinds_map"}
    assert numbers["learners"]["density"]["expected"] == numbers["expected"]


def test_prediction_of_simulated_presentations_has_every_learner(load, tmp_path):
    load("  - {name: a, do: {hold: {duration: 0.1}}}")
    more = {"repeats": 2, "jobs": 1}
    found = predict_protocol(load_protocol_experiment(str(tmp_path / "mine.yaml")), tmp_path / "out", **more)
    assert set(found.predictions) == {"expected[0]", "expected[1]"}
    assert set(found.predictions["expected[0]"]) == set(Learner)
    assert found.meanings == {"expected": ""}
    with pytest.raises(BadValueError, match="blocks: is a choice"):
        predict_protocol(load_protocol_experiment("reach"), tmp_path / "out", **more)
    load("  - {name: a, do: {hold: {duration: 0.1}}}", observers="{told: [oak]}")
    with pytest.raises(BadValueError, match="told: is given, must be omitted where learners are compared"):
        predict_protocol(load_protocol_experiment(str(tmp_path / "mine.yaml")), tmp_path / "out", **more)


def test_first_block_that_is_not_measured_is_what_simulations_share():
    com, other = (load_hold_experiment("com") for _ in range(2))
    assert to_plain(com.experience) == to_plain(load_protocol_experiment("reach").experience)
    assert com.experience.num_trials == 6
    assert load_hold_experiment("weight").experience is None
    assert shorten(com, 1.0, repetitions=1).experience.num_trials == 2
    assert other.experience.duration == 3.0


def test_edited_copy_of_a_shipped_protocol_is_reported_or_refused_before_it_runs(models):
    """A copy with the same numbers keeps the original's prose; a missing number is refused when the file is read."""
    path = models / "protocols" / "weight.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("duration: 3.0", "duration: 1.0") + "  title: Mine\n", encoding="utf-8")
    experiment = load_protocol_experiment("weight", models)
    assert experiment.report.given == {"title": "Mine"}
    without = text.replace("  deviation_m: {measure: deviation, of: honest}\n", "")
    path.write_text(without.split("report:")[0] + "report: {section: weight}\n", encoding="utf-8")
    with pytest.raises(BadValueError, match="section: is 'weight', whose tables names 'deviation_m', which this"):
        load_protocol_experiment("weight", models)
    path.write_text(without.split("report:")[0] + "report: {section: wieght}\n", encoding="utf-8")
    with pytest.raises(BadValueError, match=r"section: is 'wieght', must be one of .*; did you mean 'weight'\?"):
        load_protocol_experiment("weight", models)
    path.write_text(without.split("report:")[0], encoding="utf-8")
    assert load_protocol_experiment("weight", models).report.prose is None


def test_motions_whose_logs_fill_the_memory_are_refused_before_they_run(load):
    blocks = "  - {name: a, repetitions: 200, do: {hold: {duration: 60}}}"
    load(blocks, settings="{log_period: 0.02}")
    said = refuse(load, blocks)
    assert said.endswith(
        "blocks: hold objects for 24000 s in all, must for at most 20000 s at a log_period of 0.01 s"
    )


def test_observers_whose_numbers_fill_the_memory_are_refused_before_they_run(load, tmp_path):
    blocks = "  - {name: a, repetitions: 1000, times: 10, do: {look: {}}}"
    experiment = load(blocks, observers="{learners: [density, kinds_map]}")
    experiment.check_repeats(50)
    said = refuse(run_suite, [experiment], tmp_path / "out", repeats=51, jobs=1)
    assert said == "--repeats: is 51, must be at most 50 with 40000 presentations each"
    said = refuse(predict_protocol, experiment, tmp_path / "out", repeats=51, jobs=1)
    assert said == "--repeats: is 51, must be at most 50 with 40000 presentations each"
    assert not (tmp_path / "out").exists()


def test_a_reach_that_lasts_too_long_for_its_periods_names_its_file(load, tmp_path):
    (tmp_path / "path.yaml").write_text("duration: 30\ntolerance: 0.02\npoints: [[0, 0, 0.1]]\n", encoding="utf-8")
    said = refuse(load, "  - {name: a, do: {reach: {path: path.yaml}}}", settings="{control_period: 0.0001}")
    assert "path.yaml: duration: is 30 s, must be at most 20 s, which are 200000 times control_period" in said
