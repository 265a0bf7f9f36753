"""Every mistake in a file is one line with file, key, value, bound and the nearest name."""

import enum
from typing import Annotated, Literal

import pytest
from pydantic import Field

from affordance.exceptions import BadValueError
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


@pytest.fixture
def read(tmp_path):
    def read(text):
        (tmp_path / "file.yaml").write_text(text)
        return load_model(tmp_path / "file.yaml", Outer)

    return read


def test_good_file_is_read(read):
    found = read(GOOD + "order: latin square\nplace: [0.5, -1]\n")
    assert (found.parts[0].length, found.named["a"].length, found.first) == (1.0, 2.0, 3)
    assert (found.order, found.place, found.parts[0].kind) == ("latin square", (0.5, -1.0), Fruit.APPLE)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("name: x", "nome: x", "name: is missing; is 'nome' misspelt?"),
        ("name: x", "name: ' '", "name: is ' ', must be a non-empty text"),
        (
            "from: 3",
            "form: 3",
            "form: is not a key known here (known: name, count, place, order, parts, named, from)",
        ),
        ("from: 3", "form: 3", "; did you mean 'from'?"),
        ("from: 3", "count: 1.5", "count: is 1.5, must be a whole number"),
        ("from: 3", "count: 11", "count: is 11, must be from 1 to 10"),
        ("from: 3", "place: [0, 2]", "place[1]: is 2, must be from -1 to 1"),
        (
            "from: 3",
            "order: latin sqare",
            "order: is 'latin sqare', must be one of fixed, latin square; did you mean",
        ),
        ("{length: 1.0}", "{length: true}", "parts[0].length: is True, must be a number"),
        (
            "{length: 1.0}",
            "{length: 1.0, kind: peer}",
            "parts[0].kind: is 'peer', must be one of apple, pear; did you",
        ),
        ("{length: 1.0}", "{length: 1.0, hue: 1}", "parts[0].hue: is not a key known here (known: length, kind)"),
        ("{length: 1.0}", "3", "parts[0]: is 3, must be a mapping of keys to values"),
        ("[{length: 1.0}]", "[]", "parts: is [], must be a list with at least one entry"),
        ("{a: {length: 2}}", "{a: {lenth: 2}}", "named.a.length: is missing; is 'lenth' misspelt?"),
        ("{a: {length: 2}}", "{7: {length: 2}}", "named: the key 7 must be a text"),
        ("from: 3", "from: .inf", "from: is inf, must be finite"),
    ],
)
def test_mistake_is_one_line(read, old, new, message):
    assert old in GOOD
    with pytest.raises(BadValueError) as error:
        read(GOOD.replace(old, new))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_complaint_of_a_check_names_the_place_below(read):
    found = complain("is 3, must be 4", "[1]")
    assert found.context == {"problem": "is 3, must be 4", "at": "[1]"}
