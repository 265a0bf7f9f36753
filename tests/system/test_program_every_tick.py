"""Whole trials of all four simulations with a MathematicalProgram in every control period."""

import pytest

from affordance.control.constrained_qp import AccelerationProgram
from affordance.control.mpc import MinimumAccelerationMpc
from affordance.settings import DEFAULT_SETTINGS
from studies.speed.program_every_tick import BY_PROGRAM, find_difference, list_runs

# Duration of holds, [s]: the first second has the largest motion, and in Simulation II an elbow at its limit.
DURATION = 1.0
CONTROL_PERIOD = BY_PROGRAM.control_period


@pytest.fixture
def calls(monkeypatch):
    """Number of calls of each way of planning, by its name."""
    counts = {}

    def count(owner, name):
        method = getattr(owner, name)

        def call_and_count(*arguments, **keywords):
            counts[name] = counts.get(name, 0) + 1
            return method(*arguments, **keywords)

        counts[name] = 0
        monkeypatch.setattr(owner, name, call_and_count)

    count(MinimumAccelerationMpc, "solve_free")
    count(AccelerationProgram, "solve")
    return counts


@pytest.mark.parametrize("name", ["weight", "com", "reach", "hammer"])
def test_trials_are_those_of_the_default(name, calls):
    """Motions agree to 1e-6 rad with the default's, and the setting makes no plan by the closed form."""
    run = dict(list_runs(duration=DURATION, num_tools=1))[name]
    default = run(DEFAULT_SETTINGS)
    calls.update(solve_free=0, solve=0)
    by_program = run(BY_PROGRAM)
    assert find_difference(default, by_program) < 1e-6
    limited = [[record.counts.limited for record in records] for records in (default, by_program)]
    assert limited[0] == limited[1]
    assert any(limited[0]) is (name == "com")

    assert calls["solve_free"] == 0
    periods = sum(round(record.times[-1] / CONTROL_PERIOD) for record in by_program)
    # Periods of a blow in which no plan is asked for are left out.
    assert (0.8 if name == "hammer" else 1.0) * periods <= calls["solve"] <= periods + len(by_program)
