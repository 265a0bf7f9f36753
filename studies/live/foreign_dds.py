"""Publishes the joint states of the simulated robot over DDS in real time, like a ROS 2 driver.

    python foreign_dds.py FOREIGN_ROBOT_FILE TOPIC DOMAIN ARM SCRIPT SEED

This file imports nothing from the project and runs in a separate process. Messages of a gripper are on the same
topic. The true loads are written to standard output as JSON: wall-clock time, mark, mass and centre of mass.
"""

import importlib
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, uint32
from cyclonedds.idl.types import sequence as list_of
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

_PATIENCE = 120.0  # time to wait for a reader, [s]


# The message types follow ROS's definitions and are not shared with the reader, so that wrong fields in the reader
# are detected.
@dataclass
class _Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class _Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: _Time
    frame_id: str


@dataclass
class _JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: _Header
    name: list_of[str]  # type: ignore[type-arg]
    position: list_of[float64]  # type: ignore[type-arg]
    velocity: list_of[float64]  # type: ignore[type-arg]
    effort: list_of[float64]  # type: ignore[type-arg]


def main(file: str, topic: str, domain: str, arm: str, script: str, seed: str) -> None:
    """Simulates the robot, waits for a reader, and publishes the samples."""
    sys.path.append(str(Path(file).parent))
    robot = importlib.import_module(Path(file).stem)
    stream = list(robot.simulate(arm, script, int(seed), arm_seed=int(seed)))
    samples = [each for each in stream if isinstance(each, robot.Sample)]
    participant: Any = DomainParticipant(int(domain))
    qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
    writer: Any = DataWriter(participant, Topic(participant, f"rt{topic}", _JointState), qos=qos)
    end = time.time() + _PATIENCE
    while not writer.get_matched_subscriptions():
        if time.time() > end:
            sys.exit(f"{topic} has no reader in domain {domain}")
        time.sleep(0.05)
    time.sleep(0.5)
    start, names, message = time.time(), list(robot.ARMS[arm].joints)[::-1], cast("Any", _JointState)
    for i, each in enumerate(samples):
        time.sleep(max(0.0, start + each.time - time.time()))
        stamp = round(1e9 * (start + each.time))
        header = _Header(_Time(stamp // 1_000_000_000, stamp % 1_000_000_000), "")
        writer.write(message(header, names, *(list(map(float, x[::-1])) for x in (each.q, each.v, each.signal))))
        if i % 10 == 0:
            writer.write(message(header, ["finger"], [0.01], [0.0], [0.0]))
    time.sleep(1.0)
    loads = [each for each in stream if isinstance(each, robot.Truth)]
    print(json.dumps([(start + each.time, each.mark, each.mass, each.com.tolist()) for each in loads]), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
