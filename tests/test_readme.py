"""What the README shows works as it says."""

import re
import shutil
from pathlib import Path

import affordance
from affordance.experiments import weight
from affordance.tools import MODELS

README = (Path(__file__).parents[1] / "README.md").read_text()


def find_block(language):
    return re.search(rf"```{language}\n(.*?)```", README, re.DOTALL).group(1)


def test_python_example_runs(capsys):
    exec(find_block("python"), {})
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5
    assert lines[0].startswith("rod_10cm: sank ")


def test_own_objects_make_an_experiment(tmp_path):
    models = tmp_path / "my_models"
    shutil.copytree(MODELS, models)
    (models / "tools" / "weight.yaml").write_text(find_block("yaml"))
    config = weight.load_config(models)
    assert [tool.name for tool in config.tools] == ["small", "dumb-bell", "decoy"]
    weight.run(config, tmp_path / "results", repeats=1, jobs=1)
    assert (tmp_path / "results" / "metrics.json").exists()


def test_files_linked_exist():
    root = Path(__file__).parents[1]
    targets = re.findall(r"\]\(([^)#]+)\)", README)
    assert len(targets) > 8
    for target in targets:
        assert (root / target).exists(), target


def test_every_public_name_is_there():
    for name in affordance.__all__:
        assert getattr(affordance, name) is not None
