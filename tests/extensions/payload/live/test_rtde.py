"""Samples of a controller of Universal Robots, and that nothing but questions is sent to it."""

import socket

import numpy as np
from helpers.fake_ur import TYPES, FakeController
from helpers.refusals import refuse

from affordance.extensions.payload.live.rtde import read_rtde
from affordance.extensions.payload.settings import SignalKind

ROWS = np.arange(5 * 23, dtype=float).reshape(5, 23)


def test_samples_come_whole_and_no_input_is_sent():
    controller = FakeController(ROWS)
    samples = list(read_rtde("127.0.0.1", SignalKind.CURRENT, controller.port))
    controller.join()
    assert controller.packages == [86, 79, 83]  # version, outputs, start: no inputs (73) and no values (85)
    assert [sample.time for sample in samples] == list(ROWS[:, 0])
    sample, row = samples[1], ROWS[1]
    assert (list(sample.q), list(sample.v), list(sample.signal)) == (
        list(row[1:7]),
        list(row[7:13]),
        list(row[13:19]),
    )
    assert sample.names[0] == "shoulder_pan_joint"
    assert (sample.payload.mass, list(sample.payload.centre_of_mass)) == (row[19], list(row[20:]))


def test_what_a_controller_lacks_is_named():
    types = {name: kind for name, kind in TYPES.items() if name != "payload_cog"}
    controller = FakeController([], types)
    message = refuse(lambda: list(read_rtde("127.0.0.1", SignalKind.CURRENT, controller.port)))
    controller.join()
    assert "does not offer payload_cog" in message


def test_other_signals_and_nobody_are_refused():
    assert "but the empty runs have joint_torque" in refuse(lambda: list(read_rtde("x", SignalKind.JOINT_TORQUE)))
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    assert "cannot be read" in refuse(lambda: list(read_rtde("127.0.0.1", SignalKind.CURRENT, port)))
