import re

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.settings import SignalKind

_NAMES = ("panda_joint1", "panda_joint2")


def _build(kind: SignalKind = SignalKind.JOINT_TORQUE, **changes: np.ndarray) -> Run:
    values = {"times": _TIMES, "q": _ZEROS, "signal": _ZEROS, "v": _ZEROS}
    return Run("run.csv", RunDescription(_NAMES, kind), **{**values, **changes})


def _spoil(values: np.ndarray, row: int, column: int, value: float) -> np.ndarray:
    spoilt = values.copy()
    spoilt[row, column] = value
    return spoilt


def _spoil_time(row: int, value: float) -> np.ndarray:
    return np.where(np.arange(50) == row, value, _TIMES)


def test_lists_of_numbers_are_tables_too() -> None:
    run = _build(times=_TIMES.tolist(), q=_ZEROS.tolist(), signal=_ZEROS.tolist(), v=None)
    assert (run.times.shape, run.q.shape, run.signal.shape) == ((50,), (50, 2), (50, 2))


@pytest.mark.parametrize("name", ["q", "signal"])
def test_a_table_that_is_missing_is_refused(name: str) -> None:
    assert "has shape (), must be (50, 2)" in refuse(_build, **{name: None})


_TIMES = np.arange(50) * 0.01
_ZEROS = np.zeros((50, 2))
# One joint swings, the other hardly moves.
_PHASE = 2.0 * np.pi * _TIMES
_SWING = np.column_stack([1e-4 * np.sin(_PHASE), 0.06 * np.sin(_PHASE)])
_SWING_RATE = 2.0 * np.pi * np.column_stack([1e-4 * np.cos(_PHASE), 0.06 * np.cos(_PHASE)])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"q": _spoil(_ZEROS, 3, 0, 90.0)}, r"row 4, column q_1: is 90, must be from -12.57 .*degrees"),
        (
            {"v": _spoil(_ZEROS, 3, 0, -180.0)},
            "row 4, column v_1: is -180, .* are these degrees per second.*units: {v: deg/s}",
        ),
        ({"signal": _spoil(_ZEROS, 9, 0, np.nan)}, "row 10, column tau_1: is nan, must be a finite number"),
        ({"q": _spoil(_ZEROS, 0, 1, np.inf)}, "row 1, column q_2: is inf, must be a finite number"),
        ({"times": _spoil_time(20, 0.05)}, r"row 21, column time: is 0.050000, must be more than 0.190000"),
        ({"times": _spoil_time(4, np.nan)}, r"row 5, column time: is nan, must be a finite number of seconds"),
        (
            {"times": 1e3 * _TIMES},
            r"column time: advances by 10 s per row, .* from 1e-05 to 0.5; .*'units: {time: ms}'",
        ),
        ({"times": 1e-6 * _TIMES}, r"advances by 1e-08 s per row, .*; is the unit of time a thousand times longer"),
        (
            {"times": 500.0 * _TIMES, "q": np.random.default_rng(0).uniform(-2.0, 2.0, (50, 2))},
            r"advances by 5 s per row, .*; of held postures, 'postures: true'",
        ),
        (
            {"q": _SWING, "v": _SWING_RATE, "vdot": -57.3 * (2.0 * np.pi) ** 2 * _SWING},
            r"column vdot_2: is 57.3 times the rate of v_2, must be",
        ),
        ({"q": _SWING}, r"column v_2: is 0 times the rate of q_2, must be from 0.2 to 5 times$"),
        ({"q": np.zeros((50, 3))}, r"q: has shape \(50, 3\), must be \(50, 2\)"),
        ({"signal": np.zeros((50, 6))}, r"tau: has shape \(50, 6\)"),
    ],
)
def test_what_cannot_be_is_named_by_row_column_value_and_bound(changes, message):
    said = refuse(_build, **changes)
    assert re.search(message, said)
    assert said.startswith("run.csv: ")


def test_a_run_of_few_samples_is_refused():
    few = refuse(_build, times=_TIMES[:5], q=_ZEROS[:5], signal=_ZEROS[:5], v=_ZEROS[:5])
    assert "has 5 samples, must have at least 20" in few


@pytest.mark.parametrize("prefix", ["panda", "fer"])
def test_joints_are_found_by_name_in_any_order_whatever_their_maker_calls_the_arm(prefix):
    q, names = np.arange(100.0).reshape(50, 2) / 100.0, (f"{prefix}_joint2", f"{prefix}_joint1")
    run = _build(q=q).arrange(names)
    np.testing.assert_array_equal(run.q, q[:, ::-1])
    assert run.description.joint_names == names


def test_a_joint_that_is_not_there_is_named_with_the_nearest():
    message = (
        "joints: are panda_joint1, panda_joint2, must include panda_joint3 of the arm; the nearest is panda_joint"
    )
    assert message in refuse(_build().arrange, ("panda_joint1", "panda_joint3"))


def test_currents_up_to_a_hundred_amperes_are_read():
    assert _build(SignalKind.CURRENT, signal=_spoil(_ZEROS, 3, 0, -99.9)).signal.min() == -99.9
    said = refuse(_build, SignalKind.CURRENT, signal=_spoil(_ZEROS, 7, 1, 100.1))
    assert "row 8, column current_2: is 100.1, must be from -100 to 100 A; are these mi" in said


@pytest.mark.parametrize(("factor", "hint"), [(180.0 / np.pi, True), (np.pi / 180.0, False)])
def test_only_rates_that_are_too_large_may_be_degrees(factor, hint):
    said = refuse(_build, q=_SWING, v=factor * _SWING_RATE)
    assert " times the rate of q_2, must be from 0.2 to 5 times" in said
    assert ("are these degrees" in said) == hint


def test_rates_of_joints_that_hardly_move_are_not_judged():
    _build(q=1e-4 * _SWING, v=1e-2 * _SWING_RATE)


def test_part_of_a_run_keeps_its_rows_of_the_file():
    run = _build(rows=np.arange(50) + 2)
    part = run.select(slice(10, 40))
    assert (len(part.times), part.q.shape, part.signal.shape, part.vdot) == (30, (30, 2), (30, 2), None)
    assert part.times[0] == run.times[10]
    assert part.error_at(0, "q_1", "").key == "row 12, column q_1"
    assert repr(part) == "Run(run.csv: 30 samples of 2 joints at 100 Hz, tau)"


def test_a_run_is_recognised_by_copies_that_keep_its_least_sample():
    """Of five copies that each lack another fifth of the rows, four are recognised; runs of other errors are not."""
    rng = np.random.default_rng(0)
    run, other = (_build(signal=rng.standard_normal((50, 2))) for _ in range(2))
    kept = [np.delete(np.arange(50), slice(start, start + 10)) for start in range(0, 50, 10)]
    copies = [_build(times=_TIMES[:40], q=run.q[k], signal=run.signal[k], v=run.v[k]) for k in kept]
    assert [copy.fingerprint == run.fingerprint for copy in copies].count(True) == 4
    assert other.fingerprint not in {run.fingerprint, *(copy.fingerprint for copy in copies)}


def test_runs_that_begin_with_the_same_rest_are_told_apart():
    """Encoders and sensors count in steps, so that samples at rest are the same in all runs."""
    rng = np.random.default_rng(0)
    steps = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
    signals = [np.concatenate([steps.repeat(12, axis=0), rng.standard_normal((2, 2))]) for _ in range(20)]
    q = np.concatenate([np.zeros((48, 2)), _SWING[48:]])
    runs = [_build(q=q, signal=signal, v=None) for signal in signals]
    assert len({run.fingerprint for run in runs}) == len(runs)
