"""Reads ``sensor_msgs/JointState`` over DDS, without ROS: ``pip install cyclonedds``.

There is a reader but no writer, so no command can be sent. The reader's quality of service is best-effort, which is
compatible with every writer. All samples are kept until they are read.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, uint32
from cyclonedds.idl.types import sequence as list_of
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from affordance.extensions.payload.live.samples import Sample

_TAKEN, _WAIT = 200, 200  # samples read at once, and time between checks if reading must end, [ms]


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


def read_ros2(topic: str, domain: int, silence: float = float("inf")) -> Iterator[Sample]:
    """Reads joint states from a topic until no sample arrives for some time.

    Args:
        topic: Name of the ROS topic, such as /joint_states.
        domain: Number of the DDS domain, ROS_DOMAIN_ID.
        silence: Time without a sample after which reading ends, [s].
    """
    participant: Any = DomainParticipant(domain)
    keep = Qos(Policy.History.KeepAll, Policy.Reliability.BestEffort)
    name = "rt/" + topic.lstrip("/")  # DDS topics of ROS have this prefix
    reader: Any = DataReader(participant, Topic(participant, name, _JointState), qos=keep)
    waiting = WaitSet(participant)
    waiting.attach(ReadCondition(reader, SampleState.Any | ViewState.Any | InstanceState.Any))
    newest = time.monotonic()
    while time.monotonic() - newest < silence:
        waiting.wait(duration(milliseconds=_WAIT))
        for message in reader.take(N=_TAKEN):
            if not hasattr(message, "header"):  # a notice that a writer left is not a sample
                continue
            newest = time.monotonic()
            stamp = message.header.stamp
            names, v = list(message.name), message.velocity or None
            yield Sample(stamp.sec + 1e-9 * stamp.nanosec, names, message.position, v, message.effort)
