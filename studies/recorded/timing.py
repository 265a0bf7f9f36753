"""Measures processor times of identification: one sample online, one posterior, one whole run."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator

from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.gains import Gains
from affordance.identification.identify import Runs, identify
from affordance.identification.posterior.calibration import calibrate_gains
from affordance.identification.posterior.inference import infer
from affordance.identification.posterior.payload_fit import build_channel_prior
from affordance.identification.settings import IdentificationSettings
from affordance.identification.systems import build_replay
from affordance.plant.serial_chain import SerialChain
from studies.recorded.clones import UR10E_LOAD, load_ur10e
from studies.recorded.peers import solve_least_squares, solve_semidefinite

_REPEATS = 5
_NUM_STEPS = 1000  # number of replayed steps; a posterior is computed at every hundredth


def measure_times(data: Path, evidence: Evidence, gains: Gains, settings: IdentificationSettings) -> dict[str, Any]:
    """Measures times on the recordings of the UR10e with its gains; the keys are as in metrics.json."""
    ur10e = load_ur10e(data)
    per_sample, per_posterior = _time_replay(ur10e.robot, evidence, gains.with_drift(settings), settings)

    def run() -> None:
        fresh = load_ur10e(data)
        identify(fresh.robot, Runs(fresh.loaded, (fresh.empty,)), gains=gains, settings=settings)

    return {
        "ms_per_sample": 1e3 * per_sample,
        "ms_per_posterior": 1e3 * per_posterior,
        "s_per_run": _time(run),
        "peers": compare_peers(evidence, settings),
    }


def compare_peers(evidence: Evidence, settings: IdentificationSettings) -> dict[str, Any]:
    """Computes each method's mean relative error of the mass over both halves, and its time to solution, [s].

    All methods get the same samples and the same gains, which our method estimated from the other half.
    """
    middle = len(evidence.prepared.times) // 2
    halves = evidence.select(slice(0, middle)), evidence.select(slice(middle, None))
    pairs = [(half, calibrate_gains(other, UR10E_LOAD, settings)) for half, other in (halves, halves[::-1])]
    methods: dict[str, Callable[..., float]] = {
        "least_squares": lambda half, gains: float(solve_least_squares(half, gains).parameters[0]),
        "semidefinite": lambda half, gains: float(solve_semidefinite(half, gains).parameters[0]),
        "ours": lambda half, gains: infer(half, gains.with_drift(settings), settings=settings).mass,
    }
    return {
        name: {
            "mass_error": float(np.mean([abs(solve(half, gains) / UR10E_LOAD - 1.0) for half, gains in pairs])),
            "s": float(np.mean([_time(partial(solve, half, gains)) for half, gains in pairs])),
        }
        for name, solve in methods.items()
    }


def _time_replay(
    robot: SerialChain, evidence: Evidence, gains: Gains, settings: IdentificationSettings
) -> tuple[float, float]:
    """Measures median times of a sample and of a posterior, [s], in a Diagram that replays the recordings."""
    diagram, identifier = build_replay(
        robot, evidence, gains, build_channel_prior(evidence, gains, settings), settings=settings
    )
    simulator = Simulator(diagram)
    context = identifier.GetMyContextFromRoot(simulator.get_mutable_context())
    bodies = identifier.GetOutputPort("bodies")
    samples, posteriors = [], []
    for step in range(1, _NUM_STEPS + 1):
        start = time.process_time()
        simulator.AdvanceTo(step / evidence.rate)
        samples.append(time.process_time() - start)
        if step % 100 == 0:
            start = time.process_time()
            bodies.Eval(context)
            posteriors.append(time.process_time() - start)
    return float(np.median(samples)), float(np.median(posteriors))


def _time(function: Callable[[], Any]) -> float:
    times = []
    for _ in range(_REPEATS):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return float(np.median(times))
