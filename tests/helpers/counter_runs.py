"""Small runs of every experiment, as shipped and with one thing changed, by whose numbers claims are judged."""

import dataclasses
import functools
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from affordance.belief import kind_memory
from affordance.belief.learner import Learner, Pick
from affordance.experiments.chosen_holds import ChosenHolds
from affordance.experiments.protocol_runs import load_hold_experiment, load_protocol_experiment
from affordance.files.model_folder import MODELS
from affordance.named_settings import Changes, change_settings
from affordance.proprioception.faults import Faults
from affordance.settings import DEFAULT_SETTINGS, Settings
from helpers.short_holds import choose_for_one_tool, shorten
from helpers.stacked import stack

type Numbers = Mapping[str, Any]
type Change = Callable[[pytest.MonkeyPatch], Settings]

# Number of observers who hold, and durations of a hold, [s].
_HOLDERS = 2
_HELD = {"weight": 0.6, "com": 1.0}
# A threshold of torque below which lies whatever is held, [N m].
NUMB: Changes = {"noise.threshold": 50.0}
NO_SAMPLES = dataclasses.replace(DEFAULT_SETTINGS, faults=Faults(drop_probability=1.0))
# Breadths of a category by which everything is of one kind, and everything of a kind of its own.
ONE_KIND, OWN_KINDS = 8.0, 0.02


@functools.cache
def hold(name: str, settings: Settings = DEFAULT_SETTINGS) -> Numbers:
    """Simulation I or II by two observers."""
    experiment = shorten(dataclasses.replace(load_hold_experiment(name), settings=settings), _HELD[name])
    with tempfile.TemporaryDirectory() as folder:
        experience = experiment.gain_experience(Path(folder), repeats=_HOLDERS, jobs=1)
    runs = [experiment.run_observer(None, experience, repeat) for repeat in range(_HOLDERS)]
    return experiment.compute_metrics(None, experience, stack(runs))


def believe_denser() -> Numbers:
    """Simulation I by observers who believe in densities of 20,000 kg/m^3."""
    return hold("weight", change_settings(DEFAULT_SETTINGS, {"prior.mode": 20_000.0}))


@functools.cache
def lift(group: int, *, is_numb: bool = False, kappa: float | None = None, repeats: int = 1) -> Numbers:
    """The protocol of a group of people, with a third of its lifts, by few observers of each learner."""
    settings = change_settings(DEFAULT_SETTINGS, NUMB if is_numb else {})
    experiment = load_hold_experiment(("linear_plus", "linear_plus_plus")[group], MODELS, 0, settings)
    counts = zip(experiment.blocks, (5, 16), strict=True)
    blocks = tuple(block.model_copy(update={"repetitions": count}) for block, count in counts)
    experiment = dataclasses.replace(experiment, blocks=blocks, kappa=kappa)
    return experiment.compute_metrics(
        None, None, stack([experiment.run_observer(None, None, repeat) for repeat in range(repeats)])
    )


def lift_family(name: str, *, kappa: float | None = None) -> Numbers:
    """A protocol of lifts in closed form by one observer of each learner."""
    with pytest.MonkeyPatch.context() as patch:
        _widen(patch, kappa)
        experiment = load_protocol_experiment(name)
        runs = [experiment.run_observer(None, None, 0)]
    return experiment.compute_metrics(None, None, stack(runs))


@functools.cache
def lift_next(*, has_no_doubts: bool = False) -> Numbers:
    """Returns what one observer of two learners lifts after an odd object, with or without any doubts."""
    with pytest.MonkeyPatch.context() as patch:
        if has_no_doubts:
            patch.setattr(ChosenHolds, "list_felt", lambda *told: {})
        experiment = load_hold_experiment("next_lift").with_learners([Learner.DENSITY, Learner.KINDS_MAP])
        experiment = choose_for_one_tool(experiment)
        return experiment.compute_metrics(None, None, stack([experiment.run_observer(None, None, 0)]))


def _widen(patch: pytest.MonkeyPatch, kappa: float | None) -> None:
    if kappa is not None:
        for pick in Pick:
            patch.setitem(kind_memory.KAPPA, pick, kappa)
