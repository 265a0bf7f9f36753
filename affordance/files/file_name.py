"""File names given in files: restricted so that they stay in the folder that the program chose, on every system."""

import re
from dataclasses import dataclass
from typing import Any

from pydantic import GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from affordance.exceptions import show_value
from affordance.files.constraints import Text, complain

# Portable file names of POSIX (3.282, Portable Filename Character Set), short enough to get a suffix.
_FILE_NAME = re.compile("[A-Za-z0-9][A-Za-z0-9_.-]{0,79}")
# Names that are devices on Windows, with any suffix (Naming Files, Paths, and Namespaces, Microsoft).
_RESERVED = {"con", "prn", "aux", "nul", *(f"{kind}{digit}" for kind in ("com", "lpt") for digit in range(10))}


@dataclass(frozen=True)
class FileName(Text):
    """Constraint on a text: the name of a file in a folder that the program chooses, on every system."""

    def check(self, value: Any) -> str:
        """Returns the name if it is valid.

        Raises:
            PydanticCustomError: The value is not a text, points elsewhere, or is reserved by a system.
        """
        text = super().check(value)
        if not _FILE_NAME.fullmatch(text) or text.split(".")[0].lower() in _RESERVED:
            raise complain(
                f"is {show_value(value)}, must be the name of a file: letters, digits, '_', '-' and '.', at most 80, "
                "a letter or digit first, and no name that Windows reserves"
            )
        return text

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Builds the JSON schema of a file name, for editors."""
        return {"type": "string", "pattern": f"^{_FILE_NAME.pattern}$"}
