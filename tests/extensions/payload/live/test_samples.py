"""Joint states from lines and tables: joints by name, in any order, others among them."""

import json

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance import MODELS, read_run
from affordance.extensions.payload.live.samples import JointOrder, Sample, read_lines, replay

JOINTS = ("a", "b")
MESSAGE = {
    "time": 1.5,
    "name": ["finger", "b", "a"],
    "position": [9, 2, 1],
    "velocity": [0, 4, 3],
    "effort": [0, 6, 5],
}


def read(*lines):
    return list(read_lines([each if isinstance(each, str) else json.dumps(each) for each in lines], JOINTS))


def test_joints_are_picked_by_name():
    (sample,) = read(MESSAGE)
    q, v, signal = JointOrder(JOINTS).pick(sample)
    assert (sample.time, list(q), list(v), list(signal)) == (1.5, [1, 2], [3, 4], [5, 6])


def test_velocities_may_be_missing_and_stamps_those_of_ros():
    message = {key: MESSAGE[key] for key in ("name", "position", "effort")}
    stamps = [{"stamp": {"sec": 3, "nanosec": 250_000_000}}, {"stamp": {"secs": 3, "nsecs": 250_000_000}}]
    for sample in read(*({**message, "velocity": [], "header": stamp} for stamp in stamps)):
        assert (sample.time, sample.v) == (3.25, None)


def test_messages_of_other_joints_are_left_out_until_there_are_no_others():
    order, other = JointOrder(JOINTS), Sample(0.0, ["wheel"], [0.0], None, [0.0])
    assert order.pick(other) is None
    with pytest.raises(Exception, match="are wheel, must include a, b"):
        [order.pick(other) for _ in range(1000)]


def test_tables_are_read_with_their_own_and_loggers_names():
    rows = read("time,q_1,q_2,tau_1,tau_2", "0.1,1,2,5,6", "", "0.2,1,2,5,6")
    assert [each.time for each in rows] == [0.1, 0.2]
    assert (rows[0].q, rows[0].v, rows[0].signal) == ([1, 2], None, [5, 6])
    names = [f"actual_{what}_{i}" for what in ("q", "qd", "current") for i in range(2)]
    (row,) = read(",".join(["timestamp", *names]), "0.1,1,2,3,4,5,6")
    assert (row.q, row.v, row.signal) == ([1, 2], [3, 4], [5, 6])


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["hello"], "line 1: is 'hello', must be a joint state"),
        (["{"], "line 1"),
        ([{"time": 1.0}], "position"),
        (["time,q_1,q_2,tau_1,tau_2", "0.1,1,x,5,6"], "line 2"),
        ([{"position": [1, 2]}], "time or header is missing"),
    ],
)
def test_other_lines_are_refused(lines, words):
    assert words in refuse(read, *lines)


def test_too_few_numbers_are_refused():
    sample = Sample(0.0, ["a", "b"], [0.0], None, [0.0, 0.0])
    assert "has 1 numbers, must have 2" in refuse(JointOrder(JOINTS).pick, sample)


def test_recordings_follow_each_other():
    runs = [read_run(MODELS / "demo" / f"{name}.csv") for name in ("empty", "bar_of_oak")]
    samples = list(replay(runs))
    assert len(samples) == 800
    steps = np.diff([each.time for each in samples])
    assert sorted(steps) == pytest.approx([0.02] * 798 + [1.0], abs=1e-9)
