"""Results of an experiment, and their files."""

import datetime
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr
from matplotlib.figure import Figure
from pydrake.systems.framework import Diagram
from tqdm import tqdm

from affordance.exceptions import UnavailableError
from affordance.experiments.shared.observers import OBSERVER_SHOWN, Setup
from affordance.files.atomic import write_atomic, write_json, write_text
from affordance.files.model_folder import MODELS
from affordance.named_settings import describe_changes
from affordance.objects.tool import Tool
from affordance.proprioception.faults import Faults
from affordance.reporting.claims import ClaimResult
from affordance.reporting.diagram_picture import save_diagram
from affordance.reporting.figures import save_figure
from affordance.reporting.formatting import ENOUGH_OBSERVERS, count_observers
from affordance.reporting.report import OWN_MODELS, write_section
from affordance.reporting.section import ReportFigure, Section, Table
from affordance.runs.repeats import compute_key, list_versions
from affordance.settings import Settings
from affordance.version import find_commit

_LOG = logging.getLogger(__name__)


@dataclass
class Results:
    """Data, numbers, claims, figures and texts of an experiment.

    Attributes:
        title: Heading of the section in the report.
        summary: Description of the run, in one or two sentences.
        finding: Main result in one sentence.
        data: Measurements of all observers, with names, units and meanings.
        numbers: Numbers for metrics.json.
        claims: Claims with their test results.
        figures: Caption and drawing function of each figure, by file name.
        tables: Tables by caption; the index is shown as the first column.
        remarks: Additional sentences.
        lifts: Trial table for lifts.csv, or None.
        diagram: Function that returns the Diagram of the simulation, or None.
        replay: Function that writes the replay to a path, or None.
        files: Functions that write further files into the folder, by name.
        seen: Objects whose camera pictures are shown, if features are measured in pictures.
        learners: Names of the simulated learners; empty for the learner of the settings.
        order: Sort key of the section in the report.
    """

    title: str
    summary: str
    finding: str
    data: xr.Dataset | pd.DataFrame
    numbers: dict[str, Any]
    claims: Sequence[ClaimResult]
    figures: Mapping[str, tuple[str, Callable[[], Figure]]] = field(default_factory=dict)
    tables: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    remarks: Sequence[str] = ()
    lifts: pd.DataFrame | None = None
    diagram: Callable[[], Diagram] | None = None
    replay: Callable[[Path], None] | None = None
    files: Mapping[str, Callable[[Path], None]] = field(default_factory=dict)
    seen: Sequence[Tool] = ()
    learners: Sequence[str] = ()
    order: int = 100


def write_results(results: Results, name: str, setup: Setup, start: float) -> None:
    """Writes the data, numbers, figures and report section of an experiment.

    The file ``metrics.json`` is written last and marks a complete run.

    Args:
        results: Results.
        name: Name of the experiment, and of its folder within the folder of results.
        setup: Setup of the experiment.
        start: Start time of the run, from ``time.perf_counter``, [s].
    """
    folder = setup.out / name
    _warn(name, results.numbers)
    steps = _list_steps(results, folder, setup)
    written = []
    for label, step in tqdm(steps.items(), desc=f"{name}: files", unit="file", disable=None):
        try:
            step()
            written.append(label)
        except UnavailableError as error:
            _LOG.warning("%s: %s is left out: %s", name, label, error)
    write_section(folder, _describe(results, written, setup))
    run = {
        "seed": setup.seed,
        "repeats": setup.observers,
        "run_shown": OBSERVER_SHOWN,
        "config": setup,
        "setup": describe_setup(setup.settings, results.learners),
        "inputs": compute_key(None, setup.settings.arm.parent),
        "versions": list_versions(),
        "commit": find_commit(),
        "wall_s": time.perf_counter() - start,
        "finished": f"{datetime.date.today():%Y-%m-%d}",
    }
    write_json(folder / "metrics.json", {**results.numbers, **run})


def _list_steps(results: Results, folder: Path, setup: Setup) -> dict[str, Callable[[], object]]:
    """Lists functions that write the files of an experiment, except section and numbers, by name."""

    def write_data(path: Path) -> None:
        assert isinstance(results.data, xr.Dataset)
        results.data.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")

    steps: dict[str, Callable[[], object]] = {
        file: partial(_save, draw, folder, file) for file, (_, draw) in results.figures.items()
    }
    if isinstance(results.data, xr.Dataset):
        steps["data"] = lambda: write_atomic(folder / "data.nc", write_data)
    if (lifts := results.lifts) is not None:
        text = lifts.to_csv(index=False, float_format="%.7g", lineterminator="\n")
        steps["lifts"] = lambda: write_text(folder / "lifts.csv", text)
    if (build := results.diagram) is not None:
        steps["diagram"] = lambda: save_diagram(build(), folder, "diagram")
    if (replay := results.replay) is not None:
        steps["replay"] = lambda: replay(folder / "replay.html")
    for label, write in results.files.items():
        steps[label] = partial(write, folder)
    if results.seen and (draw := getattr(setup.settings.eye, "draw", None)):
        steps["seen"] = lambda: save_figure(draw(results.seen, setup.seed), folder, "seen")
    return steps


def _save(draw: Callable[[], Figure], folder: Path, file: str) -> None:
    save_figure(draw(), folder, file)


def _describe(results: Results, written: Sequence[str], setup: Setup) -> Section:
    """Builds the section of the report with the available figures."""
    others = {
        "seen": getattr(setup.settings.eye, "caption", ""),
        "diagram": "Drake Diagram of the simulation, drawn from its connections.",
    }
    captions = {file: caption for file, (caption, _) in results.figures.items()}
    captions |= {file: caption for file, caption in others.items() if file not in captions}
    suffixes = {"diagram": ".svg"}
    figures = [
        ReportFigure(file=f"{file}{suffixes.get(file, '.png')}", caption=caption)
        for file, caption in captions.items()
        if file in written
    ]
    tables = [
        Table(
            caption, [str(frame.index.name or ""), *map(str, frame)], frame.astype(str).reset_index().values.tolist()
        )
        for caption, frame in results.tables.items()
    ]
    faults = describe_faults(setup.settings.faults)
    few = setup.observers < ENOUGH_OBSERVERS
    return Section(
        order=results.order,
        title=results.title,
        summary=results.summary,
        figures=figures,
        claims=tuple(results.claims),
        tables=tables,
        remarks=[*results.remarks, *([faults] if faults else [])],
        finding=results.finding,
        caution=(
            f"Only {count_observers(setup.observers)}: claims need about {ENOUGH_OBSERVERS} or more." if few else ""
        ),
    )


def describe_faults(faults: Faults) -> str:
    """Describes the active faults of arm and sensors; empty without faults."""
    active = [
        f"{each.name} {getattr(faults, each.name)}"
        for each in fields(Faults)
        if getattr(faults, each.name) != each.default
    ]
    if not active:
        return ""
    return (
        f"Run with faults: {', '.join(active)}. The true cost of a task with each grip, and therefore the correct "
        "grip, is computed without faults."
    )


def describe_setup(settings: Settings, learners: Sequence[str] = ()) -> dict[str, Any]:
    """Lists arm, models, learners and changed settings for the report."""
    folder = settings.arm.parent
    return {
        "arm": settings.arm.name,
        "models": OWN_MODELS if folder == MODELS else folder.name,
        "learners": list(learners or [settings.learner.name]),
        "settings": describe_changes(settings),
    }


def _warn(name: str, numbers: Mapping[str, Any]) -> None:
    """Logs the numbers of rejected samples and 5-sigma outliers, without the last object, the decoy."""
    rejected = numbers.get("samples_rejected_test", numbers.get("samples_rejected"))
    outliers = numbers.get("trials_outlier_test", numbers.get("trials_outlier"))
    if rejected is None or outliers is None or not hasattr(outliers, "__len__"):
        return
    honest = int(sum(outliers[:-1]))
    if honest or sum(rejected):
        _LOG.warning(
            "%s: %d samples were rejected, and %d trials with non-decoy objects are 5-sigma outliers",
            name,
            sum(rejected),
            honest,
        )
