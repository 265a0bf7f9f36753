"""The reader of joint states over real DDS, on the loopback interface alone, writes nothing.

That it loses nothing shows in tests/studies/live, where a robot in another process is followed.
"""

import os
import threading
import time

import numpy as np
import pytest
from helpers.children import PATIENCE

pytest.importorskip("cyclonedds")

LOOPBACK = "<General><Interfaces><NetworkInterface name='lo'/></Interfaces></General>"


@pytest.fixture
def domain(monkeypatch):
    monkeypatch.setenv("CYCLONEDDS_URI", f"<CycloneDDS><Domain>{LOOPBACK}</Domain></CycloneDDS>")
    return int(np.random.default_rng(os.getpid()).integers(20, 200))


def test_the_reader_has_no_writer(domain):
    from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
    from cyclonedds.domain import DomainParticipant

    from affordance.extensions.payload.live.ros2 import read_ros2

    thread = threading.Thread(target=lambda: list(read_ros2("/joint_states", domain, silence=3.0)), daemon=True)
    thread.start()
    time.sleep(1.0)
    participant = DomainParticipant(domain)
    found = []
    for what in (BuiltinTopicDcpsSubscription, BuiltinTopicDcpsPublication):
        reader = BuiltinDataReader(participant, what)
        time.sleep(0.5)
        found.append([each.topic_name for each in reader.take(N=100) if hasattr(each, "topic_name")])
    thread.join(PATIENCE)
    assert "rt/joint_states" in found[0]
    assert found[1] == []
