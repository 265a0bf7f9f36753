"""Prints the lowest versions of libraries that pyproject.toml allows, one a line, as constraints of pip."""

import re
import tomllib
from pathlib import Path

PROJECT = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]

for requirement in sorted({*PROJECT["dependencies"], *EXTRAS["bags"], *EXTRAS["parquet"], *EXTRAS["tutorials"]}):
    print(re.sub(r">=([\w.]+)$", r"==\1.*", requirement))
