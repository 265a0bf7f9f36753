"""What the README shows works as it says."""

import re
from pathlib import Path

import affordance
from affordance.tools import MODELS, load_materials, load_tools

README = (Path(__file__).parents[1] / "README.md").read_text()


def find_block(language):
    return re.search(rf"```{language}\n(.*?)```", README, re.DOTALL).group(1)


def test_python_example_runs(capsys):
    exec(find_block("python"), {})
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5
    assert lines[0].startswith("rod_10cm: sank ")


def test_tools_file_is_read(tmp_path):
    path = tmp_path / "tools.yaml"
    path.write_text(find_block("yaml"))
    (hammer,) = load_tools(path, load_materials(MODELS / "materials.yaml"))
    assert [part.material.name for part in hammer.components] == ["beech", "steel"]


def test_files_linked_exist():
    root = Path(__file__).parents[1]
    targets = re.findall(r"\]\(([^)#]+)\)", README)
    assert len(targets) > 8
    for target in targets:
        assert (root / target).exists(), target


def test_every_public_name_is_there():
    for name in affordance.__all__:
        assert getattr(affordance, name) is not None
