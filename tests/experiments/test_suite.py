"""Running made-up experiments into one folder, so that only the suite's own work is tested."""

import dataclasses
import pickle

import pytest
from helpers.changed_files import change_file
from helpers.refusals import refuse
from helpers.short_holds import with_settings

from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, InfeasibleError, StallError, UnavailableError
from affordance.experiments import suite
from affordance.files.model_folder import MODELS
from affordance.named_settings import change_settings
from affordance.proprioception.faults import Faults
from affordance.robots.changes import write_lacks
from affordance.runs.repeats import compute_key
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.features import FeatureSource

# Arguments of a run of one repeat.
ONCE = {"models": MODELS, "seed": 0, "repeats": 1, "jobs": 1}


def list_files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


class MadeUp:
    """An experiment that writes down the arguments of its run."""

    def __init__(self, name, settings, seed):
        self.name, self.settings, self.seed = name, settings, seed

    def plan(self, jobs):
        return f"planned in {jobs} jobs"

    def check_repeats(self, repeats):
        pass


@pytest.fixture
def made_up(monkeypatch):
    """Two made-up experiments, "one" and "other"."""
    monkeypatch.setattr(
        suite,
        "load_experiment",
        lambda name, models, seed, settings, changes: MadeUp(
            name, change_settings(settings, changes), f"{models.name}, {seed}"
        ),
    )

    def run_experiment(experiment, plan, folder, *, repeats, jobs):
        found = ", ".join(list_files(folder.parent))
        source = experiment.settings.feature_source.value
        said = (
            f"{experiment.name}: {experiment.seed}, {source}, {plan}, {repeats} repeats, {jobs} jobs; found {found}"
        )
        (folder / "ran.txt").write_text(said, encoding="utf-8")

    monkeypatch.setattr(suite, "run_experiment", run_experiment)


def test_experiments_are_run_in_turn_each_in_a_folder_of_its_name(made_up, tmp_path):
    out = tmp_path / "deep" / "out"
    announced = []

    def announce(report):
        announced.append((report, sorted(path.name for path in out.glob("*/ran.txt")), list_files(out)[0]))

    result = suite.run_suite(["other", "one"], out, models=MODELS, seed=3, repeats=7, jobs=2, announce=announce)
    # After the first of them, there is a report.
    assert announced == [(out / "report.html", ["ran.txt"], "other/ran.txt")]
    assert result == (out / "report.html", {})
    assert list_files(out) == ["one/ran.txt", "other/ran.txt", "report.html"]
    said = "models, 3, features, planned in 2 jobs, 7 repeats, 2 jobs; found "
    assert (out / "other" / "ran.txt").read_text(encoding="utf-8") == f"other: {said}"
    assert (out / "one" / "ran.txt").read_text(encoding="utf-8") == f"one: {said}other/ran.txt, report.html"


def test_arm_faults_learner_and_source_of_features_are_those_asked_for(made_up, tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(suite, "run_experiment", lambda experiment, *_, **__: seen.append(experiment.settings))
    changes = {"feature_source": "pixels", "learner": "kinds_map"}
    suite.run_suite(["one"], tmp_path, **ONCE, changes=changes, faults=["bias", "dropped_samples"])
    suite.run_suite(["one"], tmp_path, **ONCE)
    asked, usual = seen
    assert asked.arm == usual.arm == MODELS / "arm.dmd.yaml"
    assert asked.feature_source is FeatureSource.PIXELS
    assert asked.faults == Faults(bias_sd=3.0, drop_probability=0.3)
    assert (usual.learner, asked.learner) == (Learner.DENSITY, Learner.KINDS_MAP)


def refuse_other(self, jobs):
    """Plans the experiment "one" and refuses the experiment "other"."""
    if self.name == "other":
        raise BadValueError("nail.yaml", "blow", "cannot be carried out")


def test_experiment_that_cannot_be_planned_is_left_out_and_named(made_up, tmp_path, monkeypatch, caplog):
    """The log names an infeasible experiment before any is run, and the report names it afterwards."""
    monkeypatch.setattr(MadeUp, "plan", refuse_other)
    result = suite.run_suite(["other", "one"], tmp_path, **ONCE)
    assert result.left_out == {"other": "nail.yaml: blow: cannot be carried out"}
    assert "other is left out: nail.yaml: blow: cannot be carried out" in caplog.text
    assert list_files(tmp_path) == ["left_out.json", "one/ran.txt", "report.html"]
    assert "nail.yaml: blow: cannot be carried out" in result.report.read_text(encoding="utf-8")


def fail_for_one(monkeypatch, error):
    """Lets the experiment "one" fail while it is run."""
    run = suite.run_experiment

    def run_other(experiment, *arguments, **options):
        if experiment.name == "one":
            raise error
        run(experiment, *arguments, **options)

    monkeypatch.setattr(suite, "run_experiment", run_other)


def test_experiment_that_ends_while_it_is_run_is_left_out_and_the_next_is_run(made_up, tmp_path, monkeypatch):
    fail_for_one(monkeypatch, StallError("stick", 0.8, 5, ()))
    result = suite.run_suite(["one", "other"], tmp_path, **ONCE)
    assert "stalls" in result.left_out["one"]
    assert (tmp_path / "other" / "ran.txt").exists()


def test_report_forgets_what_was_left_out_once_it_is_done(made_up, tmp_path, monkeypatch):
    """A later run that succeeds names nothing as left out; the section of an infeasible experiment is removed."""
    section = tmp_path / "other" / "section.json"
    with monkeypatch.context() as patch:
        patch.setattr(MadeUp, "plan", refuse_other)
        section.parent.mkdir()
        section.write_text("{}", encoding="utf-8")
        suite.run_suite(["other", "one"], tmp_path, **ONCE)
        assert not section.exists()
    report, left_out = suite.run_suite(["other"], tmp_path, **ONCE)
    assert not left_out
    assert "cannot be carried out" not in report.read_text(encoding="utf-8")
    assert not (tmp_path / "left_out.json").exists()


def test_new_run_removes_the_comparison_of_former_runs(made_up, tmp_path):
    for name in ("agreement", "vision_comparison"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "section.json").write_text("{}", encoding="utf-8")
    suite.run_suite(["one"], tmp_path, **ONCE)
    assert not list(tmp_path.glob("*/section.*"))


def test_nothing_is_written_where_none_of_them_can_be_done(made_up, tmp_path, monkeypatch):
    monkeypatch.setattr(MadeUp, "plan", refuse_other)
    assert "cannot be carried out" in refuse(suite.run_suite, ["other"], tmp_path / "out", **ONCE)
    assert not (tmp_path / "out").exists()


def test_what_the_import_of_the_arm_could_not_fit_is_not_planned_again(made_up, tmp_path, models, monkeypatch):
    """Experiments that the import found infeasible are not planned again unless a file was changed."""
    write_lacks(models, {"path": "stick by wood leaves the path by 0.05 m"})
    planned = []
    monkeypatch.setattr(MadeUp, "plan", lambda self, jobs: planned.append(self.name))
    arguments = {**ONCE, "models": models}
    result = suite.run_suite(["weight", "reach", "hammer"], tmp_path / "out", **arguments)
    assert planned == ["weight", "hammer"]
    assert result.left_out["reach"].endswith("as its import found: stick by wood leaves the path by 0.05 m")
    with pytest.raises(InfeasibleError, match="leaves the path"):
        suite.run_suite(["reach"], tmp_path / "alone", **arguments)
    change_file(models / "paths" / "reach.yaml", "duration: 2.0", "duration: 4.0")
    assert not suite.run_suite(["reach"], tmp_path / "out", **arguments).left_out


def test_arm_that_cannot_hold_the_objects_of_one_experiment_does_the_others(tmp_path, models, monkeypatch):
    large = ("semi_axes: [0.125, 0.015, 0.015]", "semi_axes: [0.125, 0.06, 0.06]")
    change_file(models / "tools" / "weight.yaml", *large)
    ran = []
    monkeypatch.setattr(suite, "run_experiment", lambda experiment, *_, **__: ran.append(experiment.name))
    result = suite.run_suite(["weight", "com"], tmp_path / "out", models=models, seed=0, repeats=1, jobs=1)
    assert ran == ["com"]
    assert "loads" in result.left_out["weight"]


def test_experiment_that_does_not_work_on_this_machine_is_left_out(made_up, tmp_path, monkeypatch, caplog):
    """An experiment that lacks a library is left out with a message, and is an error if it runs alone."""
    fail_for_one(monkeypatch, UnavailableError("rendered pictures are", "libEGL.so.1 is missing"))
    suite.run_suite(["one", "other"], tmp_path, **ONCE)
    assert list_files(tmp_path) == ["left_out.json", "other/ran.txt", "report.html"]
    assert "one is left out: rendered pictures are" in caplog.text
    assert "libEGL.so.1 is missing" in refuse(suite.run_suite, ["one"], tmp_path, error=UnavailableError, **ONCE)


def test_leftovers_of_a_killed_run_are_removed_wherever_they_lie_before_anything_is_run(made_up, tmp_path):
    kept = tmp_path / "experience" / "0123" / "repeat_00000.npz"
    kept.parent.mkdir(parents=True)
    kept.write_text("kept", encoding="utf-8")
    for folder in (tmp_path, kept.parent, tmp_path / "one"):
        folder.mkdir(exist_ok=True)
        (folder / ".writing.123.repeat_00001.npz").write_text("half", encoding="utf-8")
    suite.run_suite(["one"], tmp_path, **ONCE)
    assert (
        (tmp_path / "one" / "ran.txt").read_text(encoding="utf-8").endswith("found experience/0123/repeat_00000.npz")
    )
    assert kept.read_text(encoding="utf-8") == "kept"


def test_models_of_which_one_experiment_is_wrong_start_none(tmp_path, models):
    """A wrong file of one experiment is refused before the other, whose files are right, is started."""
    change_file(models / "tools" / "novel.yaml", "material: steel}", "material: brass}")
    with pytest.raises(BadValueError, match=r"novel.yaml: tools: stick: looks like brass, must look like what"):
        suite.run_suite(["weight", "reach"], tmp_path / "out", models=models, seed=0, repeats=1, jobs=1)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", suite.EXPERIMENTS)
def test_experiments_share_their_settings_and_can_be_pickled_and_given_others(name):
    """All have the arm, noise, prior and controller of the defaults; a copy with others is known by its key."""
    experiment = suite.load_experiment(name, MODELS, 5, DEFAULT_SETTINGS)
    assert experiment.section.exists()
    assert experiment.count_repeats(2) >= 2
    finer = dataclasses.replace(DEFAULT_SETTINGS, control_period=0.004)
    other = with_settings(experiment, finer)
    assert other.settings == finer
    assert (experiment.name, experiment.seed, experiment.settings) == (name, 5, DEFAULT_SETTINGS)
    again = pickle.loads(pickle.dumps(other))
    assert (again.name, again.seed, again.settings) == (name, 5, finer)
    assert compute_key(again, MODELS) == compute_key(other, MODELS) != compute_key(experiment, MODELS)
