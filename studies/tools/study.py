"""Study of real tools: configuration, run and results.

Without the data set it ranks the grips of our own hammers, and reproduces the paper's figure 1 with two objects of
ours. With the data set it also compares meshes with the truth, predicts masses before first touch, reads the
force-torque records, and ranks the grips of the data set's three hammers.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from affordance.choice.hammer import load_hammer
from affordance.choice.inner_simulation import TaskCostModel
from affordance.choice.listed_options import list_drawn_options, list_seen_options
from affordance.choice.ranking import Ranking
from affordance.choice.reach import Reach
from affordance.control.timed_path import load_path
from affordance.objects.load import load_tools
from affordance.objects.mesh_bodies import load_bodies
from affordance.objects.tool import Tool
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.vision.pixels.camera_sensor import get_turning_stand
from studies.tools.blows import CheckedBlow, check_blows
from studies.tools.data_set import DataSet, Deviation, Half, load_known_materials, measure_parity
from studies.tools.first_touch import Prediction, Score, Truth, score
from studies.tools.holds import gain_experience
from studies.tools.observer import Predictions, ToolsConfig, read_truth_in_hand, run_observer
from studies.tools.records import Errors, compare_methods, read_stored
from studies.tools.seen import Outcome, Source, examine, paint
from studies.tools.uncommon import CheckedMass, CheckedMotion, check_mass, check_motions
from studies.tools.which_end import AFTER, TRUE, build_beliefs, rank_grips

_LOG = logging.getLogger(__name__)

# Tools of the data set that can drive a nail.
HAMMERS = ("Hammer", "Machinist Hammer", "Rubber Mallet")
# Number of holds of each object before the grips of hammers and kitchen tools are ranked.
HOLDS_BEFORE_CHOICE = 2


class Choices(NamedTuple):
    """Choices of the grips of some tools."""

    tools: tuple[Tool, ...]  # tools to choose from
    rankings: dict[tuple[str, str, str], Ranking]  # rankings by task, geometry (drawing or pictures) and belief
    blows: list[CheckedBlow]  # simulated blows, with each tool in its best grip at true densities

    def find_right(self, task: str, tool: str) -> str:
        """Returns the grip of a tool that is best for a task, from its drawing and at true densities."""
        return self.rankings[task, "drawing", TRUE].find_best_grip(tool)


class Uncommon(NamedTuple):
    """Results for the paper's figure 1: two objects, and the predicted and simulated motions and masses."""

    tools: tuple[Tool, ...]
    motions: list[CheckedMotion]
    masses: list[CheckedMass]


@dataclass
class ToolsResult:
    """Results of the study; those that need the data set are empty without it."""

    config: ToolsConfig  # configuration of the study
    choices: dict[str, Choices]  # choices for our "own" hammers, and for those of the "data set"
    uncommon: Uncommon  # results for the paper's figure 1
    parity: dict[str, Deviation] = field(default_factory=dict)  # errors of inertia from meshes, by tool
    # Scores of predictions before first touch, by geometry, holds and half.
    scores: dict[tuple[Source, int, Half], Score] = field(default_factory=dict)
    floors: dict[str, Score] = field(default_factory=dict)  # scores of the floors on the last half, by name
    predictions: list[Predictions] = field(default_factory=list)  # predictions of every observer
    truths: dict[str, Truth] = field(default_factory=dict)  # true mass and centre of mass, by tool
    # Results of looking at each tool when it is drawn in the colours of its materials.
    made_out: dict[str, Outcome] = field(default_factory=dict)
    # Results of looking at each tool when it is painted as in the data set.
    painted: dict[str, Outcome] = field(default_factory=dict)
    # Errors on the force-torque records, by noise and method.
    records: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)


def run(config: ToolsConfig) -> ToolsResult:
    """Runs the study."""
    folder, settings = config.models / "workshop", config.settings
    materials = load_known_materials(config.models)
    data = None if config.data is None else DataSet(config.data, config.models, config.halves)
    if data is not None:
        data.check()
    blanks = load_tools(folder / "blanks.yaml", materials)
    experience = gain_experience(blanks, settings, holds=HOLDS_BEFORE_CHOICE, seed=config.seed)
    beliefs = build_beliefs(materials, experience, settings)
    _LOG.info("which end of our own hammers")
    own = _choose(config, load_tools(folder / "tools.yaml", materials), beliefs, settings)
    _LOG.info("the paper's figure 1")
    strange = load_tools(folder / "uncommon.yaml", materials)
    mash = Reach(load_path(config.models / "paths" / "mash.yaml"))
    options = list_seen_options(strange, config.seed)
    motions = check_motions(strange, options, mash, beliefs, settings, config.seed)
    masses = [check_mass(tool.gripped_by(tool.grips[0]), beliefs[AFTER], settings, config.seed) for tool in strange]
    result = ToolsResult(config, {"own": own}, Uncommon(strange, motions, masses))
    if data is not None:
        _use_data(result, data, settings)
    return result


def _use_data(result: ToolsResult, data: DataSet, settings: Settings) -> None:
    config = result.config
    _LOG.info("inertia from meshes")
    result.parity = measure_parity(data)
    names = [name for half in config.halves for name in data.list_names(half)]
    result.truths = {name: read_truth_in_hand(data, name) for name in names}
    _LOG.info("first touch: %d observers", config.observers)
    observers = [partial(run_observer, config, data, number) for number in range(config.observers)]
    result.predictions = run_tasks(observers, jobs=config.jobs, description="observers")
    result.scores = {
        key: _score([each.first_touch[key] for each in result.predictions], result.truths)
        for key in result.predictions[0].first_touch
    }
    result.floors = {
        name: _score([each.floors[name] for each in result.predictions], result.truths)
        for name in result.predictions[0].floors
    }
    _LOG.info("materials distinguished in pictures")
    for name in names:
        tool = data.tools[name]
        bodies = load_bodies(data.find_mesh(name), "mm")
        for outcomes, painted in (
            (result.made_out, tool),
            (result.painted, paint(tool, [body.colour for body in bodies])),
        ):
            rng = np.random.default_rng([config.seed, *name.encode()])
            outcomes[name] = examine(painted, get_turning_stand(), data.materials, rng)
    _LOG.info("force-torque records")
    tasks = [partial(compare_methods, data, name, settings.prior) for name in data.tools]
    found = run_tasks(tasks, jobs=config.jobs, description="records")
    result.records = _average_records(found, read_stored(data))
    if Half.TEST in config.halves:
        _LOG.info("which end of the data set's hammers")
        learned = [data.tools[name] for name in data.list_names(Half.LEARNING)]
        experience = gain_experience(learned, settings, holds=HOLDS_BEFORE_CHOICE, seed=config.seed)
        beliefs = build_beliefs(data.materials, experience, settings)
        result.choices["data set"] = _choose(config, [data.tools[name] for name in HAMMERS], beliefs, settings)


def _choose(config: ToolsConfig, tools: Sequence[Tool], beliefs: Mapping[str, Any], settings: Settings) -> Choices:
    """Ranks the grips of some tools for both tasks, from drawings and from pictures, and simulates blows."""
    hammer = load_hammer(config.models / "nail.yaml")
    tasks: dict[str, TaskCostModel] = {
        "hammer": hammer,
        "reach": Reach(load_path(config.models / "paths" / "reach.yaml")),
    }
    geometries = {"drawing": list_drawn_options(tools), "pictures": list_seen_options(tools, config.seed)}
    rankings = {}
    for task_name, task in tasks.items():
        for geometry, options in geometries.items():
            ranked = rank_grips(options, task, beliefs, settings, seed=config.seed)
            rankings.update({(task_name, geometry, belief): found for belief, found in ranked.items()})
    choices = Choices(tuple(tools), rankings, [])
    right = [choices.find_right("hammer", tool.name) for tool in tools]
    return choices._replace(blows=check_blows(tools, right, hammer, settings))


def _score(predictions: Sequence[Mapping[str, Prediction]], truths: Mapping[str, Truth]) -> Score:
    pairs = [(prediction, truths[name]) for found in predictions for name, prediction in found.items()]
    return score([pair[0] for pair in pairs], [pair[1] for pair in pairs])


def _average_records(
    found: Sequence[Mapping[str, Mapping[str, Sequence[Errors]]]],
    stored: Mapping[str, dict[str, Errors]],
) -> dict[str, dict[str, dict[str, float]]]:
    """Averages errors over tools and draws of the noise, by noise and method, and adds the authors' stored errors."""
    records = {}
    for noise, methods in found[0].items():
        means = {
            method: np.mean([each for tool in found for each in tool[noise][method]], axis=0) for method in methods
        }
        errors = {method: Errors(*map(float, mean)) for method, mean in means.items()} | stored[noise]
        records[noise] = {method: each._asdict() for method, each in errors.items()}
    return records
