"""Process that publishes the joint states of the foreign robot over DDS, in real time, as a driver of ROS 2 does.

    python foreign_dds.py FOREIGN_ROBOT_FILE TOPIC DOMAIN SCRIPT

It imports nothing of the project. Messages of a gripper are on the same topic. The number of what was sent goes to
standard output.
"""

import importlib.util
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


def main(file: str, topic: str, domain: str, script: str) -> None:
    spec = importlib.util.spec_from_file_location("foreign_robot", file)
    robot = importlib.util.module_from_spec(spec)
    sys.modules["foreign_robot"] = robot
    spec.loader.exec_module(robot)
    samples = [each for each in robot.simulate("fr3", script, seed=40) if isinstance(each, robot.Sample)]
    participant = DomainParticipant(int(domain))
    qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
    writer = DataWriter(participant, Topic(participant, f"rt{topic}", JointState), qos=qos)
    end = time.time() + 60.0
    while not writer.get_matched_subscriptions() and time.time() < end:
        time.sleep(0.05)
    time.sleep(0.5)
    start, names = time.time(), list(robot.ARMS["fr3"].joints)[::-1]
    for i, each in enumerate(samples):
        time.sleep(max(0.0, start + each.time - time.time()))
        now = start + each.time
        header = Header(Time(int(now), int(now % 1 * 1e9)), "")
        values = (list(map(float, x[::-1])) for x in (each.q, each.v, each.signal))
        writer.write(JointState(header, names, *values))
        if i % 10 == 0:
            writer.write(JointState(header, ["finger"], [0.01], [0.0], [0.0]))
    time.sleep(1.0)
    print(len(samples), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
