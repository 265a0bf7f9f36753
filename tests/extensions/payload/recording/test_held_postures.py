import re

import numpy as np
import pytest
from helpers.held_postures import draw_postures, write_table
from helpers.refusals import refuse

from affordance.extensions.payload.recording.held_postures import gather_postures, looks_held
from affordance.extensions.payload.recording.run_file import read_run

_Q = draw_postures(6, np.random.default_rng(0))
_SIGNAL = np.random.default_rng(1).standard_normal((6, 6))


def test_rows_of_a_stay_are_averaged_and_passages_are_left_out():
    passage = np.linspace(_Q[0], _Q[1], 10)[1:-1]
    q = np.concatenate([np.repeat(_Q[:1], 50, axis=0), passage, np.repeat(_Q[1:2], 30, axis=0)])
    values = np.arange(len(q), dtype=float)[:, None]
    held = gather_postures(q, values)
    assert held.values.ravel() == pytest.approx([24.5, 72.5])
    assert held.first.tolist() == [0, 58]
    assert held.num_moving == 8


def test_a_table_without_time_holds_postures_if_rows_are_far_apart():
    smooth = np.linspace(_Q[0], _Q[1], 100)
    assert looks_held(_Q)
    assert not looks_held(smooth)
    assert not looks_held(_Q[:3])


@pytest.mark.parametrize("is_wrench", [False, True])
def test_a_table_of_postures_needs_no_time(tmp_path, is_wrench):
    run = read_run(write_table(tmp_path / "run.csv", _Q, _SIGNAL, is_wrench=is_wrench))
    assert run.description.postures
    assert run.q == pytest.approx(_Q, abs=1e-6)
    assert run.signal == pytest.approx(_SIGNAL, abs=1e-6)
    assert "6 postures" in repr(run)


def test_a_recording_of_stays_is_read_as_postures_if_it_says_so(tmp_path):
    q, signal = np.repeat(_Q, 40, axis=0), np.repeat(_SIGNAL, 40, axis=0)
    time = 0.02 * np.arange(len(q))
    path = write_table(tmp_path / "run.csv", q, signal, is_wrench=True, time=time, more="postures: true\n")
    run = read_run(path)
    assert len(run.q) == 6
    assert run.rows is not None
    assert run.rows.tolist() == [2 + 40 * i for i in range(6)]
    assert run.notes == ("240 rows show 6 postures",)


@pytest.mark.parametrize(
    ("q", "more", "said"),
    [
        (
            np.linspace(_Q[0], _Q[1], 60),
            "",
            "column time: is missing: .*needs none if the description has 'postures: true'",
        ),
        (_Q, "postures: false\n", "column time: is missing"),
        (_Q[:3], "postures: true\n", "has 3 postures, must have at least 4"),
    ],
)
def test_a_table_without_time_that_holds_no_postures_is_refused(tmp_path, q, more, said):
    signal = np.resize(_SIGNAL, (len(q), 6))
    path = write_table(tmp_path / "run.csv", q, signal, is_wrench=True, more=more)
    assert re.search(said, refuse(read_run, path))
