"""A good file is read into a data model; ``tests/system/bad_values/protocols.yaml`` has files that are refused."""

from helpers.invented_model import Fruit, Outer

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
