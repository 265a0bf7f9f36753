"""A small data model with every kind of check, for tests."""

import enum
from typing import Annotated, Literal

from pydantic import Field

from affordance.files.constraints import OneOf, Text, Vector, Whole, Within
from affordance.files.data_model import DataModel


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
