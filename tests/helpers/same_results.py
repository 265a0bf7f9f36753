"""Compares the files of two runs."""

import json
import re
from pathlib import Path

import numpy as np

# Keys of metrics.json that may differ between runs: times, and the setup with its folder and processes.
_OF_RUN = ("wall_s", "finished", "config")
# Pattern of a date in the report.
_DATE = re.compile(r"\b\d{4}-\d{2}-\d{2}\b")


def list_differences(one: Path, other: Path) -> list[str]:
    """Lists the files that are not identical, byte for byte, in two folders of results.

    Times, dates and the setup are ignored in metrics.json and in the report. For .npz archives the arrays are
    compared, and time stamps are ignored.
    """
    files = {path.relative_to(folder) for folder in (one, other) for path in folder.rglob("*") if path.is_file()}
    return [str(name) for name in sorted(files) if not _are_same(one / name, other / name)]


def _are_same(one: Path, other: Path) -> bool:
    if not (one.exists() and other.exists()):
        return False
    if one.name == "metrics.json":
        first, second = (json.loads(path.read_text(encoding="utf-8")) for path in (one, other))
        return {**first, **dict.fromkeys(_OF_RUN)} == {**second, **dict.fromkeys(_OF_RUN)}
    if one.suffix == ".html":
        return _DATE.sub("", one.read_text(encoding="utf-8")) == _DATE.sub("", other.read_text(encoding="utf-8"))
    if one.suffix == ".npz":
        with np.load(one) as first, np.load(other) as second:
            return set(first) == set(second) and all(
                first[name].tobytes() == second[name].tobytes() and first[name].shape == second[name].shape
                for name in first
            )
    return one.read_bytes() == other.read_bytes()
