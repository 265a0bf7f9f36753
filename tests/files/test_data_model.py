"""A file is read into a data model, or refused with its first mistake."""

import enum
from typing import Annotated, Literal

import pytest
from helpers.refusals import refuse
from pydantic import Field

from affordance.files.constraints import OneOf, Text, Vector, Whole, Within, complain
from affordance.files.data_model import DataModel, load_model


class Fruit(enum.Enum):
    APPLE = "apple"
    PEAR = "pear"


class Inner(DataModel):
    length: Annotated[float, Within(0.0, 2.0)]
    kind: Annotated[Fruit, OneOf(Fruit)] = Fruit.APPLE


class Outer(DataModel):
    name: Annotated[str, Text()]
    count: Annotated[int, Whole(1, 10)] = 1
    place: Annotated[tuple[float, float], Vector(2, Within(-1.0, 1.0))] = (0.0, 0.0)
    order: Literal["fixed", "latin square"] = "fixed"
    parts: Annotated[list[Inner], Field(min_length=1)] = Field(default_factory=list)
    named: dict[str, Inner] = Field(default_factory=dict)
    first: Annotated[Annotated[int, Whole()] | None, Field(alias="from")] = None


GOOD = "name: x\nparts: [{length: 1.0}]\nnamed: {a: {length: 2}}\nfrom: 3\n"


def test_good_file_is_read(tmp_path):
    (tmp_path / "file.yaml").write_text(GOOD + "order: latin square\nplace: [0.5, -1]\n")
    found = load_model(tmp_path / "file.yaml", Outer)
    assert (found.parts[0].length, found.named["a"].length, found.first) == (1.0, 2.0, 3)
    assert (found.order, found.place, found.parts[0].kind) == ("latin square", (0.5, -1.0), Fruit.APPLE)


def test_complaint_of_a_check_names_the_place_below():
    found = complain("is 3, must be 4", "[1]")
    assert found.context == {"problem": "is 3, must be 4", "at": "[1]"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("name: x", "nome: x", "name: is missing; is 'nome' misspelt?"),
        ("name: x", "name: ' '", "name: is ' ', must be a non-empty text"),
        (
            "from: 3",
            "form: 3",
            "form: is not a key known here (known: name, count, place, order, parts, named, from); did you mean"
            " 'from'?",
        ),
        ("from: 3", "count: 1.5", "count: is 1.5, must be a whole number"),
        ("from: 3", "count: 11", "count: is 11, must be from 1 to 10"),
        ("from: 3", "place: [0, 2]", "place[1]: is 2, must be from -1 to 1"),
        (
            "from: 3",
            "order: latin sqare",
            "order: is 'latin sqare', must be one of fixed, latin square; did you mean 'latin square'?",
        ),
        ("{length: 1.0}", "{length: true}", "parts[0].length: is True, must be a number"),
        (
            "{length: 1.0}",
            "{length: 1.0, kind: peer}",
            "parts[0].kind: is 'peer', must be one of apple, pear; did you mean 'pear'?",
        ),
        ("{length: 1.0}", "{length: 1.0, hue: 1}", "parts[0].hue: is not a key known here (known: length, kind)"),
        ("{length: 1.0}", "3", "parts[0]: is 3, must be a mapping of keys to values"),
        ("[{length: 1.0}]", "[]", "parts: is [], must be a list with at least one entry"),
        ("{a: {length: 2}}", "{a: {lenth: 2}}", "named.a.length: is missing; is 'lenth' misspelt?"),
        ("{a: {length: 2}}", "{7: {length: 2}}", "named: the key 7 must be a text"),
        ("from: 3", "from: .inf", "from: is inf, must be finite"),
    ],
)
def test_first_mistake_is_refused_with_its_place_and_bound(tmp_path, old, new, said):
    (tmp_path / "file.yaml").write_text(GOOD.replace(old, new))
    assert f"file.yaml: {said}" in refuse(load_model, tmp_path / "file.yaml", Outer)


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
