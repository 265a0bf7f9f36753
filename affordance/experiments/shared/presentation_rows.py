"""Presentations as rows of lifts.csv: belief before, force exerted, and evaluation afterwards."""

import csv
import math
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.belief.density_belief import Prior
from affordance.belief.kind_memory import find_kind
from affordance.belief.object_belief import Memory
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.experiments.shared.hold_measures import ROW
from affordance.files.atomic import write_text
from affordance.objects.appearance import Appearance
from affordance.objects.tool import Tool
from affordance.protocols.measured import compute_volume
from affordance.protocols.people_tables import COLUMNS
from affordance.protocols.presentations import Presentation
from affordance.settings import Settings
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.eye import measure_features
from affordance.vision.features import ComponentFeatures, FeatureSource, VisionError
from affordance.vision.systems import predict_object

# Smallest p-value; smaller ones are rounding errors.
_LEAST_P_VALUE = 1e-300


class PresentedObject(NamedTuple):
    """Mass of an object, [kg], features of its parts, and the appearance by which it is recognised."""

    mass: float
    features: tuple[ComponentFeatures, ...]
    appearance: Appearance


class Presented(NamedTuple):
    """Presentation to an observer: the object as seen, memories before and after, and further measures by name.

    The expected mass, [kg], is at the most probable densities, before the object is held; NaN if unknown. The p-value
    of the measured torques is NaN if nothing is measured, the record None without a simulated motion.
    """

    presentation: Presentation
    seen: PresentedObject
    memories: tuple[Memory, Memory]
    expected: float
    p_value: float
    record: TrialRecord | None = None
    numbers: Mapping[str, Any] = MappingProxyType({})


class PresentationRow(NamedTuple):
    """Presentation of an object to an observer."""

    tool: int
    block: int
    cycle: int  # number of the repetition within the block, from 1
    mass: float  # mass of the object in this presentation, [kg]
    force: float  # upward force before release from a clamp, [N]; NaN where there is no clamp
    expected: float  # mass at the most probable densities, before the object is held, [kg]; NaN if unknown
    # Most probable density of an object never lifted with the colour of this one's first part, before it is held,
    # [kg/m^3].
    believed_density: float
    # Number of the kind of that colour to which the object is assigned after it was held, from 1, the oldest; 0
    # without kinds.
    kind: int
    p_value: float  # p-value of the measured torques under the belief before; NaN if nothing is measured


def describe_presentation(presented: Presented, prior: Prior) -> PresentationRow:
    """Describes a presentation; materials never met are believed to have the prior."""
    presentation, seen, (before, after), expected, p_value, _, numbers = presented
    met, colour = before.recognise(seen.appearance[0].colour, 0.0, prior)
    return PresentationRow(
        presentation.tool,
        presentation.block,
        presentation.cycle,
        seen.mass,
        numbers.get("force", math.nan),
        expected,
        float(met.belief.compute_mode()[colour]),
        find_kind(after, seen.appearance),
        p_value,
    )


def see(tool: Tool) -> PresentedObject:
    """Returns the visible features of an object without observation errors."""
    features = measure_features(tool, VisionError(), np.random.default_rng(0))
    return PresentedObject(tool.mass, features, tuple(part.appearance for part in features))


def expect_mass(seen: PresentedObject, memory: Memory, settings: Settings) -> float:
    """Computes the mass at the most probable densities, [kg]; NaN where features are observed with errors."""
    if settings.feature_source is not FeatureSource.FEATURES or settings.vision_error != VisionError():
        return math.nan  # otherwise another picture or measurement would be needed
    belief = predict_object(seen.features, memory, settings.prior)
    return float(belief.compute_parameters(belief.densities.compute_mode())[0])


def describe_experience(
    config: ExperienceConfig,
    experience: Experience,
    memories: Sequence[Memory],
    places: Sequence[int],
    repeat: int,
) -> list[PresentationRow]:
    """Describes an observer's holds in the first block; places are the indices of its objects in the protocol."""
    rows = []
    for trial, index in enumerate(experience.order[repeat]):
        seen, before = see(config.tools[index]), memories[trial]
        presented = Presented(
            Presentation(places[index], 0, None, 1 + trial // len(config.tools)),
            seen,
            (before, memories[trial + 1]),
            expect_mass(seen, before, config.settings),
            experience.p_value[repeat, trial] if experience.p_value.size else math.nan,
        )
        rows.append(describe_presentation(presented, config.settings.prior))
    return rows


def stack_rows(rows: Sequence[PresentationRow]) -> dict[str, NDArray[Any]]:
    """Stacks the N presentations of an observer into arrays, with names that begin with ROW."""
    columns = zip(*rows, strict=True)
    return {ROW + name: np.array(column) for name, column in zip(PresentationRow._fields, columns, strict=True)}


def write_rows(
    path: Path,
    learners: Mapping[str, Mapping[str, NDArray[Any]]],
    tools: Sequence[Tool],
    blocks: Sequence[str],
) -> None:
    """Writes every presentation to every observer as a row of a CSV file.

    The arrays are those of ``stack_rows``, stacked over observers, (R, N), by the name of the learner.
    """
    volumes = [compute_volume(tool) for tool in tools]
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for learner, arrays in learners.items():
        columns = [arrays[ROW + name].tolist() for name in PresentationRow._fields]
        for observer, of_observer in enumerate(zip(*columns, strict=True)):
            for lift, cells in enumerate(zip(*of_observer, strict=True), start=1):
                row = PresentationRow(*cells)
                who = (observer, learner, blocks[row.block], row.cycle, lift)
                what = (tools[row.tool].name, _show(row.mass), _show(volumes[row.tool]))
                done = (_show(row.force), _show(row.expected), _show(row.believed_density))
                writer.writerow((*who, *what, *done, row.kind or "", _show(compute_surprise(row.p_value))))
    write_text(path, text.getvalue())


def compute_surprise(p_value: float) -> float:
    """Computes minus the decimal logarithm of a p-value, at most 300; NaN for NaN."""
    return math.nan if math.isnan(p_value) else -math.log10(max(p_value, _LEAST_P_VALUE))


def _show(value: float) -> str:
    """Formats a number with seven significant digits; empty for NaN."""
    return "" if math.isnan(value) else f"{value:.7g}"
