"""Every presentation as a row of lifts.csv: what was believed before it, exerted in it and judged after it."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.belief.density_belief import Prior
from affordance.belief.kinds_summary import find_kind
from affordance.belief.object_belief import Memory
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.files.atomic import write_text
from affordance.objects.appearance import Appearance
from affordance.objects.tool import Tool
from affordance.protocols.measured import compute_volume
from affordance.protocols.people_lifts import COLUMNS
from affordance.protocols.presentations import Presentation
from affordance.settings import Settings
from affordance.vision.features import ComponentFeatures, FeatureSource, VisionError, measure_features
from affordance.vision.visual_prior import predict_object

# Begins the names of the arrays that hold rows.
ROW = "row "
# What is less probable than this is so by rounding.
_LEAST_P_VALUE = 1e-300


class SeenObject(NamedTuple):
    """An object, and what there is to be seen of it.

    Attributes:
        mass: Mass of the object, [kg].
        features: Features of each part.
        appearance: Appearance by which it is known again.
    """

    mass: float
    features: tuple[ComponentFeatures, ...]
    appearance: Appearance


class PresentationRow(NamedTuple):
    """One presentation to one observer.

    Attributes:
        tool: Index of the object.
        block: Index of the block.
        cycle: Number of the repetition within it, from 1.
        mass: Mass of the object then, [kg].
        force: Upward force before release from a clamp, [N]; NaN where there is no clamp.
        expected: Mass at the most probable densities, before the object is felt, [kg]; NaN if it is not known.
        believed_density: Most probable density of things never lifted of the colour of its first part, before it is
            felt, [kg/m^3].
        kind: Number of the kind of that colour that it is taken for after it was felt, 1 the oldest; 0 without kinds.
        p_value: Probability of what is felt, or of what is more surprising, by what was believed; NaN if nothing is.
    """

    tool: int
    block: int
    cycle: int
    mass: float
    force: float
    expected: float
    believed_density: float
    kind: int
    p_value: float


def describe_presentation(
    presentation: Presentation,
    seen: SeenObject,
    memories: tuple[Memory, Memory],
    *,
    prior: Prior,
    force: float,
    expected: float,
    p_value: float,
) -> PresentationRow:
    """Describes a presentation.

    Args:
        presentation: Presentation that is described.
        seen: Object, as heavy as it is then.
        memories: Memories before and after it.
        prior: Prior of materials never met.
        force: Upward force before release from a clamp, [N].
        expected: Mass at the most probable densities, [kg].
        p_value: Probability of what is felt.
    """
    before, after = memories
    met, colour = before.recognise(seen.appearance[0].colour, 0.0, prior)
    return PresentationRow(
        presentation.tool,
        presentation.block,
        presentation.cycle,
        seen.mass,
        force,
        expected,
        float(met.belief.compute_mode()[colour]),
        find_kind(after, seen.appearance),
        p_value,
    )


def see(tool: Tool) -> SeenObject:
    """What there is to be seen of an object by who mistakes nothing."""
    features = measure_features(tool, VisionError(), np.random.default_rng(0))
    return SeenObject(tool.mass, features, tuple(part.appearance for part in features))


def expect_mass(seen: SeenObject, memory: Memory, settings: Settings) -> float:
    """Mass at the most probable densities, [kg]; NaN where features are not seen as they are."""
    if settings.feature_source is not FeatureSource.FEATURES or settings.vision_error != VisionError():
        return math.nan  # it would take another picture, or another measurement
    belief = predict_object(seen.features, memory, settings.prior)
    return float(belief.compute_parameters(belief.densities.compute_mode())[0])


def describe_experience(
    config: ExperienceConfig, experience: Experience, places: Sequence[int], repeat: int
) -> list[PresentationRow]:
    """Describes the holds in which an observer learned before it was tested, of the first block.

    Args:
        config: Configuration of these holds.
        experience: Experience of all observers.
        places: Indices of each of its objects among those of the protocol.
        repeat: Number of the observer.
    """
    rows = []
    for trial, index in enumerate(experience.order[repeat]):
        seen, before = see(config.tools[index]), experience.recall(repeat, trial)
        row = describe_presentation(
            Presentation(places[index], 0, None, 1 + trial // len(config.tools)),
            seen,
            (before, experience.recall(repeat, trial + 1)),
            prior=config.settings.prior,
            force=math.nan,
            expected=expect_mass(seen, before, config.settings),
            p_value=experience.p_value[repeat, trial] if experience.p_value.size else math.nan,
        )
        rows.append(row)
    return rows


def stack_rows(rows: Sequence[PresentationRow]) -> dict[str, NDArray[Any]]:
    """Arrays over the N presentations of an observer, by names that begin with ROW."""
    columns = zip(*rows, strict=True)
    return {ROW + name: np.array(column) for name, column in zip(PresentationRow._fields, columns, strict=True)}


def write_rows(
    path: Path,
    learners: Mapping[str, Mapping[str, NDArray[Any]]],
    tools: Sequence[Tool],
    blocks: Sequence[str],
) -> None:
    """Writes every presentation to every observer as a row of a table of comma-separated values.

    Args:
        path: Path of the file.
        learners: Arrays of ``stack_rows``, stacked over observers, (R, N), by the name of the learner.
        tools: Objects of the protocol.
        blocks: Names of all blocks.
    """
    volumes = [compute_volume(tool) for tool in tools]
    lines = [",".join(COLUMNS)]
    for learner, arrays in learners.items():
        columns = [arrays[ROW + name].tolist() for name in PresentationRow._fields]
        for observer, of_observer in enumerate(zip(*columns, strict=True)):
            for lift, cells in enumerate(zip(*of_observer, strict=True), start=1):
                row = PresentationRow(*cells)
                who = (str(observer), learner, _quote(blocks[row.block]), str(row.cycle), str(lift))
                what = (_quote(tools[row.tool].name), _show(row.mass), _show(volumes[row.tool]))
                done = (_show(row.force), _show(row.expected), _show(row.believed_density))
                lines.append(
                    ",".join((*who, *what, *done, str(row.kind or ""), _show(compute_surprise(row.p_value))))
                )
    write_text(path, "\n".join(lines) + "\n")


def compute_surprise(p_value: float) -> float:
    """Minus the decimal logarithm of a probability, at most 300; NaN of NaN."""
    return math.nan if math.isnan(p_value) else -math.log10(max(p_value, _LEAST_P_VALUE))


def _show(value: float) -> str:
    """A number with the digits that measurements have; nothing for NaN."""
    return "" if math.isnan(value) else f"{value:.7g}"


def _quote(text: str) -> str:
    """A text as a cell."""
    quoted = text.replace('"', '""')
    return f'"{quoted}"' if any(mark in text for mark in ',"\n') else text
