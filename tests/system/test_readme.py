"""What the README shows works as it says."""

import re
import shutil
from pathlib import Path

import affordance
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.experiments.runner import run_experiment
from affordance.files.model_folder import MODELS

README = (Path(__file__).parents[2] / "README.md").read_text()


def find_blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def run_block(block, capsys):
    exec(block, {})
    return capsys.readouterr().out.splitlines()


def test_example_of_ranking_runs(capsys):
    lines = run_block(find_blocks("python")[0], capsys)
    assert len(lines) == 8
    assert re.fullmatch(r"stick by steel: \d+\.\d J, best with probability 1\.00", lines[4])


def test_example_of_an_observer_runs(capsys):
    lines = run_block(find_blocks("python")[1], capsys)
    assert len(lines) == 5
    assert lines[0].startswith("rod_10cm: sank ")
    assert [line.endswith("; grossly surprising") for line in lines] == [False] * 4 + [True]


def test_own_objects_make_an_experiment(tmp_path):
    models = tmp_path / "my_models"
    shutil.copytree(MODELS, models)
    (models / "tools" / "weight.yaml").write_text(find_blocks("yaml")[0])
    config = load_hold_experiment("weight", models)
    assert [tool.name for tool in config.tools] == ["small", "dumb-bell", "decoy"]
    run_experiment(config, None, tmp_path / "results", repeats=1, jobs=1)
    assert (tmp_path / "results" / "metrics.json").exists()


def test_files_linked_exist():
    root = Path(__file__).parents[2]
    targets = re.findall(r"\]\(([^)#]+)\)", README)
    assert len(targets) > 8
    for target in targets:
        assert (root / target).exists(), target


def test_every_public_name_is_there():
    for name in affordance.__all__:
        assert getattr(affordance, name) is not None
