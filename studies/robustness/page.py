"""Table of docs/robustness.md, generated from the metrics of a run: ``make numbers``."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from affordance.files.atomic import write_json, write_text
from studies.robustness.report import list_tables
from studies.study import format_table

PAGE = Path(__file__).parents[2] / "docs" / "robustness.md"
# Columns of the table on the page. The report has all columns and further tables.
COLUMNS = ("claim", "statement", "holds in", "95 % interval", "moved most by")
# Metrics for the table, stored with the page so that a test can regenerate it.
KEPT = PAGE.with_suffix(".json")
_BETWEEN = re.compile(r"(<!-- make numbers writes from here -->\n).*?(<!-- to here -->)", re.DOTALL)


def keep(metrics: Path) -> None:
    """Stores the metrics of a run for the tables, without indices of all assumptions."""
    numbers = json.loads(metrics.read_text(encoding="utf-8"))
    for name in ("first_order", "config", "setup", "versions", "run_shown"):
        numbers.pop(name, None)
    for claim in numbers["claims"].values():
        claim.pop("first_order", None)
    write_json(KEPT, numbers)


def fill() -> int:
    """Updates the table on the page with the latest metrics in results/, and returns exit status 0."""
    metrics = PAGE.parents[1] / "results" / "robustness" / "metrics.json"
    if metrics.is_file():
        keep(metrics)
    numbers = json.loads(KEPT.read_text(encoding="utf-8"))
    text = _BETWEEN.sub(lambda found: found[1] + describe(numbers) + found[2], PAGE.read_text(encoding="utf-8"))
    write_text(PAGE, text)
    return 0


def read_tables() -> str:
    """Returns the text between the markers of the page."""
    found = _BETWEEN.search(PAGE.read_text(encoding="utf-8"))
    assert found is not None
    return found[0].removeprefix(found[1]).removesuffix(found[2])


def describe(numbers: Mapping[str, Any]) -> str:
    """Describes a run in a few sentences and a table of claims."""
    interpolated = f"{100.0 * (1.0 - numbers['simulated']):.0f} % of the" if numbers["simulated"] else "all"
    compared = ", ".join(map(str, numbers["proven_in"]))
    bound = f"bound {1e6 * numbers['interpolation_bound_m']:.0f} um"
    run = (
        f"{numbers['settings']} settings with {numbers['observers']} observers each (seed {numbers['seed']}, commit "
        f"{numbers['commit'][:7]}). In {interpolated} settings, motions were interpolated between simulated holds. "
        f"In the default setting and in settings {compared}, interpolated motions were compared with full "
        f"simulation: they differ by at most {1e6 * numbers['interpolation_error_m']:.1f} um "
        f"({bound}, {'met' if numbers['interpolation_proven'] else 'NOT met'}). "
        f"A setting takes {sum(numbers['cpu_s'].values()):.0f} s of processor time on average."
    )
    claims = list_tables(numbers)[0]
    places = [claims.header.index(name) for name in COLUMNS]
    table = format_table(COLUMNS, [[row[place] for place in places] for row in claims.rows])
    return f"{run}\n\n{table}\n"
