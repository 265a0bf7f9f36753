"""Builds the report page from figures, the paper's claims and their numbers.

Each experiment stores a section with its figures. The page combines all sections in a results folder.
"""

import base64
import json
import logging
import os
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import TypeAdapter, ValidationError

from affordance.belief.learners import LEARNERS
from affordance.exceptions import BadValueError
from affordance.files.atomic import quarantine, write_json, write_text
from affordance.files.bounded import RESULTS, read_bytes, read_json
from affordance.files.model_folder import MODELS
from affordance.files.template import render_template
from affordance.named_settings import show_setting
from affordance.reporting.section import Section

_LOG = logging.getLogger(__name__)
_SECTION = "section.json"
# File with the requested experiments that could not be run, and the reasons.
_LEFT_OUT = "left_out.json"
_SECTIONS, _REASONS = TypeAdapter(Section), TypeAdapter(dict[str, str])
# The paper's simulations.
_OF_THE_PAPER = ("weight", "com", "reach", "hammer")
# Name of the package's own models in a setup. Their arm is the paper's arm.
OWN_MODELS = "those of the program"
# Page that lists the constants that were chosen after seeing an outcome. It exists only in a clone.
_TRUST = MODELS.parent / "docs" / "trust.md"
# Result of the robustness study. It exists only in a clone.
_ROBUSTNESS = MODELS.parent / "docs" / "robustness.json"
# Space between a number and its unit, where a line must not break.
_UNIT = re.compile(r"(?<=\d) (?=%|(?:[cmk]?m|k?g|m?s|N|J)\b)")
# Percent sign directly after a number, in the text of a page but not in a tag.
_CLOSE_PERCENT = re.compile(r"(?<=\d)%(?=[^<>]*<)")
# Other files of an experiment. The report links the files that exist.
_LINKS = {
    "replay.html": "the arm in motion",
    "metrics.json": "all numbers",
    "data.nc": "data of all observers (NetCDF)",
    "diagram.svg": "the Diagram that was run",
}


def write_section(folder: Path, section: Section) -> None:
    """Writes the section of an experiment to the folder of its figures."""
    write_json(folder / _SECTION, section._asdict())


def remove_section(folder: Path) -> None:
    """Removes the outdated section of an experiment, if there is one."""
    (folder / _SECTION).unlink(missing_ok=True)


def note_left_out(folder: Path, left_out: Mapping[str, str], *, done: Collection[str] = ()) -> None:
    """Records why experiments are missing in a results folder. Completed experiments are removed from the record."""
    kept = {name: why for name, why in _read_left_out(folder).items() if name not in done} | dict(left_out)
    if kept:
        write_json(folder / _LEFT_OUT, kept)
    else:
        (folder / _LEFT_OUT).unlink(missing_ok=True)


def write_report(folder: Path) -> Path:
    """Writes FOLDER/report.html from the sections in its subfolders, with a list of missing experiments.

    An invalid section is logged and quarantined. A section whose figures cannot be read is logged and omitted.
    """
    sections, (shares, num_settings) = [], _read_shares()
    runs = read_runs([path.parent for path in sorted(folder.glob(f"*/{_SECTION}"))])
    usual = [name for run, names in runs.items() if run.is_usual for name in names]
    for path in folder.glob(f"*/{_SECTION}"):
        try:
            section = _SECTIONS.validate_json(read_bytes(path, RESULTS), strict=True)
            sections.append(_prepare(section, path.parent, shares if path.parent.name in usual else {}))
        except BadValueError as error:
            _LOG.warning("%s is left out of the report: it cannot be read (%s)", path, error)
        except ValueError as error:
            quarantine(path, f"is left out of the report: it is not a section ({_describe(error)})")
    sections.sort(key=lambda section: (section["order"], section["anchor"]))
    claims = [(section["anchor"], claim) for section in sections for claim in section["claims"]]
    page = render_template(
        "affordance.reporting",
        "report.html.j2",
        escapes=True,
        sections=sections,
        heading=_choose_heading(sections),
        left_out=_read_left_out(folder),
        num_claims=len(claims),
        not_met=[(f"{anchor}-{claim.key}", claim.text) for anchor, claim in claims if not claim.met],
        runs=[(", ".join(names).replace("_", " "), run) for run, names in runs.items()],
        is_one_setup=len({run.setup for run in runs}) < 2,
        num_settings=num_settings,
        trust=_find_trust(folder),
    )
    path = folder / "report.html"
    head, mark, body = page.partition("</head>")  # percentages in the head's style sheet must not change
    write_text(path, head + mark + _UNIT.sub("\u00a0", _CLOSE_PERCENT.sub(" %", body)))
    return path


def _read_shares() -> tuple[dict[str, float], int]:
    """Reads the robustness of each claim, and the number of settings in the robustness study.

    Returns:
        Fraction of settings in which each claim holds, by section and key, and the number of settings. Both are empty
        outside a clone.
    """
    try:
        kept = json.loads(_ROBUSTNESS.read_text(encoding="utf-8"))
        return {name: float(claim["holds"]) for name, claim in kept["claims"].items()}, int(kept["settings"])
    except (OSError, ValueError, TypeError, LookupError, AttributeError):
        return {}, 0


def _find_trust(folder: Path) -> str:
    """Computes the path of docs/trust.md relative to a results folder; empty unless both are in the same clone."""
    folder, clone = folder.resolve(), _TRUST.parents[1]
    return os.path.relpath(_TRUST, folder) if folder.is_relative_to(clone) and _TRUST.is_file() else ""


class _Run(NamedTuple):
    """Setup, number of repeats, seed, versions and date of a run."""

    setup: str
    done: str
    is_usual: bool  # True for the program's own models and settings, which the robustness study varies


def read_runs(folders: Sequence[Path]) -> dict[_Run, list[str]]:
    """Groups the names of folders by run. Folders with incomplete metrics are omitted."""
    runs: dict[_Run, list[str]] = {}
    for folder in folders:
        try:
            numbers = read_json(folder / "metrics.json")
            versions = numbers["versions"]
            # A repeat is an observer, or an object in the experiment vision.
            times = "repeat" if numbers["repeats"] == 1 else "repeats"
            done = (
                f"{numbers['repeats']} {times}, seed {numbers['seed']}, by version "
                f"{versions['affordance']} with Drake {versions['drake']}, {numbers['finished']}"
            )
            setup = numbers.get("setup")
            is_usual = bool(setup) and setup["models"] == OWN_MODELS and not setup["settings"]
            run = _Run(_describe_setup(setup) if setup else "", done, is_usual)
        except (BadValueError, TypeError, LookupError, AttributeError):
            continue
        runs.setdefault(run, []).append(folder.name)
    return runs


def _describe_setup(setup: Mapping[str, Any]) -> str:
    """Describes arm, models, learners and changed settings in words."""
    changed = ", ".join(f"{name} = {show_setting(value)}" for name, value in setup["settings"].items())
    names = setup["learners"]
    learners = "; ".join(LEARNERS[each].label if each in LEARNERS else each.replace("_", " ") for each in names)
    arm = "the paper's arm" if setup["models"] == OWN_MODELS else f"the arm {setup['arm']} of {setup['models']}"
    return f"{arm}; {learners}; {f'changed settings: {changed}' if changed else 'no setting changed'}"


def _choose_heading(sections: Sequence[Mapping[str, Any]]) -> str:
    """Chooses the heading of a report.

    The heading is the paper's if one of its simulations is included. Otherwise it is the title of a single section.
    """
    if any(section["anchor"] in _OF_THE_PAPER for section in sections):
        return "the paper and what we find"
    return str(sections[0]["title"]) if len(sections) == 1 else "results"


def _read_left_out(folder: Path) -> dict[str, str]:
    path = folder / _LEFT_OUT
    if not path.exists():
        return {}
    try:
        return _REASONS.validate_json(read_bytes(path, RESULTS), strict=True)
    except (BadValueError, ValueError) as error:
        problem = f"is left out of the report: it is not a list of left-out experiments ({_describe(error)})"
        quarantine(path, problem)
        return {}


def _describe(error: Exception) -> str:
    """Describes an error in one line; for a validation error, only its first problem."""
    if not isinstance(error, ValidationError):
        return str(error)
    first = error.errors()[0]
    return f"{'.'.join(map(str, first['loc']))}: {first['msg']}".removeprefix(": ")


def _prepare(section: Section, home: Path, shares: Mapping[str, float]) -> dict[str, Any]:
    """Prepares a section for the template: embeds figures, links files, and adds the robustness of claims."""
    prepared: dict[str, Any] = section._asdict()
    prepared["anchor"] = re.sub(r"[^a-z0-9]+", "-", home.name.lower())
    prepared["figures"] = [
        {"source": _embed(home / figure.file), "caption": figure.caption} for figure in section.figures
    ]
    names = {claim.key: f"{home.name}.{claim.key}" for claim in section.claims}
    prepared["shares"] = {key: shares[name] for key, name in names.items() if name in shares}
    prepared["links"] = [
        {"file": f"{home.name}/{file}", "text": text} for file, text in _LINKS.items() if (home / file).exists()
    ]
    return prepared


def _embed(path: Path) -> str:
    kind = "svg+xml" if path.suffix == ".svg" else "png"
    return f"data:image/{kind};base64,{base64.b64encode(read_bytes(path, RESULTS)).decode('ascii')}"
