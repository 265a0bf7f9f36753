"""Runner of all experiments: observers in processes, then numbers, figures, files and section.

Everything but the repeats of observers is rewritten; ``metrics.json`` is written last, so it marks a complete run.
"""

import datetime
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from affordance.arrays import Arrays
from affordance.exceptions import UnavailableError
from affordance.experiments.definition import OBSERVER_SHOWN, Experiment, Outputs
from affordance.experiments.shared.experience import Experience
from affordance.files.atomic import write_json
from affordance.files.model_files import list_arm_files
from affordance.files.model_folder import MODELS
from affordance.files.netcdf import write_trajectories
from affordance.named_settings import describe_changes
from affordance.objects.tool import Tool
from affordance.proprioception.faults import Faults
from affordance.reporting.camera_figures import CameraView, draw_camera_views
from affordance.reporting.diagram_picture import save_diagram
from affordance.reporting.figures import save_figure
from affordance.reporting.formatting import ENOUGH_OBSERVERS, count_observers
from affordance.reporting.report import OWN_MODELS, write_section
from affordance.reporting.section import Section, render_report, render_section
from affordance.runs.commit import find_commit
from affordance.runs.random_streams import Stream
from affordance.runs.repeats import compute_key, list_versions, run_repeats
from affordance.vision.features import FeatureSource
from affordance.vision.pixels.camera_sensor import get_camera_sensor

_LOG = logging.getLogger(__name__)

_CAMERA_CAPTION = (
    "Images of each object before it is grasped: colour, depth (white where there is no reading), detected parts, "
    "and outlines of the ellipsoids fitted to them. Features come from such images only."
)


def run_experiment(experiment: Experiment, plan: Any, folder: Path, *, repeats: int, jobs: int) -> None:
    """Runs all observers and writes all results of an experiment, given the result of its ``plan``.

    Repeats that the folder holds are not run again. Experience is cached in its parent folder.
    """
    start, commit = time.perf_counter(), find_commit()  # of what runs, not of what may lie there when it ends
    settings = experiment.settings
    experience, arrays = run_observers(experiment, plan, folder, repeats=repeats, jobs=jobs)
    numbers = experiment.compute_metrics(plan, experience, arrays)
    if experience is not None:
        numbers.update(experience.count_events())
    _warn(experiment.name, numbers)
    outputs = experiment.show(plan, experience, arrays, numbers)
    seen = settings.feature_source is FeatureSource.PIXELS and experiment.tools_observed
    steps = _list_steps(outputs, folder)
    if seen:
        steps["seen"] = lambda: save_figure(
            draw_camera_views_of(experiment.tools_observed, experiment.seed), folder, "seen"
        )
    for name, step in tqdm(steps.items(), desc=f"{experiment.name}: files", unit="file", disable=None):
        try:
            step()
        except UnavailableError as error:
            _LOG.warning("%s: %s is left out: %s", experiment.name, name, error)
    facts = {
        "repeats": repeats,
        "seed": experiment.seed,
        "camera_caption": _CAMERA_CAPTION if seen else "",
        "faults": describe_faults(settings.faults),
        "few_observers": describe_few_observers(repeats),
        **experiment.list_facts(plan, numbers),
    }
    section = describe(experiment, numbers, facts)
    drawn = [figure for figure in section.figures if (folder / figure.file).exists()]
    write_section(folder, section._replace(figures=drawn))
    run = {
        "seed": experiment.seed,
        "repeats": repeats,
        "run_shown": OBSERVER_SHOWN,
        "config": experiment,
        "setup": describe_setup(experiment),
        "inputs": compute_key("", settings.arm.parent),
        "versions": list_versions(),
        "commit": commit,
        "wall_s": time.perf_counter() - start,
        "finished": f"{datetime.date.today():%Y-%m-%d}",
    }
    write_json(folder / "metrics.json", {**numbers, **run})


def draw_camera_views_of(tools: Sequence[Tool], seed: int) -> Figure:
    """Takes a picture of each tool and draws the detected parts in it; seed is the root of the camera's noise."""
    sensor = get_camera_sensor()
    views = []
    for index, tool in enumerate(tools):
        picture = sensor.take_image(tool, np.random.default_rng([seed, Stream.SHOWN, index]))
        views.append(CameraView(tool.name, picture, sensor.detect_parts(picture)))
    return draw_camera_views(views, sensor.rig.camera)


def run_observers(
    experiment: Experiment, plan: Any, folder: Path, *, repeats: int, jobs: int
) -> tuple[Experience | None, Arrays]:
    """Runs the observers that a folder does not hold yet; arguments are those of ``run_experiment``.

    The experience is None if they gain none or learn in different ways; the arrays are of all observers.
    """
    parts = experiment.split()
    experience = None
    found: dict[str, Any] = {}
    for prefix, part in parts:
        experience = part.gain_experience(folder.parent / "experience", repeats=repeats, jobs=jobs)
        arrays = run_repeats(
            folder / "repeats" / compute_key(part, [*list_arm_files(part.settings.arm), *part.files_read]),
            partial(part.run_observer, part.select_shared(plan), experience),
            repeats=part.count_repeats(repeats),
            jobs=jobs,
            description=f"{experiment.name}, {prefix.removesuffix(': ')}" if prefix else experiment.name,
            unit=part.unit,
        )
        found |= {f"{prefix}{name}": array for name, array in arrays.items()}
    return experience if len(parts) == 1 else None, found


def describe(experiment: Experiment, numbers: Mapping[str, Any], facts: Mapping[str, Any]) -> Section:
    """Renders the section of an experiment, from the protocol's report or from the section file."""
    if experiment.report is None:
        return render_section(experiment.section, numbers, facts)
    return render_report(experiment.report, numbers, facts)


def describe_setup(experiment: Experiment) -> dict[str, Any]:
    """Returns arm, models, learners and changed settings of an experiment, for the head of the report."""
    settings = experiment.settings
    folder = settings.arm.parent
    learners = getattr(experiment, "learners", (settings.learner,))
    return {
        "arm": settings.arm.name,
        "models": OWN_MODELS if folder == MODELS else folder.name,
        "learners": [learner.value for learner in learners],
        "settings": describe_changes(settings),
    }


def describe_faults(faults: Faults) -> str:
    """Lists the faults that were switched on, in words; empty if there were none."""
    active = [
        f"{field.name} {getattr(faults, field.name)}"
        for field in fields(Faults)
        if getattr(faults, field.name) != field.default
    ]
    if not active:
        return ""
    return (
        f"Run with faults: {', '.join(active)}. The true cost of a task with each grip, and so the correct "
        "grip, is computed without faults."
    )


def describe_few_observers(repeats: int) -> str:
    """Returns a warning if claims rest on too few observers; else an empty text."""
    if repeats >= ENOUGH_OBSERVERS:
        return ""
    return f"Only {count_observers(repeats)}: claims need about {ENOUGH_OBSERVERS} or more."


def _list_steps(outputs: Outputs, folder: Path) -> dict[str, Callable[[], object]]:
    """Lists the functions that write the outputs, by name."""

    def draw(name: str) -> None:
        save_figure(outputs.figures[name](), folder, name)

    steps: dict[str, Callable[[], object]] = {name: partial(draw, name) for name in outputs.figures}
    if outputs.trajectories is not None:
        steps["trajectories"] = partial(write_trajectories, folder / "trajectories.nc", outputs.trajectories)
    if outputs.diagram is not None:
        build = outputs.diagram
        steps["diagram"] = lambda: save_diagram(build(), folder, "diagram")
    if outputs.replay is not None:
        steps["replay"] = partial(outputs.replay, folder / "replay.html")
    for name, write in outputs.writers.items():
        steps[name] = partial(write, folder)
    return steps


def _warn(name: str, numbers: Mapping[str, Any]) -> None:
    """Logs rejected samples, and 5-sigma outliers among the objects other than the decoy, which comes last."""
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
