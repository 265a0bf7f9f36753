"""Schema of a report's section: figures, tables, remarks, and claims with criterion and bound.

Section files of the program and reports of protocols have the same entries; only in the former are texts templates.
Expressions are over the numbers of metrics.json; their syntax is checked when the file is read.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, override

from pydantic import Field, model_validator
from pydantic.json_schema import JsonSchemaValue

from affordance.exceptions import AffordanceError, show_value
from affordance.files.constraints import FileName, Text, Whole, Within, complain
from affordance.files.data_model import DataModel
from affordance.reporting.expressions import parse_expression

Order = Annotated[int, Whole(0, 10_000)]
# Comparisons of a value with its bound, by key.
_COMPARISONS = ("above", "at_least", "at_most", "below", "is")


@dataclass(frozen=True)
class Expression(Text):
    """Annotation of a text that is an expression over numbers."""

    @override
    def check(self, value: Any) -> str:
        text: str = super().check(value)
        try:
            parse_expression(text)
        except AffordanceError as error:
            raise complain(str(error)) from error
        return text


@dataclass(frozen=True)
class ExpressionOrNumber(Text):
    """Annotation of a value that is an expression over the numbers, a number, or true or false."""

    @property
    @override
    def schema(self) -> JsonSchemaValue:
        return {"type": ["string", "number", "boolean"]}

    @override
    def check(self, value: Any) -> Any:
        if isinstance(value, str) and value.strip():
            return Expression().check(value)
        if not isinstance(value, bool | int | float):
            raise complain(f"is {show_value(value)}, must be an expression or a number")
        try:
            finite = math.isfinite(value)
        except OverflowError:  # a whole number of 400 digits
            finite = False
        if not finite:
            raise complain(f"is {show_value(value)}, must be finite")
        return value


type Bound = Annotated[Any, ExpressionOrNumber()]


class Criterion(DataModel):
    """Bound on an expression; every entry of a list must meet it.

    What is missing, infinite, NaN or a list without entries, as value, as bound or on the way to them, meets none.
    """

    name: Annotated[str, Text(), Field(description="Meaning of the expression in words.")]
    value: Bound
    above: Bound = None
    at_least: Bound = None
    at_most: Bound = None
    below: Bound = None
    is_: Annotated[Bound, Field(alias="is")] = None
    unit: Annotated[str, Field(description="Unit of value and bound as shown.")] = ""
    scale: Annotated[float, Within(), Field(description="Factor from SI to that unit.")] = 1.0
    digits: Annotated[int, Whole(0, 12)] = 2

    @model_validator(mode="before")
    @classmethod
    def check_bound(cls, content: Any) -> Any:
        """Refuses a criterion without a bound.

        Raises:
            PydanticCustomError: There is no bound.
        """
        if isinstance(content, dict) and not any(name in content for name in _COMPARISONS):
            raise complain(f"has no bound, must have one of {', '.join(_COMPARISONS)}")
        return content

    @property
    def bounds(self) -> Mapping[str, str | float | bool]:
        """Bounds by comparison; each is an expression too."""
        bounds = {name: getattr(self, "is_" if name == "is" else name) for name in _COMPARISONS}
        return {name: bound for name, bound in bounds.items() if bound is not None}


class Claim(DataModel):
    """Statement with its source, and the criteria by which the numbers confirm or contradict it."""

    key: Annotated[str, Text()]
    source: Annotated[str, Text(), Field(description="Source of the claim; 'ours' for a claim of the author's own.")]
    text: Annotated[str, Text()]
    criteria: Annotated[list[Criterion], Field(min_length=1)]


class ReportFigure(DataModel):
    """Figure of the report with its caption."""

    file: Annotated[str, FileName(), Field(description="File name in the folder of results, as 'heights.png'.")]
    caption: Annotated[str, Text()]


class TableEntry(DataModel):
    """Table of a section file; rows are lines, whose cells stand between bars."""

    caption: Annotated[str, Text()]
    header: Annotated[list[str], Field(min_length=1)]
    rows: Annotated[str, Text()]


class SectionClaim(Claim):
    """Claim of a section file, made only where an expression is true."""

    given: Bound = True


class SectionEntry(DataModel):
    """Section file, whose texts are templates."""

    order: Order | None = None
    title: Annotated[str, Text()]
    summary: Annotated[str, Text()]
    figures: list[ReportFigure] = Field(default_factory=list)
    claims: list[SectionClaim] = Field(default_factory=list)
    tables: list[TableEntry] = Field(default_factory=list)
    remarks: list[Annotated[str, Text()]] = Field(default_factory=list)
