"""Expressions over numbers in a protocol, whose syntax is checked when the file is read."""

import math
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from affordance.exceptions import AffordanceError
from affordance.files.data_model import Text, complain
from affordance.files.yaml_reader import show_value
from affordance.reporting.expressions import check_expression


@dataclass(frozen=True)
class Expression(Text):
    """Annotation of a text that is an expression over numbers."""

    def check(self, value: Any) -> str:
        """Returns the text of the expression.

        Raises:
            PydanticCustomError: The text is not a valid expression.
        """
        text = super().check(value)
        try:
            check_expression(text)
        except AffordanceError as error:
            raise complain(str(error)) from error
        return text


@dataclass(frozen=True)
class ExpressionOrNumber:
    """Annotation of a value that is an expression over the numbers, a number, or true or false."""

    def check(self, value: Any) -> Any:
        """Returns the value.

        Raises:
            PydanticCustomError: The value is neither an expression nor a finite number.
        """
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

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Returns a core schema that runs the check only."""
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Returns the JSON schema for editors."""
        return {"type": ["string", "number", "boolean"]}


type Bound = Annotated[Any, ExpressionOrNumber()]
