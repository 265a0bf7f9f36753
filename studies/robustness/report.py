"""Report of the robustness study: fraction of settings in which claims hold, and important assumptions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from affordance.reporting.claims import ClaimResult, Unit, check, claim
from affordance.reporting.section import ReportFigure, Section, Table
from studies.robustness.assumptions import load_assumptions
from studies.robustness.study import CONTACT_EVERY

# Largest number of listed settings per claim, and of listed reasons per experiment.
_LISTED, _REASONS = 12, 6


def describe(numbers: Mapping[str, Any], faults: str = "") -> Section:
    """Describes a run, including active faults."""
    met, failed = numbers["default_meets"], numbers["default_fails"]
    not_met = f", and not {', '.join(failed)}" if len(failed) else ""
    return Section(
        order=8,
        title="The multiverse: which claims are robust",
        summary=(
            f"Every claim above, and every headline, in {numbers['settings']} settings of"
            f" {len(load_assumptions())} assumptions that the paper does not fix, all drawn at once from their ranges"
            " (a scrambled Sobol sequence; ranges and sources are in studies/robustness/assumptions.yaml). In each"
            f" setting {numbers['observers']} observers learn and choose. A share says in how many settings a claim"
            " holds, not how probably it is true, and it depends on the ranges."
        ),
        figures=[
            ReportFigure(
                file="robustness.png",
                caption=(
                    "Left: share of the settings in which each claim holds, with Wilson's 95 % interval. Right:"
                    " how much of the variance each assumption alone explains; cells are white where that is no more"
                    " than chance, and assumptions that are white for every claim are left out."
                ),
            )
        ],
        claims=judge(numbers),
        tables=list_tables(numbers),
        remarks=[
            (
                "Approximations: observers learn from objects felt at rest; correct grips are those of inner"
                " simulation; motions of objects are interpolated between the holds of some of the observers;"
                f" contact is simulated in one setting of {CONTACT_EVERY} (docs/robustness.md)."
            ),
            f"The setting of the simulations itself, evaluated like the others, meets {len(met)} claims{not_met}.",
            *([faults] if faults else []),
        ],
    )


def judge(n: Mapping[str, Any]) -> list[ClaimResult]:
    """Tests claims about the study itself."""
    error = n["interpolation_error_m"]
    return [
        claim("enough_settings", "ours", "At least 300 settings were evaluated.",
              check("settings", n["settings"], Unit(digits=0), at_least=300)),
        claim("interpolation", "ours", "Interpolated motions agree with full holds of all observers.",
              check("largest difference at any time of any motion, in the setting of the simulations and some of the"
                    " sample",
                    [] if error is None else error, Unit("mm", 1000.0, 4),
                    at_most=np.float64(n["interpolation_bound_m"]))),
    ]  # fmt: skip


def list_tables(n: Mapping[str, Any]) -> list[Table]:
    """Lists the tables of the section, of which the first is also in docs/robustness.md, with fewer columns."""
    parts = [[part, f"{seconds:.1f}"] for part, seconds in n["cpu_s"].items()]
    return [
        _tabulate_claims(n["claims"]),
        _tabulate_choices(n["p_correct"]),
        _tabulate_failures({name: each["fails_in"] for name, each in n["claims"].items()}),
        _tabulate_reasons(n["not_run"], n["reasons"]),
        Table("Mean processor time of a setting.", ["part", "seconds"], parts),
    ]


def _tabulate_claims(claims: Mapping[str, Mapping[str, Any]]) -> Table:
    labels = {each.name: each.label for each in load_assumptions()}
    rows = []
    for name, each in claims.items():
        strongest = each["strongest_assumption"]
        levels = [f"{level}: {_show_share(share)}" for level, share in each["holds_by_level"].items()]
        rows.append(
            [
                name,
                each["text"],
                str(each["evaluated"]),
                _show_share(each["holds"]),
                f"{_show_share(each['ci95'][0])} to {_show_share(each['ci95'][1])}",
                labels.get(strongest, strongest),
                f"{each['strongest_index']:.2f} ({each['null_level']:.2f})",
                "; ".join(levels),
            ]
        )
    header = ["claim", "statement", "settings judged", "holds in", "95 % interval", "moved most by"]
    caption = "Claims by the share of settings in which they hold."
    return Table(caption, [*header, "explains (chance)", "holds by its levels"], rows)


def _tabulate_choices(p_correct: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> Table:
    rows = []
    for task, structures in p_correct.items():
        for name, each in structures.items():
            if each["count"]:
                spans = zip(*(map(_show_share, each[key]) for key in ("median", "p05", "p95")), strict=True)
                shares = [f"{median} ({low} to {high})" for median, low, high in spans]
                rows.append([task, name, str(each["count"]), *shares])
    return Table(
        "Correct choices after no, one, two and six trials by the structure of the noise: median over settings, and"
        " their 5 and 95 % quantiles.",
        ["task", "noise structure", "settings", "before", "after one", "after two", "after six"],
        rows,
    )


def _tabulate_failures(fails_in: Mapping[str, Sequence[int]]) -> Table:
    rows = []
    for name, settings in fails_in.items():
        if len(settings):
            listed = [*map(str, settings[:_LISTED]), *(["..."] if len(settings) > _LISTED else [])]
            rows.append([name, str(len(settings)), ", ".join(listed)])
    return Table(
        "Settings in which a claim fails; `affordance study robustness --setting N` runs one again. All of them are"
        " in settings.csv.",
        ["claim", "fails in", "the first of them"],
        rows,
    )


def _tabulate_reasons(not_run: Mapping[str, int], reasons: Mapping[str, Mapping[str, int]]) -> Table:
    rows = []
    for name, count in not_run.items():
        # A vertical bar would end the table cell.
        listed = [f"{times}: {why.replace('|', '/')}" for why, times in reasons[name].items()]
        rows.append([name, str(count), "; ".join(listed[:_REASONS])])
    caption = "Settings in which an experiment could not be run and was left out."
    return Table(caption, ["experiment", "settings", "why"], rows)


def _show_share(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.0f} %"
