"""The report of a protocol: prose as templates, and claims with criterion and bound."""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from affordance.files.data_model import DataModel, Text, Whole, Within, complain
from affordance.files.yaml_reader import show_value


@dataclass(frozen=True)
class Expression:
    """Says that something is an expression over the numbers, a number, or true or false."""

    def check(self, value: Any) -> Any:
        """Returns it.

        Raises:
            PydanticCustomError: It is none.
        """
        if not isinstance(value, str | bool | int | float) or value == "":
            raise complain(f"is {show_value(value)}, must be an expression or a number")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The check and nothing else."""
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The same for editors."""
        return {"type": ["string", "number", "boolean"]}


type Bound = Annotated[Any, Expression()]
_BOUNDS = ("above", "at_least", "at_most", "below", "is")


class CriterionEntry(DataModel):
    """An expression over the numbers, and its bound; of a list every entry must keep it."""

    name: Annotated[str, Text(), Field(description="What the expression is, in words.")]
    value: Bound
    above: Bound = None
    at_least: Bound = None
    at_most: Bound = None
    below: Bound = None
    is_: Annotated[Bound, Field(alias="is")] = None
    unit: Annotated[str, Field(description="Of value and bound as they are shown.")] = ""
    scale: Annotated[float, Within(), Field(description="From SI to that unit.")] = 1.0
    digits: Annotated[int, Whole(0, 12)] = 2

    @model_validator(mode="before")
    @classmethod
    def check_bound(cls, content: Any) -> Any:
        """Refuses criteria without a bound.

        Raises:
            PydanticCustomError: It is one.
        """
        if isinstance(content, dict) and not any(name in content for name in _BOUNDS):
            raise complain(f"has no bound, must have one of {', '.join(_BOUNDS)}")
        return content


class ClaimEntry(DataModel):
    """What is said, by whom, and what decides whether it is met."""

    key: Annotated[str, Text()]
    source: Annotated[str, Text(), Field(description="Who says it and where; 'ours' for what we ask of ourselves.")]
    text: Annotated[str, Text()]
    criteria: Annotated[list[CriterionEntry], Field(min_length=1)]


class ReportFigureEntry(DataModel):
    """A figure and what it shows."""

    file: Annotated[str, Text()]
    caption: Annotated[str, Text()]


class TableEntry(DataModel):
    """A table: a line a row, cells between bars."""

    caption: Annotated[str, Text()]
    header: list[Annotated[str, Text()]]
    rows: Annotated[str, Text()]


class ReportEntry(DataModel):
    """A section of the report; every text is a Jinja2 template over the numbers."""

    order: Annotated[int, Whole(0, 10_000), Field(description="Place among the sections.")] = 100
    title: Annotated[str, Text()]
    summary: Annotated[str, Text()]
    figures: list[ReportFigureEntry] = Field(default_factory=list)
    claims: list[ClaimEntry] = Field(default_factory=list)
    tables: list[TableEntry] = Field(default_factory=list)
    remarks: list[Annotated[str, Text()]] = Field(default_factory=list)
