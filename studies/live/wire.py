"""Identifies the load of a simulated robot over DDS, on the loopback interface only.

The robot and ``affordance live --ros2`` run in two processes, both in real time.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np

from affordance import LiveEvent, Run
from affordance.exceptions import AffordanceError
from affordance.extensions.payload.evidence.gains import Gains, write_gains
from affordance.extensions.payload.live import foreign_robot
from affordance.extensions.payload.live.foreign_robot import Truth
from affordance.extensions.payload.live.recorder import Recorder, describe
from affordance.extensions.payload.settings import SignalKind

_LOOPBACK = "<General><Interfaces><NetworkInterface name='lo'/></Interfaces></General>"
_TOPIC = "/joint_states"
_NUM_DOMAINS = 100  # their ports are below the system's ephemeral ports
_PATIENCE = 240.0  # timeout of the processes, [s]


class Wired(NamedTuple):
    """Stream that was processed over the wire."""

    events: list[LiveEvent]  # events, with their wall-clock time as ``said``, [s]
    loads: list[Truth]  # true loads, with wall-clock times
    received: int  # number of received samples
    unused: int  # number of these that were repeated, too late or not finite
    left_out: int  # number of beliefs skipped because samples were processed late


def follow(
    arm: str, script: str, seed: int, empty: Sequence[Run], gains: Gains | None, *, seconds: float, number: int
) -> Wired:
    """Identifies the load of a robot over the wire.

    Args:
        arm: Name of the arm.
        script: Script of the robot, longer than the processed part.
        seed: Seed of the arm and of its script.
        empty: Empty runs.
        gains: Gains of motor currents; None for torques.
        seconds: Time from the first to the last processed sample, [s].
        number: Number that determines the DDS domain and must differ between simultaneous streams.

    Raises:
        AffordanceError: A process failed.
    """
    domain = str(1 + (os.getppid() + number) % _NUM_DOMAINS)
    uri = f"<CycloneDDS><Domain>{_LOOPBACK}</Domain></CycloneDDS>"
    env = os.environ | {"ROS_DOMAIN_ID": domain, "CYCLONEDDS_URI": uri, "OMP_NUM_THREADS": "1"}
    publish = [str(Path(__file__).with_name("foreign_dds.py")), foreign_robot.__file__, _TOPIC, domain]
    events = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        words = ["live", *_write(folder, arm, empty, gains), "--ros2", _TOPIC, "--seconds", str(seconds), "--json"]
        with (
            (folder / "remarks").open("w+", encoding="utf-8") as remarks,
            _start(["-m", "affordance", *words], env, remarks) as live,
            _start([*publish, arm, script, str(seed)], env, None) as robot,
        ):
            late = threading.Timer(_PATIENCE, _end, [live, robot])
            late.start()
            try:
                for line in live.stdout or ():
                    content = json.loads(line) | {"said": time.time()}
                    events.append(LiveEvent(content.pop("event"), content.pop("time"), content))
                remarks.seek(0)
                last = (remarks.read().splitlines() or [""])[-1]
                if live.wait() not in (0, 3):  # results that are trusted or not
                    raise AffordanceError(f"affordance live ended with: {last}")
                loads = json.loads(robot.communicate()[0] or "null")
                if loads is None:
                    raise AffordanceError("the foreign robot ended before its script")
            finally:
                late.cancel()
                _end(live, robot)
    received, unused, *left_out = map(int, re.findall(r"\d+", last))
    marks = [Truth(t, mark, mass, np.array(com)) for t, mark, mass, com in loads]
    return Wired(events, marks, received, unused, *(left_out or [0]))


def _write(folder: Path, arm: str, empty: Sequence[Run], gains: Gains | None) -> list[str]:
    """Writes the arm, its empty runs and gains. Returns the command-line arguments that name these files."""
    model = folder / f"{arm}.xml"
    model.write_text(foreign_robot.write_model(arm), encoding="utf-8")
    first = empty[0].description
    recorder = Recorder(folder, describe(None, first.joint_names, SignalKind(first.kind), "flange"))
    words = [str(model), "--empty", *(str(recorder.write(run)) for run in empty)]
    if gains is None:
        return words
    write_gains(folder / "gains.json", gains)
    return [*words, "--gains", str(folder / "gains.json")]


def _start(words: list[str], env: Mapping[str, str], remarks: IO[str] | None) -> subprocess.Popen[str]:
    command = [sys.executable, *words]
    return subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=remarks, text=True, encoding="utf-8")


def _end(*processes: subprocess.Popen[str]) -> None:
    for each in processes:
        each.kill()
