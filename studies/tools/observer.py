"""Simulated observer that holds the learning tools, sees all tools, and predicts the masses of those never held."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import SeeingError
from affordance.files.model_folder import MODELS
from affordance.objects.tool import Tool
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.features import ComponentFeatures
from affordance.vision.pixels.camera_sensor import get_turning_stand
from studies.tools.data_set import DataSet, Half
from studies.tools.first_touch import (
    STEEL,
    WATER,
    Prediction,
    Truth,
    list_recurring,
    make_all_alike,
    predict,
    predict_unfelt,
    predict_without_experience,
    take_first,
)
from studies.tools.holds import simulate_holds
from studies.tools.seen import Source, measure_all

# Numbers of holds of each learning tool before a prediction.
HOLDS = (1, 5)


@dataclass(frozen=True)
class ToolsConfig:
    """Configuration of the study."""

    data: Path | None = None  # user's clone of the data set; None to run without it
    models: Path = MODELS  # folder of our models
    seed: int = 0  # root of every random draw
    # Number of observers that hold the learning tools and predict the others, with independent noise.
    observers: int = 10
    jobs: int = 1  # number of processes
    halves: tuple[Half, ...] = (Half.LEARNING, Half.TEST)  # halves of the tools whose masses are predicted
    sources: tuple[Source, ...] = tuple(Source)  # sources of the tools' geometry
    settings: Settings = DEFAULT_SETTINGS  # settings of arm, prior and noise


class Predictions(NamedTuple):
    """Predictions of an observer, by name of the tool."""

    # Predictions by geometry, number of holds, and half.
    first_touch: dict[tuple[Source, int, Half], dict[str, Prediction]]
    floors: dict[str, dict[str, Prediction]]  # predictions for the last half, by the name of the floor
    # Logarithm of the ratio of predicted to true mass at true densities, so that only the geometry is wrong, by
    # geometry.
    at_true_densities: dict[Source, dict[str, float]]
    not_seen: dict[str, str]  # by name of the tool, why it was not detected in pictures


def run_observer(config: ToolsConfig, data: DataSet, observer: int) -> Predictions:
    """Runs one observer."""
    settings = config.settings
    colours = [material.colour for material in data.materials.values()]
    held = {name: hold_tool(data, name) for name in data.list_names(Half.LEARNING)}
    felt = simulate_holds(list(held.values()), settings, rounds=max(HOLDS), seed=(config.seed, 1 + observer))
    wanted = {half: data.list_names(half) for half in config.halves}
    wanted[Half.LEARNING] = tuple(held)
    features: dict[Source, dict[str, tuple[ComponentFeatures, ...]]] = {source: {} for source in config.sources}
    not_seen: dict[str, str] = {}
    for name in dict.fromkeys(name for names in wanted.values() for name in names):
        rng = np.random.default_rng([config.seed, 1 + observer, *name.encode()])
        try:
            found = measure_all(hold_tool(data, name), get_turning_stand(), rng, config.sources)
        except SeeingError as error:
            not_seen[name] = error.reason
            found = measure_all(hold_tool(data, name), get_turning_stand(), rng, (Source.CAD,))
        for source, parts in found.items():
            features[source][name] = parts
    judged = {Half.LEARNING: list_recurring({name: data.tools[name] for name in held})}
    if Half.TEST in config.halves:
        judged[Half.TEST] = wanted[Half.TEST]
    first_touch = {}
    for source in config.sources:
        known = features[source]
        for holds in HOLDS:
            some = {name: each for name, each in take_first(felt, holds).items() if name in known}
            for half in config.halves:
                names = [name for name in judged[half] if name in known]
                predicted = predict_unfelt(names, some, known, colours, settings, config.seed + observer)
                first_touch[source, holds, half] = predicted
    last = config.halves[-1]
    drawings = features[Source.CAD]
    alike = make_all_alike(drawings)
    one_colour = [parts[0].colour for parts in list(alike.values())[:1]]
    floors = {
        "one density learned": predict_unfelt(
            judged[last], take_first(felt, 1), alike, one_colour, settings, config.seed + observer
        )
    }
    for floor, density in (("all steel", STEEL), ("all water", WATER)):
        floors[floor] = {
            name: predict_without_experience(drawings[name], density, settings.prior) for name in judged[last]
        }
    return Predictions(first_touch, floors, _compare_with_truth(data, features, settings), not_seen)


def hold_tool(data: DataSet, name: str) -> Tool:
    """Returns a tool of the data set as it is held by its handle."""
    tool = data.tools[name]
    return tool.gripped_by(tool.grips[0])


def read_truth_in_hand(data: DataSet, name: str) -> Truth:
    """Reads mass and centre of mass of a tool from the data set, for the tool as it is held by its handle."""
    truth, X_FG = data.read_truth(name), data.tools[name].grips[0].X_TG
    return Truth(truth.mass, X_FG[:3, :3].T @ (truth.p_FBcm - X_FG[:3, 3]))


def _compare_with_truth(
    data: DataSet,
    features: Mapping[Source, Mapping[str, Sequence[ComponentFeatures]]],
    settings: Settings,
) -> dict[Source, dict[str, float]]:
    """Computes the errors of vision alone: logarithms of predicted over true mass, with all densities known."""
    known = MaterialMemory.from_densities({each.colour: each.density for each in data.materials.values()})
    return {
        source: {
            name: float(
                np.log(
                    predict(parts, known, settings, np.random.default_rng([1, *name.encode()])).mass[1]
                    / data.read_truth(name).mass
                )
            )
            for name, parts in found.items()
        }
        for source, found in features.items()
    }
