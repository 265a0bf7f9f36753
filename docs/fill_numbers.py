"""Numbers of the pages, from results: ``make numbers``.

A number in a page stands between two comments, which a reader of the rendered page does not see:

    <!--=reach: p_correct[1]; .2f-->0.64<!--/-->

They name a folder of results, a place in its ``metrics.json`` as Python would write it, and a format of Python,
without bars, which would end the cell of a table. A format that ends in %, cm or mm shows a value in that unit.
Values are kept in ``docs/numbers.json`` with the run that they are from, so that a test can compare the pages with
them without results.
"""

import json
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from affordance.files.atomic import write_json, write_text

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "docs" / "numbers.json"
_MARK = re.compile(r"<!--=(?P<folder>[\w/]+): (?P<place>[^|;]+?); (?P<format>[^|;>]+?)-->(?P<text>.*?)<!--/-->")
_STEP = re.compile(r"\[(-?\d+)\]|\[\"([^\"]+)\"\]|\.?(\w+)")
# Factors from SI by the unit in which a format ends.
_SCALES = {"%": 100.0, "cm": 100.0, "mm": 1000.0}
# Entries of a run that are kept with its values.
_RUN = ("repeats", "seed", "commit", "finished")


class Mark(NamedTuple):
    """A number in a page.

    Attributes:
        page: Page, relative to the repository.
        folder: Folder of results.
        place: Place in the folder's metrics.
        format: Format of Python, and the unit in which the value is shown, without its name.
        text: Text of the page.
    """

    page: str
    folder: str
    place: str
    format: str
    text: str

    def show(self, value: Any) -> str:
        """Formats a value; a dash stands for None, which nothing was measured of."""
        if value is None:
            return "-"
        for unit, scale in _SCALES.items():
            if self.format.endswith(unit):
                return f"{scale * value:{self.format.removesuffix(unit)}}"
        return f"{value:{self.format}}"

    def find(self, metrics: Mapping[str, Any]) -> Any:
        """Finds the value in the metrics of its folder, None in what was left out; a wrong place ends the program."""
        value: Any = metrics
        if "".join(step[0] for step in _STEP.finditer(self.place)) != self.place:
            sys.exit(f'{self.page}: {self.place} is no place such as tools["stick"]["p_correct"][1]')
        for index, key, name in _STEP.findall(self.place):
            if value is None:
                break
            try:
                value = value[int(index)] if index else value[key or name]
            except (LookupError, TypeError):
                sys.exit(f"{self.page}: {self.folder}: {self.place}: there is no such number")
        return value


def list_pages() -> list[Path]:
    """Pages that may hold numbers."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def list_marks() -> Iterator[Mark]:
    """Numbers of all pages."""
    for page in list_pages():
        for found in _MARK.finditer(page.read_text(encoding="utf-8")):
            yield Mark(str(page.relative_to(ROOT)), **found.groupdict())


def read_kept() -> dict[str, Any]:
    """Values by folder and place, with the runs that they are from."""
    kept: dict[str, Any] = json.loads(KEPT.read_text(encoding="utf-8"))
    return kept


def collect(results: Path, kept: Mapping[str, Any]) -> dict[str, Any]:
    """Computes the values of all numbers; those of a folder without results stay as they were kept."""
    found: dict[str, Any] = {}
    for mark in list_marks():
        entry = found.setdefault(mark.folder, {"run": {}, "values": {}})
        path = results / mark.folder / "metrics.json"
        if path.is_file():
            metrics = json.loads(path.read_text(encoding="utf-8"))
            run = {name: metrics[name] for name in _RUN if name in metrics}
            before, now = kept.get(mark.folder, {}).get("run", {}).get("repeats"), run.get("repeats")
            if None not in (before, now) and now != before:  # those of `make run` are fewer
                sys.exit(f"{path}: is of {now} repeats, the pages are of {before}: run with --repeats {before}")
            entry["run"] = run | {"affordance": metrics.get("versions", {}).get("affordance")}
            entry["values"][mark.place] = mark.find(metrics)
        else:
            entry["run"] = kept[mark.folder]["run"]
            entry["values"][mark.place] = kept[mark.folder]["values"][mark.place]
    return found


def fill(kept: Mapping[str, Any]) -> list[str]:
    """Writes the kept values into the pages.

    Returns: Numbers that changed, one line each.
    """
    changed = []
    for page in list_pages():
        name, text = str(page.relative_to(ROOT)), page.read_text(encoding="utf-8")

        def put(match: re.Match[str], name: str = name) -> str:
            mark = Mark(name, **match.groupdict())
            shown = mark.show(kept[mark.folder]["values"][mark.place])
            if shown != mark.text:
                changed.append(f"{mark.page}: {mark.folder}: {mark.place}: {mark.text} -> {shown}")
            return match[0][: match.start("text") - match.start()] + shown + "<!--/-->"

        filled = _MARK.sub(put, text)
        if filled != text:
            write_text(page, filled)
    return changed


def main() -> None:
    """Reads results/, keeps the values and fills the pages."""
    kept = collect(ROOT / "results", read_kept() if KEPT.is_file() else {})
    write_json(KEPT, kept)
    print("\n".join(fill(kept)) or "The pages are as the results are.")


if __name__ == "__main__":
    main()
