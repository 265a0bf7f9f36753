"""Joint states over real DDS, on the loopback interface alone, from another process; and that nothing is written."""

import json
import os
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from helpers.children import PATIENCE

from affordance.extensions.payload.live import foreign_robot

pytest.importorskip("cyclonedds")
pytest.importorskip("mujoco")

LOOPBACK = "<General><Interfaces><NetworkInterface name='lo'/></Interfaces></General>"
HELPER = Path(__file__).parents[3] / "helpers" / "foreign_dds.py"


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


def test_a_robot_in_another_process_is_followed_and_no_sample_is_lost(domain, children, tmp_path, monkeypatch):
    (tmp_path / "fr3.xml").write_text(foreign_robot.write_model("fr3"))
    robot = [sys.executable, foreign_robot.__file__, "fr3"]
    empty = [tmp_path / f"empty_{k}.csv" for k in (1, 2, 3)]
    for k, path in enumerate(empty, start=1):
        words = [*robot, "--record", str(path), "--script", "move 12", "--seed", str(k)]
        assert children(words).wait(PATIENCE) == 0
    words = [sys.executable, "-m", "affordance", "live", str(tmp_path / "fr3.xml"), "--empty", *map(str, empty)]
    words += ["--ros2", "/joint_states", "--seconds", "8", "--json"]
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    live = children(words)
    assert json.loads(live.stdout.readline())["event"] == "ready"
    script = "hold 1.5, move 8.5"
    sent = children([sys.executable, str(HELPER), foreign_robot.__file__, "/joint_states", str(domain), script])
    out, err = live.communicate(timeout=PATIENCE)
    assert sent.communicate(timeout=PATIENCE)[0].strip() == "2125"
    events = [json.loads(line) for line in out.splitlines()]
    beliefs = [each for each in events if each["event"] == "belief"]
    low, high = beliefs[-1]["mass_interval90"]
    assert low < 1.5 < high
    assert beliefs[-1]["holds"] == "something"
    assert "2001 samples, 0 of them double" in err or "2000 samples, 0 of them double" in err
