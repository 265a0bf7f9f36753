"""Bitwise comparison of the numbers in two folders of results, for a change that must not change them.

Renamed keys are given as pairs, and apply at any depth. Expected differences are ignored: times, versions and the
configuration. The exit status is 1 if a number differs or is missing on either side.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

# Keys of date, duration and configuration, which are not results.
PROVENANCE = ("config", "finished", "versions", "wall_s", "shared", "ms_per_object")


def list_numbers(value: Any, renames: Mapping[str, str], place: str = "") -> Iterator[tuple[str, Any]]:
    """Lists every leaf of a parsed JSON file by its path, with the new names of keys."""
    if isinstance(value, dict):
        for key, entry in value.items():
            if key not in PROVENANCE:
                yield from list_numbers(entry, renames, f"{place}.{renames.get(key, key)}".lstrip("."))
    elif isinstance(value, list):
        for index, entry in enumerate(value):
            yield from list_numbers(entry, renames, f"{place}[{index}]")
    else:
        yield place, value


def compare_files(old: Path, new: Path, renames: Mapping[str, str]) -> tuple[int, list[str]]:
    """Compares two JSON files; returns the number of equal leaves, and a line for each other leaf."""
    before = dict(list_numbers(json.loads(old.read_text(encoding="utf-8")), renames))
    after = dict(list_numbers(json.loads(new.read_text(encoding="utf-8")), {}))
    places = before.keys() | after.keys()
    differing = [place for place in sorted(places) if before.get(place, "missing") != after.get(place, "missing")]
    lines = [f"{place}: {before.get(place, 'missing')!r}, now {after.get(place, 'missing')!r}" for place in differing]
    return len(places) - len(differing), lines


def compare_results(old: str, new: str, *pairs: str) -> int:
    """Compares all metrics of two folders; prints the differences, and returns the exit status."""
    renames = dict(pair.split("=", 1) for pair in pairs)
    failed = False
    for path in sorted(Path(old).glob("*/metrics.json")):
        agreeing, problems = compare_files(path, Path(new) / path.parent.name / path.name, renames)
        print(f"{path.parent.name}: {agreeing} numbers identical, {len(problems)} not")
        for problem in problems:
            print(f"    {problem}")
        failed |= bool(problems)
    return int(failed)
