"""Simulations II to IV with each learner: beliefs and holds without a decoy, and choices of grips.

Observers hold the objects of Simulation II in the same order and with the same errors of measurement, whatever their
learner. Without odd objects a learner with kinds should do what one with a single density for each colour does.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.belief.kind_memory import count_kinds, start_memory
from affordance.belief.learner import Learner
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.picking import pick_cheapest
from affordance.choice.ranking import rank_options
from affordance.experiments.protocol_runs import load_choice_experiment
from affordance.experiments.shared.decisions import count_correct
from affordance.experiments.shared.experience import ExperienceConfig, draw_order
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.objects.tool import list_densities
from affordance.reporting.statistics import compute_excursion, estimate_mean
from affordance.runs.random_streams import Stream
from affordance.simulation.trial import Observer, get_runner
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.systems import predict_object
from studies.study import run_kept

TASKS = ("reach", "hammer")
# Number of densities drawn to compute the probability of a choice.
_NUM_CHOICES = 500


@dataclass(frozen=True)
class HonestConfig:
    """Configuration of the study."""

    com: PresentationExperiment  # experiment of Simulation II: objects, order and decoy
    models: Path  # folder with the tasks of Simulations III and IV
    learner: Learner  # learner of the observers


def run_repeat(config: HonestConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Runs one observer.

    Returns: Over the K + 1 moments before the first and after each hold ``density_median`` (K + 1, M), [kg/m^3],
        ``reach`` and ``hammer`` (K + 1,), the probability that the correct grip is chosen, and ``num_kinds`` (K +
        1,); ``first`` (K,), True where the object was held for the first time; ``excursion`` (3,) of the test pass,
        [m]; and ``mass_error`` and ``com_error`` (2,), [m], of the belief about the objects other than the decoy
        then.
    """
    held = config.com.experience
    assert held is not None  # Simulation II has one
    seed = held.seed
    memory = start_memory(config.learner, (seed, repeat, Stream.KINDS)).add_colours(held.colours, held.settings.prior)
    observer = Observer(get_runner(held.settings), memory, duration=held.duration, remembered=held.colours)
    memories, order = [memory], draw_order(held, repeat)
    for trial, index in enumerate(order):
        observer.hold(held.tools[index], (seed, repeat, trial))
        memories.append(observer.memory)
    tests = run_test_pass(config.com, memories[-1], repeat)
    errors = np.array([_measure_errors(config, index, memories[-1]) for index in range(len(held.tools))])
    chosen = {
        task: np.array(
            [
                _compute_p_correct(config.models, task, held, memory, (seed, repeat, trial, Stream.PAPER))
                for trial, memory in enumerate(memories)
            ]
        )
        for task in TASKS
    }
    return {
        **chosen,
        "density_median": np.array([memory.belief.compute_percentiles([0.5])[0] for memory in memories]),
        "num_kinds": np.array([count_kinds(memory) for memory in memories]),
        "first": np.array([index not in order[:trial] for trial, index in enumerate(order)]),
        "excursion": compute_excursion(np.array([record.height_centre for record in tests])),
        "mass_error": errors[:, 0],
        "com_error": errors[:, 1],
    }


def run_test_pass(com: PresentationExperiment, memory: Memory, repeat: int) -> list[TrialRecord]:
    """Presents the objects of all blocks but the first under the given memory; returns the records."""
    drawn = [each for each in com.draw_presentations(repeat) if each.block]
    return [each.record for each in com.means.present(com, memory, drawn, repeat) if each.record is not None]


def run(com: PresentationExperiment, models: Path, folder: Path, *, repeats: int, jobs: int) -> dict[str, Any]:
    """Runs all observers of all learners; those that the folder holds are not run again.

    Returns: Numbers by learner, see ``compute_metrics``.
    """
    numbers = {}
    for learner in Learner:
        config, name = HonestConfig(com, models, learner), f"honest, {learner.value}"
        arrays = run_kept(config, run_repeat, folder, models, repeats=repeats, jobs=jobs, description=name)
        numbers[learner.value] = compute_metrics(arrays)
    return numbers


def compute_metrics(arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Computes the numbers of one learner from the arrays of all observers."""
    excursion = estimate_mean(arrays["excursion"])
    founded = np.diff(arrays["num_kinds"], axis=1) > 0
    later = arrays["first"].copy()
    later[:, 0] = False  # the very first object creates the kinds of its colours rightly
    return {
        "density_median": np.median(arrays["density_median"], axis=0),
        "mass_error": float(np.median(arrays["mass_error"])),
        "com_error_m": float(np.median(arrays["com_error"])),
        "height_extreme_m": excursion.mean,
        "height_extreme_m_ci95": excursion.ci95,
        **{f"p_correct_{task}": arrays[task].mean(axis=0) for task in TASKS},
        "needless_kinds": float(founded[later].mean()),
        "kinds_at_end": float(arrays["num_kinds"][:, -1].mean()),
    }


@lru_cache(maxsize=4)
def _plan(models: Path, task: str, held: ExperienceConfig) -> tuple[Choice, int]:
    """Plans the choice of a grip of the first novel tool; returns it and the index of the truly best option."""
    experiment = load_choice_experiment(task, models, held.seed, held.settings)
    plain, model = experiment.novel[0], experiment.task
    choice = plan_choice(list_options(plain), model, held.settings)
    expert = MaterialMemory.from_densities(list_densities([plain]))
    best = rank_options(choice, expert, np.random.default_rng(0), num_samples=1).best
    return choice, choice.options.index(best.option)


def _compute_p_correct(
    models: Path, task: str, held: ExperienceConfig, memory: Memory, seed: tuple[int, ...]
) -> float:
    """Computes the probability that the cheaper grip is chosen by one density drawn (paper, IV-C and IV-D)."""
    choice, correct = _plan(models, task, held)
    rng = np.random.default_rng(seed)
    chosen = pick_cheapest(choice.compute_costs(choice.draw_parameters(memory, rng, _NUM_CHOICES)), rng)
    return float(count_correct(chosen, correct) / _NUM_CHOICES)


def _measure_errors(config: HonestConfig, index: int, memory: Memory) -> tuple[float, float]:
    """Computes the relative error of an object's believed mass, and the error of its centre of mass, [m]."""
    held = config.com.experience
    assert held is not None  # Simulation II has one
    tool = held.tools[index]
    features = measure_features(tool, VisionError(), np.random.default_rng(0))
    belief = predict_object(features, memory, held.settings.prior)
    pi = belief.compute_parameters(belief.densities.compute_mode())
    return abs(pi[0] / tool.mass - 1.0), float(np.linalg.norm(pi[1:4] / pi[0] - tool.p_TTcm))
