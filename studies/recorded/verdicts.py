"""Tests the self-checks of identification: mistakes found, false alarms, and shifts of intervals with the seed."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from affordance.exceptions import AffordanceError
from affordance.identification.evidence.gains import Gains
from affordance.identification.evidence.paired_runs import align
from affordance.identification.identify import Runs, identify
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings
from studies.recorded.clones import UR10E_LOAD, PandaData, Ur10eData
from studies.recorded.mistake_outcomes import Case, count_outcomes, try_mistakes
from studies.recorded.mistakes import MISTAKES

# Durations of the windows in which a good recording is judged, [s]; windows overlap by half.
_PAIR_LENGTHS, _SINGLE_LENGTHS = (8.0, 12.0, 16.0, 25.0), (5.0, 7.0, 10.0, 15.0)
_SEEDS = range(5)
# Windows of the pair, by index, that are identified without gains: two of 8 s and one of 12 s.
_UNWEIGHED = (0, 9, 12)
# Sources of knowledge about gains and the empty arm.
_MODES = ("by the arm's weight", "weighed", "gains", "unpaired")
_FEW = 1000  # number of samples that is enough for a verdict


def study_mistakes(data: Ur10eData, gains: Gains, settings: IdentificationSettings) -> tuple[dict[str, Any], Any]:
    """Makes every mistake in the pair three times: with a weighed load, with earlier gains, and with neither.

    Returns:
        Counts of the verdicts for the first two, and under ``without_gains`` for the third; then each verdict with
        its reason.
    """
    settings = replace(settings, num_samples=_FEW)
    case = Case(data.robot, data.empty, data.loaded, UR10E_LOAD)
    cases = {
        "weighed": replace(case, reference_mass=UR10E_LOAD),
        "gains": replace(case, gains=gains),
        "neither": case,
    }
    outcomes = {name: try_mistakes(each, MISTAKES, settings) for name, each in cases.items()}
    counts: dict[str, Any] = count_outcomes([*outcomes["weighed"], *outcomes["gains"]])
    counts["without_gains"] = count_outcomes(outcomes["neither"])
    return counts, {name: [outcome._asdict() for outcome in each] for name, each in outcomes.items()}


def measure_false_alarms(
    data: Ur10eData, gains: Gains, panda: PandaData, settings: IdentificationSettings
) -> tuple[float, int]:
    """Computes the share of good windows that are refused or not trusted, and the number of windows."""
    settings = replace(settings, num_samples=_FEW)
    verdicts = [
        *(_is_refused(data, *runs, gains, settings, mode) for runs in _cut_pairs(data) for mode in _MODES),
        *(not identify(panda.robot, Runs(run), settings=settings).is_trusted for run in _cut(panda.empty)),
    ]
    return float(np.mean(verdicts)), len(verdicts)


def _is_refused(
    data: Ur10eData, loaded: Run, empty: Run, gains: Gains, settings: IdentificationSettings, mode: str
) -> bool:
    try:
        belief = identify(
            data.robot,
            Runs(loaded, (empty,)),
            paired=mode != "unpaired",
            gains=gains if mode in ("gains", "unpaired") else None,
            reference_mass=UR10E_LOAD if mode == "weighed" else None,
            settings=settings,
        )
    except AffordanceError:
        return True
    return not belief.is_trusted


def _cut(run: Run) -> Iterator[Run]:
    times = run.times - run.times[0]
    for length in _SINGLE_LENGTHS:
        for start in np.arange(0.0, times[-1] - length, 0.5 * length):
            yield run.select(slice(*np.searchsorted(times, [start, start + length])))


def _cut_pairs(data: Ur10eData) -> Iterator[tuple[Run, Run]]:
    """Cuts both runs into windows of the same motion; yields the loaded and the empty part of each window."""
    names = data.robot.joint_names
    empty, loaded = data.empty, data.loaded
    lag = align(empty.arrange(names), loaded.arrange(names), IdentificationSettings().repeat_tolerance).lag
    for length in _PAIR_LENGTHS:
        for start in np.arange(empty.times[0], empty.times[-1] - length, 0.5 * length):
            first, last = start + lag, start + lag + length
            if first < loaded.times[0] or last > loaded.times[-1]:
                continue
            without = empty.select(slice(*np.searchsorted(empty.times, [start, start + length])))
            yield loaded.select(slice(*np.searchsorted(loaded.times, [first, last]))), without


def measure_seed_shift(data: Ur10eData, gains: Gains, panda: PandaData, settings: IdentificationSettings) -> float:
    """Measures how far the ends of 50 and 90 % intervals move with the seed.

    Returns:
        The largest distance of an end from its mean over seeds, in standard deviations of the quantity, over all
        recordings and quantities.
    """
    pair = Runs(data.loaded, (data.empty,))
    windows = [each for number, each in enumerate(_cut_pairs(data)) if number in _UNWEIGHED]
    kinds: list[tuple[Any, Runs, dict[str, Any]]] = [
        (data.robot, pair, {"gains": gains}),
        (data.robot, pair, {"reference_mass": UR10E_LOAD}),
        (panda.robot, Runs(panda.empty), {}),
        *((data.robot, Runs(loaded, (empty,)), {}) for loaded, empty in windows),
    ]
    shifts = []
    for robot, runs, known in kinds:
        beliefs = [identify(robot, runs, settings=replace(settings, seed=seed), **known) for seed in _SEEDS]
        found = [belief.marginals for belief in beliefs]
        edges = np.array([[m.low50, m.high50, m.low90, m.high90] for m in found]) / found[0].sd
        shifts.append(np.abs(edges - edges.mean(axis=0)).max())
    return float(max(shifts))
