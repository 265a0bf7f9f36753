"""``affordance import-arm`` refuses options and files that make no arm, and writes nothing."""

from pathlib import Path

import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from helpers.robot_files import write_urdf

from affordance.commands.robots import import_arm


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--rotor-inertia right_j1=-1", "--rotor-inertia: is -1 for right_j1, must be at least 0 kg m^2"),
        ("--effort 0", "--effort: is 0, must be more than 0 N m"),
        ("--effort right_j1=heavy", "--effort: is 'right_j1=heavy', must be JOINT=VALUE"),
        ("--effort heavy", "--effort: is 'heavy', must be a number or JOINT=VALUE"),
        ("--effort nan", "--effort: is 'nan', must be a number or JOINT=VALUE"),
        ("--package parts", "--package: is 'parts', must be a name, = and a value"),
        ("--out .", "--out: is '.', which is not an empty folder"),
    ],
)
def test_mistake_in_an_option_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, said: str
) -> None:
    write_urdf(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command(*f"import-arm two_arms.urdf --tip right_tool --out new {words}".split())


def test_file_and_tip_must_be_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_urdf(tmp_path)
    monkeypatch.chdir(tmp_path)
    said = refuse_command("import-arm", "none.urdf", "--tip", "a", "--out", "new")
    assert "none.urdf: cannot be read: No such file" in said
    said = refuse_command("import-arm", "two_arms.urdf", "--out", "new")
    assert (
        "--tip: is missing, must be the link or frame of two_arms.urdf that holds objects; limbs end in right_4 (4 "
        "joints)" in said
    )


def test_answer_as_json_names_the_folder_and_the_findings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_arm, "import_arm", lambda *_, **__: ["7 joints", "warning: no mesh"])
    content = answer("import-arm", "any.urdf", "--out", tmp_path / "new", "--json").content
    assert content["folder"] == str(tmp_path / "new")
    assert content["findings"] == ["7 joints", "warning: no mesh"]
