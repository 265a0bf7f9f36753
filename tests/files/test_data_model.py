"""A good file is read into a data model; ``tests/system/bad_values/protocols.yaml`` has files that are refused."""

import pytest
from helpers.invented_model import Fruit, Outer
from helpers.refusals import refuse

from affordance.files.constraints import complain
from affordance.files.data_model import load_model


def test_good_file_is_read(tmp_path):
    text = (
        "name: x\nparts: [{length: 1.0}]\nnamed: {a: {length: 2}}\nfrom: 3\norder: latin square\nplace: [0.5, -1]\n"
    )
    (tmp_path / "file.yaml").write_text(text)
    found = load_model(tmp_path / "file.yaml", Outer)
    assert (found.parts[0].length, found.named["a"].length, found.first) == (1.0, 2.0, 3)
    assert (found.order, found.place, found.parts[0].kind) == ("latin square", (0.5, -1.0), Fruit.APPLE)


def test_complaint_of_a_check_names_the_place_below():
    found = complain("is 3, must be 4", "[1]")
    assert found.context == {"problem": "is 3, must be 4", "at": "[1]"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("KEY=hidden", "is a text, must be a mapping of keys to values"),
        ("[hidden]", "is a list, must be a mapping"),
        ("", "is empty, must be a mapping"),
        ("12345678", "is a single value, must be a mapping"),
        ("!hidden {}", "line 1, column 1: is not YAML: could not determine a constructor for the tag"),
        ("a: *hidden", "line 1, column 4: is not YAML: found undefined alias"),
        ("a: &hidden 1\nb: &hidden 2\nc: [", "is not YAML"),
        ("a: !hidden!b c", "is not YAML: found undefined tag handle"),
        ("a: !!int hidden", "is not YAML: invalid literal for int() with base 10:"),
        ("a: !!float hidden", "is not YAML: could not convert string to float:"),
    ],
)
def test_a_whole_file_of_another_kind_is_not_quoted(tmp_path, text, said):
    (tmp_path / "file.yaml").write_text(text)
    message = refuse(load_model, tmp_path / "file.yaml", Outer)
    assert said in message
    assert "hidden" not in message
    assert "1234" not in message.replace(str(tmp_path), "")
