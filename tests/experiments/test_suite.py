"""Running experiments into one folder: made-up experiments, so that only what is around them is run."""

import dataclasses
import pickle
import shutil

import pytest

from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, UnavailableError
from affordance.experiments import suite
from affordance.files.model_folder import MODELS
from affordance.named_settings import change_settings
from affordance.proprioception.faults import Faults
from affordance.runs.repeats import compute_key
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.features import FeatureSource


def list_files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


class MadeUp:
    """An experiment that writes down what it is run with."""

    def __init__(self, name, settings, seed):
        self.name, self.settings, self.seed = name, settings, seed

    def plan(self, jobs):
        return f"planned in {jobs} jobs"


@pytest.fixture
def made_up(monkeypatch):
    """Two such experiments, "one" and "other"."""
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
    report = suite.run_suite(["other", "one"], out, models=MODELS, seed=3, repeats=7, jobs=2)
    assert report == out / "report.html"
    assert list_files(out) == ["one/ran.txt", "other/ran.txt", "report.html"]
    said = "models, 3, features, planned in 2 jobs, 7 repeats, 2 jobs; found "
    assert (out / "other" / "ran.txt").read_text(encoding="utf-8") == f"other: {said}"
    assert (out / "one" / "ran.txt").read_text(encoding="utf-8") == f"one: {said}other/ran.txt"


def test_arm_faults_and_source_of_features_are_those_asked_for(made_up, tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(suite, "run_experiment", lambda experiment, *_, **__: seen.append(experiment.settings))
    arguments = {"models": MODELS, "seed": 0, "repeats": 1, "jobs": 1, "changes": {"feature_source": "pixels"}}
    suite.run_suite(["one"], tmp_path, **arguments, faults=["bias", "dropped_samples"])
    (settings,) = seen
    assert settings.arm == MODELS / "arm.dmd.yaml"
    assert settings.feature_source is FeatureSource.PIXELS
    assert settings.faults == Faults(bias_sd=3.0, drop_probability=0.3)


def test_learner_is_the_papers_or_that_asked_for(made_up, tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(
        suite, "run_experiment", lambda experiment, *_, **__: seen.append(experiment.settings.learner)
    )
    arguments = {"models": MODELS, "seed": 0, "repeats": 1, "jobs": 1}
    suite.run_suite(["one"], tmp_path, **arguments)
    suite.run_suite(["one"], tmp_path, **arguments, changes={"learner": "kinds_map"})
    assert seen == [Learner.DENSITY, Learner.KINDS_MAP]


def test_nothing_is_written_where_one_of_them_cannot_be_planned(made_up, tmp_path, monkeypatch):
    """Not even what was asked for before it."""

    def plan(self, jobs):
        if self.name == "other":
            raise BadValueError("nail.yaml", "blow", "cannot be carried out")

    monkeypatch.setattr(MadeUp, "plan", plan)
    with pytest.raises(BadValueError, match="cannot be carried out"):
        suite.run_suite(["one", "other"], tmp_path / "out", models=MODELS, seed=0, repeats=1, jobs=1)
    assert not (tmp_path / "out").exists()


def test_experiment_that_does_not_work_on_this_machine_is_left_out(made_up, tmp_path, monkeypatch, caplog):
    """Alone it is an error, as nothing would be left."""
    run = suite.run_experiment

    def fail_for_one(experiment, plan, folder, *, repeats, jobs):
        if experiment.name == "one":
            raise UnavailableError("rendered pictures are", "libEGL.so.1 is missing")
        run(experiment, plan, folder, repeats=repeats, jobs=jobs)

    monkeypatch.setattr(suite, "run_experiment", fail_for_one)
    suite.run_suite(["one", "other"], tmp_path, models=MODELS, seed=0, repeats=1, jobs=1)
    assert list_files(tmp_path) == ["other/ran.txt", "report.html"]
    assert "one is left out: rendered pictures are" in caplog.text
    with pytest.raises(UnavailableError, match=r"libEGL.so.1 is missing"):
        suite.run_suite(["one"], tmp_path, models=MODELS, seed=0, repeats=1, jobs=1)


def test_leftovers_of_a_killed_run_are_removed_wherever_they_lie_before_anything_is_run(made_up, tmp_path):
    kept = tmp_path / "experience" / "0123" / "repeat_00000.npz"
    kept.parent.mkdir(parents=True)
    kept.write_text("kept", encoding="utf-8")
    for folder in (tmp_path, kept.parent, tmp_path / "one"):
        folder.mkdir(exist_ok=True)
        (folder / ".writing.123.repeat_00001.npz").write_text("half", encoding="utf-8")
    suite.run_suite(["one"], tmp_path, models=MODELS, seed=0, repeats=1, jobs=1)
    assert (
        (tmp_path / "one" / "ran.txt").read_text(encoding="utf-8").endswith("found experience/0123/repeat_00000.npz")
    )
    assert kept.read_text(encoding="utf-8") == "kept"


def test_models_of_which_one_experiment_is_wrong_start_none(tmp_path):
    """Weight's own files are right; what reach chooses about is not."""
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / "tools" / "novel.yaml"
    path.write_text(
        path.read_text(encoding="utf-8").replace("material: steel}", "material: brass}"), encoding="utf-8"
    )
    with pytest.raises(BadValueError, match=r"novel.yaml: tools: stick: looks like brass, must look like what"):
        suite.run_suite(["weight", "reach"], tmp_path / "out", models=tmp_path / "models", seed=0, repeats=1, jobs=1)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", suite.EXPERIMENTS)
def test_all_experiments_share_arm_noise_prior_and_controller(name):
    experiment = suite.load_experiment(name, MODELS, 5, DEFAULT_SETTINGS)
    assert experiment.name == name
    assert experiment.settings == DEFAULT_SETTINGS
    assert experiment.seed == 5
    assert experiment.section.exists()
    assert experiment.count_repeats(2) >= 2


@pytest.mark.parametrize("name", suite.EXPERIMENTS)
def test_experiment_can_be_pickled_and_given_other_settings(name):
    experiment = suite.load_experiment(name, MODELS, 5, DEFAULT_SETTINGS)
    finer = dataclasses.replace(DEFAULT_SETTINGS, control_period=0.004)
    other = experiment.with_settings(finer)
    assert other.settings == finer
    assert experiment.settings == DEFAULT_SETTINGS
    again = pickle.loads(pickle.dumps(other))
    assert (again.name, again.seed, again.settings) == (name, 5, finer)
    assert compute_key(again, MODELS) == compute_key(other, MODELS) != compute_key(experiment, MODELS)
