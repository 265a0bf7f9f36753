"""Simulates pick-ups by a robot in MuJoCo, and identifies the loads live.

Robot and identification run in this process or, over the wire, in two separate processes.
"""

import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance import LiveEvent, LiveIdentifier, Run, Runs, identify, load_robot
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.live.foreign_robot import ARMS, RATE, Sample, Truth, simulate, spoil, write_model
from affordance.extensions.payload.recording.run import RunDescription
from affordance.extensions.payload.settings import SignalKind
from affordance.plant.serial_chain import SerialChain
from studies.live import wire

# Masses, [kg], from the resolution of an arm's sensors to the arm's payload.
MASSES = {"fr3": (0.15, 3.0), "ur5e": (0.15, 4.5)}
WIRE = "wire"  # over DDS, in real time
# Disturbances of a stream: share of lost samples, jitter of time stamps, [s], and True if velocities are included.
WAYS = {"whole": (0.0, 0.0, True), "spoilt": (0.05, 0.005, False), WIRE: (0.0, 0.0, True)}
_BEFORE, _LOADED, _AFTER, _EMPTY, _CONSTANT = 5.0, 11.0, 4.0, 12.0, 60.0  # durations of motion, [s]
_HALTS = 2.8  # time at rest while picking up and putting down, [s]
_WEIGHED = 2.5  # mass for calibrating currents, [kg]
_NUM_EMPTY = 3


@dataclass(frozen=True)
class PickupConfig:
    """Configuration of the pick-ups of one arm."""

    arm: str  # name in ARMS
    way: str = "whole"  # name in WAYS
    seed: int = 0


class Followed:
    """Robot with a recorded empty arm, and the events found in its stream."""

    def __init__(self, config: PickupConfig, repeat: int) -> None:
        """Records the empty runs, and a weighed load for motor currents, and fits the empty arm."""
        self._config, self._repeat, self._seed = config, repeat, 10_000 * config.seed + 10 * repeat
        self._lose, self._jitter, self._has_v = WAYS[config.way]
        self.robot = _load(config.arm)
        self.empty = [self._record(f"move {_EMPTY:g}", k) for k in range(1, 1 + _NUM_EMPTY)]
        self.gains = self._weigh() if ARMS[config.arm].signal == "current" else None
        self.events: list[LiveEvent] = []
        self.milliseconds: dict[str, list[float]] = {"sample": [], "belief": []}
        self.wire: list[int] = []  # number of samples sent, received and unused, and of skipped beliefs

    def _simulate(self, script: str, k: int) -> Iterator[Sample | Truth]:
        return simulate(self._config.arm, script, self._seed + k, arm_seed=self._seed)

    def _record(self, script: str, k: int) -> Run:
        rows = [each for each in self._simulate(script, k) if isinstance(each, Sample)]
        description = RunDescription(self.robot.joint_names, SignalKind(ARMS[self._config.arm].signal), tip="flange")
        t, q, v, signal = (np.array([getattr(row, name) for row in rows]) for name in ("time", "q", "v", "signal"))
        return Run(f"run {k} ({script})", description, t, q, signal, v if self._has_v else None)

    def _weigh(self) -> Gains | None:
        loaded, empty = self._record(f"hold {_WEIGHED}, move {_EMPTY:g}", 9), self._record(f"move {_EMPTY:g}", 9)
        return identify(self.robot, Runs(loaded, (empty,)), reference_mass=_WEIGHED).calibration

    def follow(self, script: str) -> list[Truth]:
        """Processes a whole stream. Returns the true loads, in order of time."""
        live, marks = LiveIdentifier(self.robot, self.empty, gains=self.gains), []
        for each in spoil(self._simulate(script, 0), lose=self._lose, jitter=self._jitter, seed=self._seed):
            if isinstance(each, Truth):
                marks.append(each)
                continue
            start = time.process_time()
            events = live.add(each.time, each.q, each.v if self._has_v else None, each.signal)
            kinds = [event.kind for event in events]
            if "final" not in kinds:
                what = "belief" if "belief" in kinds else "sample"
                self.milliseconds[what].append(1e3 * (time.process_time() - start))
            self.events += events
        return marks

    def average(self) -> NDArray[Any]:
        """Computes the mean CPU time per sample and per belief, [ms]."""
        return np.array([np.mean(self.milliseconds[what]) for what in ("sample", "belief")])

    def follow_wire(self, script: str, seconds: float) -> list[Truth]:
        """Processes a stream over the wire in real time, for a duration in [s]. Returns the true loads."""
        seconds -= 0.5 / RATE  # half a sample, because time stamps are rounded
        number, arm = self._repeat, self._config.arm
        found = wire.follow(arm, script, self._seed, self.empty, self.gains, seconds=seconds, number=number)
        self.events, num_sent = found.events, int(seconds * RATE) + 1
        self.wire = [num_sent, found.received, found.unused, found.left_out]
        return found.loads


def _load(arm: str) -> SerialChain:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{arm}.xml"
        path.write_text(write_model(arm), encoding="utf-8")
        return load_robot(path, "flange")


def run_pickup(config: PickupConfig, repeat: int) -> Mapping[str, NDArray[Any]]:
    """Identifies the load of one pick-up with a random mass.

    Returns:
        ``mass``: true mass, [kg].
        ``delay``: delays, [s], from the pick-up until the change was detected, until it was named, until the SD of
            the mass was below 5 %, and until the belief was precise enough; NaN if never.
        ``put``: delay until the put-down was detected, [s].
        ``beliefs``: number of beliefs about the load, and number of these whose interval contains the true mass.
        ``last``: mean and SD of the last belief, and 1 if its interval contains the true mass.
        ``final``: the same for ``identify``, and 1 if the result is trusted.
        ``com``: errors of the centre of mass in the last belief, [m].
        ``agreement``: mass of the last belief minus mass of ``identify``, in SDs.
        ``false``: number of false changes.
        ``milliseconds``: mean CPU time per sample and per belief; or ``wire``: number of samples sent, received and
            unused, and of skipped beliefs.
        ``doubts``: doubts of ``identify``.
    """
    rng = np.random.default_rng((config.seed, list(ARMS).index(config.arm), repeat))
    mass = float(np.exp(rng.uniform(*np.log(MASSES[config.arm]))))
    followed = Followed(config, repeat)
    script, over_wire = f"move {_BEFORE:g}, pick {mass}, move {_LOADED:g}, put, move ", config.way == WIRE
    if over_wire:
        # The stream is longer than the part that is processed.
        pick, put = followed.follow_wire(f"{script}{_AFTER + 1.0:g}", _BEFORE + _LOADED + _AFTER + _HALTS)
    else:
        pick, put = followed.follow(f"{script}{_AFTER:g}")
    events, nan = followed.events, float("nan")

    def find_said(event: LiveEvent) -> float:
        return float(event.content.get("said", event.time))

    def wait(kind: str, since: float, until: float = np.inf) -> float:
        return next((find_said(e) - since for e in events if e.kind == kind and since < e.time < until), nan)

    def holds(content: Mapping[str, Any]) -> bool:
        low, high = content["mass_interval90"]
        return bool(low <= mass <= high)

    beliefs = [
        e
        for e in events
        if e.kind == "belief"
        and e.content["of"] - e.content["seconds"] > pick.time - 0.1
        and e.content["of"] < put.time - 0.2
    ]
    of_load = [e for e in beliefs if e.time < put.time]

    def until(test: Any) -> float:
        return next((find_said(e) - pick.time for e in of_load if test(e.content)), nan)

    last = beliefs[-1] if beliefs else None
    finals = [e for e in events if e.kind == "final" and "mass_kg" in e.content and pick.time < e.time < put.time]
    final = finals[-1].content if finals else None
    changes = [e.time for e in events if e.kind == "changed"]
    true = [t for t in changes if 0.0 < t - pick.time < 4.0 or 0.0 < t - put.time < 4.0]
    at_final = next((e for e in reversed(beliefs) if finals and e.time <= finals[-1].time), None)
    agreement = nan
    if final is not None and at_final is not None:
        agreement = (at_final.content["mass_kg"] - final["mass_kg"]) / final["mass_sd_kg"]
    none = np.full(3, nan)
    return {
        "mass": np.array(mass),
        "delay": np.array(
            [
                wait("changed", pick.time, put.time),
                wait("taken up", pick.time),
                until(lambda c: c["mass_sd_kg"] <= 0.05 * c["mass_kg"]),
                until(lambda c: c["enough"]),
            ]
        ),
        "put": np.array(wait("changed", put.time)),
        "beliefs": np.array([len(beliefs), sum(holds(e.content) for e in beliefs)]),
        "last": none
        if last is None
        else np.array([last.content["mass_kg"], last.content["mass_sd_kg"], holds(last.content)]),
        "com": none if last is None else np.array(last.content["com_m"]) - pick.com,
        "final": np.full(4, nan)
        if final is None
        else np.array([final["mass_kg"], final["mass_sd_kg"], holds(final), final["trusted"]]),
        "agreement": np.array(agreement),
        "false": np.array(len(changes) - len(true)),
        **({"wire": np.array(followed.wire)} if over_wire else {"milliseconds": followed.average()}),
        "doubts": np.array(" | ".join(d for e in finals for d in e.content["doubts"])[:400]),
    }


def run_constant(config: PickupConfig, repeat: int) -> Mapping[str, NDArray[Any]]:
    """Processes a stream with a constant load, in which every detected change is false.

    Returns: ``seconds``, duration of the stream, [s], and ``false``, number of detected changes.
    """
    rng = np.random.default_rng((config.seed, 7, list(ARMS).index(config.arm), repeat))
    mass = float(np.exp(rng.uniform(*np.log(MASSES[config.arm]))))
    followed = Followed(config, repeat + 500_000)
    followed.follow(f"{f'hold {mass}, ' if repeat % 2 else ''}move {_CONSTANT:g}")
    changes = sum(event.kind == "changed" for event in followed.events)
    return {"seconds": np.array(_CONSTANT), "false": np.array(float(changes))}
