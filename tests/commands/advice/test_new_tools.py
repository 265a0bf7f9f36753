"""The file of tools to fill in can be ranked as it is, and is not written over another."""

from pathlib import Path

from helpers.answers import answer

from affordance.objects.load import load_tools


def test_file_can_be_ranked_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    said = answer("new-tools", path).lines
    assert said[-1] == f"affordance rank hammer --tools {path}"
    (tool,) = load_tools(path)
    assert [grip.name for grip in tool.grips] == ["handle", "choked"]
    content = answer("rank", "hammer", "--tools", path, "--samples", "200", "--json").content
    assert content["unknown"] == []
    assert all(each["usable"] for each in content["options"])
    uncommented = path.read_text().replace("    # mass", "    mass")
    path.write_text(uncommented)
    assert load_tools(path)[0].weighings == (((), 0.665, 0.005),)


def test_no_file_is_written_over(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("mine")
    assert "exists already, must be a new file" in answer("new-tools", path, status=2).err
    assert path.read_text() == "mine"
    assert "must be in an existing folder, but" in answer("new-tools", tmp_path / "no" / "mine.yaml", status=2).err
