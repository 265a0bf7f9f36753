"""What a recorder writes is what read_run reads."""

import numpy as np
import pytest
from helpers.live_streams import list_rows, record_loads

from affordance import read_run
from affordance.extensions.payload.live.recorder import Recorder, describe
from affordance.extensions.payload.settings import SignalKind


@pytest.mark.parametrize("has_v", [True, False])
def test_tables_are_read_back_exactly(robot, tmp_path, has_v):
    run = record_loads(robot, np.random.default_rng(1), [(2.0, None)])
    recorder = Recorder(tmp_path / "seen", describe(None, robot.joint_names, SignalKind.JOINT_TORQUE, "flange"))
    rows = list_rows(run, has_v)
    for row in rows[:120]:
        recorder.add(*row)
    recorder.cut()
    t, q, v, signal = rows[120]
    recorder.add(t, q, v, np.nan * signal)  # no reader takes it, so it is left out
    for row in rows[120:]:
        recorder.add(*row)
    recorder.cut()
    first, second = (read_run(tmp_path / "seen" / f"seen_{k}.csv") for k in (1, 2))
    assert np.array_equal(np.concatenate([first.signal, second.signal]), run.signal)
    assert np.array_equal(second.times, run.times[120:])
    assert (first.v is not None) == has_v
    assert first.description.joint_names == robot.joint_names
    again = read_run(recorder.write(run))
    assert np.array_equal(again.v, run.v)


def test_what_an_empty_run_says_of_the_signal_is_kept(robot, tmp_path):
    file = tmp_path / "empty.yaml"
    file.write_text("joints: [x]\nsignal: current\nbase: link0\ncompensates: arm\nunits: {time: ms}\nskip_rows: 2\n")
    found = describe(file, robot.joint_names, SignalKind.CURRENT, "flange")
    assert found == {
        "joints": list(robot.joint_names),
        "signal": "current",
        "tip": "flange",
        "base": "link0",
        "compensates": "arm",
    }
