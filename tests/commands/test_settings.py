"""``affordance settings``, and ``--set`` wherever settings are used."""

import json

import pytest
import xarray

from affordance.cli import main

SMALL = ["--repeats", "1", "--jobs", "1"]


def test_settings_are_listed_with_value_unit_and_source(capsys):
    assert main(["settings"]) == 0
    out = capsys.readouterr().out
    assert "prior.sd = 4000 kg/m^3\n" in out
    assert "(Ross & Gregory" in out
    assert "noise.model = weber\n" in out


def test_some_are_listed_by_name_with_what_was_set(capsys):
    assert main(["settings", "prior", "--set", "prior.sd=8000"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if not line.startswith(" ")] == [
        "prior.mode = 1000 kg/m^3",
        "prior.sd = 8000 kg/m^3",
        "prior.deviation_sd = 100 kg/m^3",
    ]
    assert any("Source: --set." in line for line in lines)


def test_unknown_name_is_answered_with_the_nearest(capsys):
    assert main(["settings", "priors"]) == 2
    assert "did you mean 'prior'?" in capsys.readouterr().err


@pytest.mark.usefixtures("unrendered")
def test_set_changes_what_is_run_and_stands_in_the_results(tmp_path, capsys):
    assert main(["run", "two_families", *SMALL, "--out", str(tmp_path), "--set", "noise.weber_fraction=0.13"]) == 0
    folder = tmp_path / "two_families"
    numbers = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    assert numbers["config"]["settings"]["noise"]["weber_fraction"] == 0.13
    assert numbers["setup"]["settings"] == {"noise.weber_fraction": 0.13}
    assert numbers["setup"]["models"] == "those of the program"
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "changed settings: noise.weber_fraction = 0.13<" in page
    assert "<h1>Visual inertial affordances: the paper" not in page
    with xarray.open_dataset(folder / "trajectories.nc", engine="scipy") as dataset:
        assert len(dataset.to_dataframe()) == dataset["tool"].size  # a row a lift


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "weight", "--set", "prior.sd=-1"], "settings: prior.sd: is -1, must be from 0.001 to 1e+12"),
        (
            ["run", "weight", "--learner", "kinds_map", "--set", "learner=density"],
            "is given with --learner, only one of them must be",
        ),
        (["run", "linear_plus", "--set", "noise.model=white"], "noise: is WhiteNoise, must be WeberNoise for lifts"),
        (
            ["run", "linear_plus", "--set", "learner=density"],
            "settings.learner: is given with observers.learners, only one of them must be",
        ),
        (["predict", "two_families", "--set", "prior.sb=1"], "must be one of prior.mode, prior.sd"),
        (["robustness", "--set", "prior.sd=3"], "--set: prior.sd: changes nothing here: the sample varies it"),
        (["study", "people", "--set", "learner=density"], "--set: learner: changes nothing here"),
        (["study", "learners", "--set", "accuracy=7"], "settings: accuracy: is 7, must be from 1e-12 to 1"),
        (["study", "tools", "--set", "prior.mode=-7"], "settings: prior.mode: is -7, must be from 0 to 25000"),
        (["study", "arms", "--robots", ".", "--set", "prior.mode=-7"], "settings: prior.mode: is -7"),
        (["fit-kappa", "--set", "noise.independent_samples=true"], "noise.independent_samples: is true, must be"),
        (
            ["identify", "r.urdf", "--loaded", "l.csv", "--set", "mpc.horizon=1"],
            "--set: mpc.horizon: changes",
        ),
    ],
)
def test_wrong_settings_are_refused_in_one_line_and_nothing_is_written(words, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())
