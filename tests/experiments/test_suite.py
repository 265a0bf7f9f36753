"""Running experiments into one folder: made-up experiments, so that only what is around them is run."""

import shutil
from types import SimpleNamespace

import pytest

from affordance.exceptions import BadValueError
from affordance.experiments import suite
from affordance.files.model_folder import MODELS
from affordance.settings import DEFAULT_SETTINGS


def list_files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


@pytest.fixture
def made_up(monkeypatch):
    """Two experiments that write down what they are run with."""

    def make(name):
        def load_config(models, seed, feature_source):
            return f"{name}: {models.name}, seed {seed}, {feature_source.value}"

        def run(config, folder, *, repeats, jobs):
            found = ", ".join(list_files(folder.parent))
            (folder / "ran.txt").write_text(f"{config}, {repeats} repeats, {jobs} jobs; found {found}")

        return SimpleNamespace(load_config=load_config, run=run)

    experiments = {name: make(name) for name in ("one", "other")}
    monkeypatch.setattr(suite, "EXPERIMENTS", experiments)


def test_experiments_are_run_in_turn_each_in_a_folder_of_its_name(made_up, tmp_path):
    out = tmp_path / "deep" / "out"
    report = suite.run_suite(["other", "one"], out, models=MODELS, seed=3, repeats=7, jobs=2)
    assert report == out / "report.html"
    assert list_files(out) == ["one/ran.txt", "other/ran.txt", "report.html"]
    assert (out / "other" / "ran.txt").read_text() == "other: models, seed 3, features, 7 repeats, 2 jobs; found "
    assert (
        out / "one" / "ran.txt"
    ).read_text() == "one: models, seed 3, features, 7 repeats, 2 jobs; found other/ran.txt"


def test_leftovers_of_a_killed_run_are_removed_wherever_they_lie_before_anything_is_run(made_up, tmp_path):
    kept = tmp_path / "experience" / "0123" / "repeat_00000.npz"
    kept.parent.mkdir(parents=True)
    kept.write_text("kept")
    for folder in (tmp_path, kept.parent, tmp_path / "one"):
        folder.mkdir(exist_ok=True)
        (folder / ".writing.123.repeat_00001.npz").write_text("half")
    suite.run_suite(["one"], tmp_path, models=MODELS, seed=0, repeats=1, jobs=1)
    assert (tmp_path / "one" / "ran.txt").read_text().endswith("found experience/0123/repeat_00000.npz")
    assert kept.read_text() == "kept"


def test_models_of_which_one_experiment_is_wrong_start_none(tmp_path):
    """Weight's own files are right; what reach chooses about is not."""
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / "tools" / "novel.yaml"
    path.write_text(path.read_text().replace("material: steel}", "material: brass}"))
    with pytest.raises(BadValueError, match=r"novel.yaml: tools: stick: looks like brass, must look like what"):
        suite.run_suite(["weight", "reach"], tmp_path / "out", models=tmp_path / "models", seed=0, repeats=1, jobs=1)
    assert not (tmp_path / "out").exists()


def test_all_simulations_share_arm_noise_prior_and_controller():
    for experiment in suite.EXPERIMENTS.values():
        config = experiment.load_config()
        assert getattr(config, "experience", config).settings == DEFAULT_SETTINGS
