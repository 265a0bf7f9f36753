"""Life of one observer, which holds pieces of stock one after the other; its choices are judged in between."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.inner_simulation import Choice
from affordance.choice.ranking import rank_draws
from affordance.identification.identify import identify, see_tool
from affordance.identification.settings import DEFAULT_SETTINGS
from affordance.memory.identified_trial import build_identified_trial
from affordance.memory.ledger import open_memory
from affordance.objects.tool import Tool
from affordance.settings import Settings
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from studies.active.world import draw_parameters, find_true_costs
from studies.loop.recordings import Recorder

# Numbers of pieces after which choices are judged, by their name in metrics.json.
LEVELS: Mapping[str, int] = {"before": 0, "after_1": 1, "after_2": 2, "after_5": 5}
# Relative standard deviation of the sizes of stock, which are measured with a ruler.
_SIZE_ERROR = 0.02
# Possible unseen fraction of the mass of stock, which is solid. It was lowered after a first run with the default of
# a fifth, with which no density can be known to better than a fifth.
_IDENTIFICATION = replace(DEFAULT_SETTINGS, num_samples=500, unseen_share=0.02)


class Judged(NamedTuple):
    """Choice, judged with the true inertias."""

    is_right: float  # 1 if no usable option costs less, else 0; NaN if no option can do the task
    regret: float  # excess of the cost over that of the best option, as a fraction of the best cost


# By name of the tool, its ten inertial parameters at its true densities, (10,), about To and expressed in T.
type Truths = Mapping[str, Array]


def draw_truth(tool: Tool, deviation: float, rng: np.random.Generator) -> Array:
    """Draws a tool's true parameters, (10,); each of its materials deviates once from its mean density."""
    features = measure_features(tool, VisionError(), rng)
    materials = [part.material.name for part in tool.components]
    means = {part.material.name: part.material.density for part in tool.components}
    return draw_parameters(features, materials, means, deviation, rng)


def live(
    place: Path, recorder: Recorder, pieces: Sequence[Tool], settings: Settings, rng: np.random.Generator
) -> Iterator[MaterialMemory]:
    """Lets an observer hold pieces of stock in random order; yields its memory before the first and after each piece.

    ``rng`` draws the order, the true densities and all errors; ``place`` is the file of the lasting memory.
    """
    with open_memory(place) as ledger:
        yield ledger.recall(settings.learner, settings.prior)
        for index in rng.permutation(len(pieces)):
            piece = pieces[index]
            pi = draw_truth(piece, settings.prior.deviation, rng)
            seen = see_tool(piece, ledger.recall(prior=settings.prior), settings.prior, _SIZE_ERROR)
            runs = recorder.record(pi, rng, piece.name)
            belief = identify(
                recorder.chain, runs, seen=seen, deviation=settings.prior.deviation, settings=_IDENTIFICATION
            )
            if belief.teaches:
                trial = build_identified_trial(
                    belief, seen, recorder.chain, runs.loaded, piece.name, _IDENTIFICATION.unseen_share
                )
                ledger.append([trial])
            yield ledger.recall(settings.learner, settings.prior)


def judge(
    choice: Choice,
    memory: MaterialMemory,
    truths: Truths,
    criterion: Criterion,
    num_samples: int,
    rng: np.random.Generator,
) -> Judged:
    """Judges the option advised under a memory by its cost with the true inertias, along the planned motions."""
    ranking = rank_draws(choice, choice.draw(memory, rng, num_samples), rng, criterion=criterion)
    costs = find_true_costs(choice, truths, criterion)
    names = [option.name for option in choice.options]
    best = float(costs.min())
    if not np.isfinite(best):
        return Judged(np.nan, np.nan)
    # If no option is usable under the belief, the observer takes the one ranked first.
    chosen = float(costs[names.index(ranking.ranked[0].option.name)])
    return Judged(float(chosen <= best), (chosen - best) / best if np.isfinite(chosen) else 1.0)


def is_mass_covered(choice: Choice, memory: MaterialMemory, truths: Truths, rng: np.random.Generator) -> list[bool]:
    """Checks for each tool whether the 90 % interval of its predicted mass contains the true mass."""
    masses = choice.draw(memory, rng, 2000).parameters[:, :, 0]
    low, high = np.quantile(masses, [0.05, 0.95], axis=1)
    first = {option.object_name: i for i, option in reversed(list(enumerate(choice.options)))}
    return [bool(low[first[name]] <= pi[0] <= high[first[name]]) for name, pi in truths.items()]
