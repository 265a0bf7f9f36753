"""Accuracy of features from pictures: sizes, masses and their uncertainty, over random objects.

Objects of one to three touching ellipsoids are drawn, presented to the camera, and their parts detected in a noisy
picture. Sizes are compared with the true ones, masses at the true densities, and predicted intervals of mass with the
truth. The experiment also answers the question of the paper's figure 1: which of two uncommon objects is better for
mashing, and how should it be held?
"""

import math
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import norm

from affordance.arrays import Array, Arrays
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.listed_options import list_options, seed_observation
from affordance.choice.ranking import Ranking, rank
from affordance.choice.reach import Reach
from affordance.control.start_posture import check_start
from affordance.control.timed_path import load_path
from affordance.exceptions import AffordanceError, BadValueError, SeeingError
from affordance.experiments.definition import Experiment, Outputs
from affordance.experiments.shared.experience import Experience
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Grip, Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.plant.serial_chain import build_chain
from affordance.reporting.camera_figures import CameraView, draw_camera_views
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.features import FeatureSource
from affordance.vision.pixels.camera_sensor import get_camera_sensor
from affordance.vision.pixels.rgbd import Picture, save_frame
from affordance.vision.pixels.rig import build_rig_diagram, render
from studies.vision.comparison import NOTHING, compare
from studies.vision.figure import draw_calibration
from studies.vision.random_objects import MAX_PARTS, draw_object

# Number of objects for the coverage of intervals, per object of the study of accuracy: 500 to 200.
COVERAGE_FACTOR = 2.5
INTERVAL = 0.9
# Bounds of the medians of relative errors that figures show; the claims of the section file have them too.
TARGETS = {"visible axes": 0.03, "axis along the view": 0.08, "mass at true densities": 0.06}
# Number of objects and failures whose pictures are shown.
_NUM_SHOWN, _NUM_FAILURES_SHOWN = 5, 3
# Last entry of the seeds, after seed and number of the object.
_OBJECT, _NOISE = 0, 1


@dataclass(frozen=True)
class VisionExperiment(Experiment):
    """Study of features from pictures."""

    uncommon: tuple[Tool, ...]  # pair of objects to choose from
    # Densities of materials, [kg/m^3], with their colours, for an observer who has learned them.
    known: tuple[tuple[tuple[float, float, float], float], ...]
    task: Reach  # task of mashing
    seed: int  # root of every random draw
    settings: Settings  # settings of arm, prior and controller
    models: Path  # folder of objects and path

    name = "vision"
    unit = "object"
    section = Path(__file__).with_name("section.yaml")

    def count_repeats(self, observers: int) -> int:
        """Returns the number of objects, for the study of accuracy and for the coverage of intervals."""
        return math.ceil(COVERAGE_FACTOR * observers)

    def plan(self, jobs: int) -> None:
        """Plans the mashing.

        If it is infeasible with every object, or cannot be planned with one, a BadValueError is raised.
        """
        path = self.models / "paths" / "mash.yaml"
        model = ArmModel(load_arm(self.settings.arm))
        build_chain(model.arm)  # otherwise an unusable arm would be blamed on the path
        held = [tool.gripped_by(grip) for tool in self.uncommon for grip in tool.grips or (Grip("", np.eye(4)),)]
        try:
            reasons = [self.task.build_cost(model, tool.components, self.settings).infeasible_reason for tool in held]
        except AffordanceError as error:
            raise BadValueError(path, "points", f"cannot be followed: {error}") from error
        if all(reasons):
            raise BadValueError(path, "points", f"cannot be followed: the {held[0].name} {reasons[0]}")

    def run_observer(self, shared: None, experience: Experience | None, repeat: int) -> Arrays:
        """Detects the parts of the random object with the given index in a picture.

        Returns: The fields of Comparison; ``failure``, the name of the error, empty if there was none; ``reason``;
            and ``seconds``, the processor time of detection, without that of taking the picture.
        """
        tool, picture = draw_numbered_object(self.seed, repeat), take_numbered_picture(self.seed, repeat)
        failure, reason, comparison = "", "", NOTHING
        start = time.process_time()
        try:
            detection = get_camera_sensor().detect_parts(picture)
            seconds = time.process_time() - start
            if len(detection.fits) == len(tool.components):
                comparison = compare(tool, detection)
            else:
                failure = "WrongParts"
                reason = f"{len(detection.fits)} parts detected of an object of {len(tool.components)}"
        except SeeingError as error:
            seconds = time.process_time() - start
            failure, reason = type(error).__name__, error.reason
        kept = {name: np.array(value) for name, value in comparison._asdict().items()}
        return {**kept, "failure": np.array(failure), "reason": np.array(reason), "seconds": np.array(seconds)}

    def compute_metrics(self, plan: None, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json: accuracy over the first objects, coverage over all."""
        count = math.floor(len(arrays["failure"]) / COVERAGE_FACTOR)
        accurate = {name: values[:count] for name, values in arrays.items()}
        deviations = arrays["mass_deviation"][np.isfinite(arrays["mass_deviation"])]
        covered = np.abs(deviations) <= norm.ppf(0.5 + 0.5 * INTERVAL)
        novice, expert = self.rank_uncommon()
        return {
            "objects": count,
            "failures": int((accurate["failure"] != "").sum()),
            "failures_by_kind": dict(Counter(str(name) for name in accurate["failure"] if name)),
            "failure_examples": {
                str(kind): str(reason)
                for kind, reason in zip(accurate["failure"], accurate["reason"], strict=True)
                if kind
            },
            "semi_axis_error_visible_median": find_median(accurate["visible_error"]),
            "semi_axis_error_depth_median": find_median(accurate["depth_error"]),
            "mass_error_median": find_median(accurate["mass_error"]),
            "mass_bias_median": float(np.nanmedian(accurate["mass_error"])) if len(deviations) else None,
            "colour_error_median": find_median(accurate["colour_error"]),
            "mass_interval90_coverage": float(covered.mean()) if len(deviations) else None,
            "objects_coverage": len(arrays["failure"]),
            "failures_coverage": int((arrays["failure"] != "").sum()),
            "ms_per_object": float(1000.0 * np.median(accurate["seconds"])),
            "mashing_novice": list_ranking(novice),
            "mashing_expert": list_ranking(expert),
        }

    def rank_uncommon(self) -> tuple[Ranking, Ranking]:
        """Ranks the uncommon objects for mashing by expected absolute work, as a novice and as one who knows them."""
        options = [
            option
            for tool in self.uncommon
            for option in list_options(tool, seed=self.seed, feature_source=FeatureSource.PIXELS)
        ]
        expert = MaterialMemory.from_densities(dict(self.known))
        novice, knowing = (
            rank(options, self.task, memory, self.settings, seed=self.seed) for memory in (MaterialMemory(), expert)
        )
        return novice, knowing

    def list_facts(self, plan: None, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the largest number of parts of a random object."""
        return {"max_parts": MAX_PARTS}

    def show(self, plan: None, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]) -> Outputs:
        """Returns the errors, pictures of some objects and of failures, and the Diagram of the camera."""
        count = numbers["objects"]
        failed = np.flatnonzero(arrays["failure"][:count] != "")
        detected = np.flatnonzero(arrays["failure"][:count] == "")
        drawn: dict[str, Any] = {"errors": partial(_draw_errors, arrays, count)}
        if len(detected):
            drawn["seen"] = partial(self._draw_views, [(int(number), "") for number in detected[:_NUM_SHOWN]])
        if len(failed):
            noted = [(int(number), str(arrays["reason"][number])) for number in failed[:_NUM_FAILURES_SHOWN]]
            drawn["failures"] = partial(self._draw_views, noted)
        drawn["uncommon"] = self._draw_uncommon
        return Outputs(
            figures=drawn,
            diagram=lambda: build_rig_diagram(self.uncommon[0]),
            writers={
                f"object_{number:05d}": partial(self._save_frame, int(number), str(arrays["reason"][number]))
                for number in np.flatnonzero(arrays["failure"] != "")
            },
        )

    def _save_frame(self, number: int, reason: str, folder: Path) -> None:
        """Saves the picture of an object that was not detected, or not correctly."""
        picture = take_numbered_picture(self.seed, number)
        save_frame(SeeingError(reason, *picture), folder / "frames", f"object_{number:05d}")

    def _draw_views(self, numbered: Sequence[tuple[int, str]]) -> Figure:
        """Draws pictures of the study, each by the index of its object and a note."""
        views = []
        for number, note in numbered:
            name, picture = draw_numbered_object(self.seed, number).name, take_numbered_picture(self.seed, number)
            try:
                views.append(CameraView(name, picture, get_camera_sensor().detect_parts(picture), note))
            except SeeingError:
                views.append(CameraView(name, picture, None, note))
        return draw_camera_views(views)

    def _draw_uncommon(self) -> Figure:
        sensor = get_camera_sensor()
        views = []
        for tool in self.uncommon:
            picture = sensor.take_image(tool, np.random.default_rng(seed_observation(tool, self.seed)))
            views.append(CameraView(tool.name, picture, sensor.detect_parts(picture)))
        return draw_camera_views(views)


def load(models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS) -> VisionExperiment:
    """Reads the uncommon objects and the mashing from a folder of models; this experiment always takes pictures."""
    materials = load_materials(models / "materials.yaml")
    path = models / "tools" / "uncommon.yaml"
    tools = load_tools(path, materials)
    if len(tools) != 2:
        raise BadValueError(path, "tools", f"has {len(tools)} entries, must have 2: the objects to choose from")
    made_of = {part.material.name for tool in tools for part in tool.components}
    known = tuple((each.colour, each.density) for each in materials.values() if each.name in made_of)
    file = models / "paths" / "mash.yaml"
    task = Reach(load_path(file))
    check_start(file, "start", task.path.start, load_arm(settings.arm))
    settings = replace(settings, feature_source=FeatureSource.FEATURES)  # otherwise its numbers would be stored twice
    return VisionExperiment(tools, known, task, seed, settings, models)


def draw_numbered_object(seed: int, number: int) -> Tool:
    """Draws the random object with the given index."""
    return draw_object(np.random.default_rng([seed, number, _OBJECT]), f"object {number}")


def take_numbered_picture(seed: int, number: int) -> Picture:
    """Takes a noisy picture of the random object with the given index."""
    sensor = get_camera_sensor()
    picture = render(draw_numbered_object(seed, number), sensor.rig)
    return sensor.noise.add_to(picture, sensor.rig.camera, np.random.default_rng([seed, number, _NOISE]))


def list_ranking(ranking: Ranking) -> list[dict[str, Any]]:
    """Lists the ranking for metrics.json, best first."""
    return [
        {
            "option": entry.option.name,
            "energy": entry.work if np.isfinite(entry.work) else None,
            "p_best": entry.p_best,
            "p_feasible": entry.p_feasible,
        }
        for entry in ranking.ranked
    ]


def find_median(errors: Array) -> float | None:
    """Computes the median magnitude of the finite errors; None if there are none."""
    there = np.abs(errors[np.isfinite(errors)])
    return float(np.median(there)) if len(there) else None


def _draw_errors(arrays: Arrays, count: int) -> Figure:
    errors = {}
    for label, key in zip(TARGETS, ("visible_error", "depth_error", "mass_error"), strict=True):
        values = arrays[key][:count]
        errors[label] = np.abs(values[np.isfinite(values)])
    claimed = arrays["mass_deviation"][np.isfinite(arrays["mass_deviation"])]
    return draw_calibration(errors=errors, targets=TARGETS, claimed=claimed)
