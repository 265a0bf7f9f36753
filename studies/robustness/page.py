"""Tables of docs/robustness.md, from the metrics of a run: ``make numbers``."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from affordance.files.atomic import write_json, write_text

PAGE = Path(__file__).parents[2] / "docs" / "robustness.md"
# Metrics from which the tables are made, kept with the page so that a test can make them again.
KEPT = PAGE.with_suffix(".json")
_BETWEEN = re.compile(r"(<!-- make numbers writes from here -->\n).*?(<!-- to here -->)", re.DOTALL)
_MOMENTS = ("before", "after one trial", "after two", "after six")
_SHOWN_FAILURES = 10


def keep(metrics: Path) -> None:
    """Keeps the metrics of a run that the tables need, except the indices of all assumptions."""
    numbers = json.loads(metrics.read_text(encoding="utf-8"))
    for name in ("first_order", "config", "setup", "versions", "run_shown"):
        numbers.pop(name, None)
    for claim in numbers["claims"].values():
        claim.pop("first_order", None)
    write_json(KEPT, numbers)


def fill() -> None:
    """Writes the tables into the page."""
    numbers = json.loads(KEPT.read_text(encoding="utf-8"))
    text = _BETWEEN.sub(lambda found: found[1] + describe(numbers) + found[2], PAGE.read_text(encoding="utf-8"))
    write_text(PAGE, text)


def read_tables() -> str:
    """Returns what stands between the marks of the page."""
    found = _BETWEEN.search(PAGE.read_text(encoding="utf-8"))
    assert found is not None
    return found[0].removeprefix(found[1]).removesuffix(found[2])


def describe(numbers: Mapping[str, Any]) -> str:
    """Describes a run in a sentence and four tables."""
    cpu = numbers["cpu_s"]
    parts = ", ".join(f"{name} {seconds:.1f}" for name, seconds in cpu.items())
    proven = "proven" if numbers["interpolation_proven"] else "NOT proven"
    run = (
        f"{numbers['settings']} settings, {numbers['observers']} observers in each, seed {numbers['seed']}, commit "
        f"{numbers['commit'][:7]}. The setting of the simulations meets {len(numbers['default_meets'])} of "
        f"{len(numbers['claims'])} claims. All holds were simulated in {_percent(numbers['simulated'])} of the "
        f"settings; the interpolation of the others is {proven}: interpolated motions were off by "
        f"{1e6 * numbers['interpolation_error_m']:.1f} um at most where all were "
        f"compared with full holds (the simulations' setting and {_list(numbers['proven_in'])}; bound "
        f"{1e6 * numbers['interpolation_bound_m']:.0f} um). Processor time of a setting, mean: {parts}; together "
        f"{sum(cpu.values()):.0f} s."
    )
    tables = (_list_claims(numbers), _list_choices(numbers), _list_reasons(numbers), _list_failures(numbers))
    return "\n".join([run, "", *("\n".join(table) + "\n" for table in tables)])


def _list_claims(numbers: Mapping[str, Any]) -> Iterator[str]:
    yield from _head(
        "claim", "says", "judged", "holds in", "95 % interval", "moved most by (index; chance)", "by level"
    )
    for name, claim in numbers["claims"].items():
        low, high = claim["ci95"]
        moved = claim["strongest_assumption"]
        if claim["holds_by_level"]:
            moved += f" ({claim['strongest_index']:.2f}; {claim['null_level']:.2f})"
        levels = "; ".join(
            f"{level}: {_percent(share)}" for level, share in claim["holds_by_level"].items() if share is not None
        )
        share = "" if claim["holds"] is None else f"{_percent(claim['holds'])}"
        yield _row(
            f"`{name}`",
            claim["text"],
            claim["evaluated"],
            share,
            f"{_percent(low)} to {_percent(high)}",
            moved,
            levels,
        )


def _list_choices(numbers: Mapping[str, Any]) -> Iterator[str]:
    before, *later = _MOMENTS
    yield from _head("task", "noise", "settings", before, *(f"{each} (5 to 95 %)" for each in later))
    for task, by_noise in numbers["p_correct"].items():
        for noise, found in by_noise.items():
            if not found["count"]:
                continue
            cells = zip(found["median"], found["p05"], found["p95"], strict=True)
            shares = [f"{_percent(middle)} ({_percent(low)} to {_percent(high)})" for middle, low, high in cells]
            yield _row(task, noise, found["count"], *shares)


def _list_reasons(numbers: Mapping[str, Any]) -> Iterator[str]:
    yield from _head("could not be run", "settings", "reason")
    for name, count in numbers["not_run"].items():
        reasons = "; ".join(f"{times}: {reason}" for reason, times in numbers["reasons"][name].items())
        if count:
            yield _row(name, count, reasons)


def _list_failures(numbers: Mapping[str, Any]) -> Iterator[str]:
    yield from _head("claim", "fails in", "settings to run again")
    for name, claim in numbers["claims"].items():
        if failed := claim["fails_in"]:
            yield _row(
                f"`{name}`", len(failed), _list(failed[:_SHOWN_FAILURES]) + ", ..." * (len(failed) > _SHOWN_FAILURES)
            )


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _list(values: Sequence[object]) -> str:
    return ", ".join(map(str, values))


def _head(*titles: str) -> Iterator[str]:
    yield _row(*titles)
    yield _row(*["---"] * len(titles))


def _row(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |"


def main() -> None:
    """Keeps the metrics of results/, if there are any, and fills the page."""
    metrics = PAGE.parents[1] / "results" / "robustness" / "metrics.json"
    if metrics.is_file():
        keep(metrics)
    fill()


if __name__ == "__main__":
    main()
