"""``affordance live``: identifies what a running robot holds now.

It reads joint states, and sends no commands to the robot.
"""

import argparse
import contextlib
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.arguments import check_number
from affordance.commands import answers
from affordance.commands.demo import ARM_FILE, EMPTIES, EMPTY, LOADED, MASS, PIECE, announce, check_alone
from affordance.commands.payload.identify import find_flange_of, load_robot_of
from affordance.exceptions import PROSE, BadValueError, show_text
from affordance.extensions.payload.evidence.gains import read_gains
from affordance.extensions.payload.live import foreign_robot
from affordance.extensions.payload.live.live_identifier import LiveEvent, LiveIdentifier
from affordance.extensions.payload.live.live_text import describe_event
from affordance.extensions.payload.live.recorder import Recorder, describe
from affordance.extensions.payload.live.rtde import PORT, read_rtde
from affordance.extensions.payload.live.samples import JointOrder, Sample, read_lines, replay
from affordance.extensions.payload.payload_setting import format_payload
from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.recording.run_file import read_run
from affordance.extensions.payload.settings import SignalKind
from affordance.extensions.robots.recorded_arm import Flange
from affordance.files.atomic import to_plain
from affordance.plant.load import HAND_FRAME
from affordance.plant.serial_chain import SerialChain

_GAP = 0.25  # time between samples above which a new recording begins, [s]
_SILENT = 5.0  # time without a sample after which a single remark is printed, [s]
_MOST_WAITING = 100_000  # largest number of queued samples; then the sender must wait
_MOST_DOMAIN = 232
_EMPTY_SCRIPT, _SCRIPT = "move 15", "move 5, pick 1.2, move 12, put, move 4"


class _Program(NamedTuple):
    """Robot, identifier and recorder of one run of the command."""

    robot: SerialChain
    flange: Flange | str
    live: LiveIdentifier | None  # None if the stream is only recorded
    recorder: Recorder | None


def run(arguments: argparse.Namespace) -> int:
    """Follows a stream, prints one line per event, and returns the exit status.

    The status is 0 if the last final answer is trusted or the stream is only recorded, else 3.
    """
    if arguments.seconds is not None:
        check_number("--seconds", arguments.seconds, 0.1, 1e7, "s")
    if arguments.demo is None:
        return _follow(arguments, _prepare(arguments))
    check_alone(arguments, {"robot": "a robot", "empty": "--empty", "tip": "--tip", "gains": "--gains"})
    if arguments.demo == "bar":
        arguments.robot, arguments.empty, arguments.replay = ARM_FILE, EMPTIES, [EMPTY, LOADED]
        arguments.flange = arguments.flange or HAND_FRAME
        words = ["live", ARM_FILE, "--empty", *EMPTIES, "--replay", EMPTY, LOADED, "--flange", arguments.flange]
        announce(arguments, words)
        status = _follow(arguments, _prepare(arguments))
        answers.tell(arguments, f"\nThe true mass of the {PIECE} in the simulation is {MASS:.3f} kg.")
        return status
    return _follow_foreign(arguments)


def _prepare(arguments: argparse.Namespace) -> _Program:
    """Loads the robot and the empty runs, and fits the arm to them."""
    empty = [read_run(path, arguments.description) for path in arguments.empty]
    if not empty and arguments.record is None:
        problem = "is missing, must be recordings with an empty hand; --record DIR makes them"
        raise BadValueError("--empty", "", problem)
    gains = None if arguments.gains is None else read_gains(arguments.gains)
    # The first run's description names the robot's tip and base.
    first = empty[0] if empty else _pretend(arguments)
    robot, kind = load_robot_of(arguments, first), first.description.kind
    flange = find_flange_of(arguments, robot, first)
    live = LiveIdentifier(robot, empty, gains=gains) if empty else None
    recorder = None
    if arguments.record is not None:
        file = None if not empty else arguments.description or arguments.empty[0].with_suffix(".yaml")
        recorder = Recorder(arguments.record, describe(file, robot.joint_names, kind, robot.tip))
    return _Program(robot, flange, live, recorder)


def _pretend(arguments: argparse.Namespace) -> Run:
    """Builds a run from the arguments alone, to load a robot without recordings."""
    times = np.arange(20.0) / 100.0
    zero = np.zeros((20, 1))
    return Run("the stream", RunDescription(("a joint",), SignalKind(arguments.signal)), times, zero, zero)


def _follow(arguments: argparse.Namespace, program: _Program) -> int:
    """Follows the stream that the arguments name."""
    joints = program.robot.joint_names
    kind = SignalKind(arguments.signal) if program.live is None else SignalKind(program.live.ready.content["signal"])
    if arguments.replay:
        return _use(arguments, program, replay([read_run(path, arguments.description) for path in arguments.replay]))
    if arguments.rtde:
        host, _, port = arguments.rtde.partition(":")
        if port and not port.isdigit():
            raise BadValueError("--rtde", "", f"is {arguments.rtde!r}, must be HOST or HOST:PORT")
        source = read_rtde(host, kind, int(port or PORT))
    elif arguments.ros2:
        domain = os.environ.get("ROS_DOMAIN_ID") or "0"
        if not domain.isdecimal() or int(domain) > _MOST_DOMAIN:
            raise BadValueError(
                "ROS_DOMAIN_ID", "", f"is {domain!r}, must be a whole number from 0 to {_MOST_DOMAIN}"
            )
        try:
            from affordance.extensions.payload.live.ros2 import read_ros2
        except ImportError as error:
            raise BadValueError("--ros2", "", "needs the library cyclonedds: pip install cyclonedds") from error
        source = read_ros2(arguments.ros2, int(domain))
    else:
        source = read_lines(sys.stdin, joints)
    return _use(arguments, program, _read_ahead(arguments, source), is_live=True)


def _read_ahead(arguments: argparse.Namespace, source: Iterator[Sample]) -> Iterator[Sample]:
    """Reads samples in a separate thread, so that no sample is lost during computations."""
    waiting: queue.Queue[Sample | BaseException | None] = queue.Queue(_MOST_WAITING)

    def read() -> None:
        try:
            for sample in source:
                waiting.put(sample)
            waiting.put(None)
        except BaseException as error:  # raised again in the thread that uses the samples
            waiting.put(error)

    threading.Thread(target=read, daemon=True).start()
    patience: float | None = _SILENT
    while True:
        try:
            sample = waiting.get(timeout=patience)
        except queue.Empty:
            patience = None  # the remark is printed only once
            place = arguments.ros2 or arguments.rtde or "standard input"
            answers.tell(arguments, f"nothing has come for {_SILENT:g} s: waiting for {place}")
            continue
        if sample is None:
            return
        if isinstance(sample, BaseException):
            raise sample
        yield sample


def _use(arguments: argparse.Namespace, program: _Program, source: Iterator[Sample], is_live: bool = False) -> int:
    """Processes the samples of a stream, prints events, and returns the exit status."""
    live, recorder, order = program.live, program.recorder, JointOrder(program.robot.joint_names)
    first: float | None = None
    newest, least, status = -np.inf, np.inf, 3
    X_TF = np.eye(4) if isinstance(program.flange, str) else np.linalg.inv(program.flange.X_FT)

    def show(events: list[LiveEvent]) -> None:
        """Prints events, and notes if a final answer is trusted."""
        nonlocal status
        for event in events:
            _print_event(arguments, program, event, event.time if first is None else first)
            if event.kind == "final":
                trusted = event.belief is not None and event.belief.is_trusted
                status = 0 if trusted else 3

    if live is not None:
        show([live.ready])
    with contextlib.suppress(KeyboardInterrupt):
        for sample in source:
            if (picked := order.pick(sample)) is None:
                continue
            first = sample.time if first is None else first
            if arguments.seconds is not None and sample.time - first > arguments.seconds:
                break
            late = time.time() - sample.time
            least = min(least, late)
            if recorder is not None and sample.time > newest:
                if sample.time - newest > _GAP:
                    recorder.cut()
                recorder.add(sample.time, *picked)
            newest = max(newest, sample.time)
            if live is None:
                continue
            events = [] if sample.payload is None else live.set_payload(sample.payload.express(X_TF))
            events += live.add(sample.time, *picked, behind=late - least if is_live else 0.0)
            show(events)
        else:
            if live is not None:
                show(live.close())
    if recorder is not None:
        recorder.cut()
        if recorder.num_seen:
            answers.tell(arguments, f"Recorded: {recorder.folder}")
    if first is None:
        order.refuse()
    if first is None or (live is None and recorder is not None and not recorder.num_seen):
        raise BadValueError("the stream", "", "ended without a sample, or without one whose numbers are finite")
    if live is None:
        return 0
    left = f", {live.num_skipped} beliefs skipped because computing took too long" if live.num_skipped else ""
    answers.tell(
        arguments, f"{live.num_samples} samples, {live.num_late} skipped (double, late or without numbers){left}"
    )
    return status


def _print_event(arguments: argparse.Namespace, program: _Program, event: LiveEvent, start: float) -> None:
    content = event.to_dict()
    if event.run is not None and program.recorder is not None:
        content["recorded"] = str(program.recorder.write(event.run))
    belief = event.belief
    setting = belief.setting if event.kind == "final" and belief is not None and belief.is_trusted else None
    if setting is not None and not isinstance(program.flange, str):
        content["payload_settings"] = format_payload(setting.express(program.flange.X_FT), program.flange.name)
    text = json.dumps(to_plain(content)) if arguments.json else describe_event(event, program.flange, start)
    print(show_text(text, PROSE), flush=True)


def _follow_foreign(arguments: argparse.Namespace) -> int:
    """Runs a simulated robot in separate processes, first to record empty runs and then to move a load."""
    name = arguments.demo
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        program = [sys.executable, foreign_robot.__file__, name]
        runs = [folder / f"empty_{k}.csv" for k in (1, 2, 3)]
        _call(program, "--model", folder / f"{name}.xml")
        for k, path in enumerate(runs, start=1):
            _call(program, "--record", path, "--script", _EMPTY_SCRIPT, "--seed", k)
        arguments.robot, arguments.empty = folder / f"{name}.xml", runs
        used = _prepare(arguments)
        with (folder / "truth").open("w", encoding="utf-8") as truth:
            words = [*program, "--script", _SCRIPT]
            with subprocess.Popen(
                words, stdout=subprocess.PIPE, stderr=truth, text=True, encoding="utf-8"
            ) as process:
                assert process.stdout is not None
                status = _use(arguments, used, read_lines(process.stdout, used.robot.joint_names))
                process.terminate()
        for line in (folder / "truth").read_text(encoding="utf-8").splitlines():
            mark = json.loads(line)
            mass = f" of {mark['mass_kg']:.3f} kg" if mark["mark"] == "pick" else ""
            answers.tell(arguments, f"In truth: {mark['mark']}{mass} at {mark['time']:.1f} s.")
    return status


def _call(program: list[str], *words: object) -> None:
    done = subprocess.run([*program, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.splitlines() or [""])[-1]
        raise BadValueError("--demo", "", f"needs a robot that MuJoCo simulates, which ended with: {last}")
