"""Whole trials of all four simulations with a MathematicalProgram in every control period."""

import dataclasses

import numpy as np
import pytest

from affordance.belief.material_memory import MaterialMemory
from affordance.control.constrained_qp import AccelerationProgram
from affordance.control.mpc import MinimumAccelerationMpc
from affordance.experiments import com, hammer, reach, weight
from affordance.experiments.shared.observers import Setup
from affordance.objects.tool import list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.blow import simulate_blow
from affordance.simulation.rollout import roll_out
from affordance.simulation.trial import Observer, get_runner

BY_PROGRAM = dataclasses.replace(DEFAULT_SETTINGS, mpc=dataclasses.replace(DEFAULT_SETTINGS.mpc, always_program=True))
# Duration of holds, [s]: the first second has the largest motion, and in Simulation II an elbow at its limit.
DURATION = 1.0
CONTROL_PERIOD = BY_PROGRAM.control_period


def hold(module, settings):
    """Records of one observer who holds the objects of an experiment one after the other, and learns from each."""
    observer = Observer(get_runner(settings), MaterialMemory(), duration=DURATION)
    return [observer.hold(tool, (0, number)) for number, tool in enumerate(module.read(Setup()))]


def do_task(module, settings):
    """Record of the task with the first novel tool, by its first grip; the blow is planned by default settings."""
    _, (tool, *_), task = module.read(Setup())
    held, densities = next(iter(tool.list_gripped().values())), list_densities([tool])
    if module is reach:
        return [roll_out(held, task, densities, settings).record]
    cost = task.build_cost(ArmModel(load_arm()), held.components, DEFAULT_SETTINGS)
    return [simulate_blow(held, task, cost, densities, settings).record]


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


@pytest.mark.parametrize(
    ("module", "run"),
    [(weight, hold), (com, hold), (reach, do_task), (hammer, do_task)],
    ids=lambda each: each.__name__,
)
def test_trials_are_those_of_the_default(module, run, calls):
    """Motions agree to 1e-6 rad with the default's, and the setting makes no plan by the closed form."""
    default = run(module, DEFAULT_SETTINGS)
    calls.update(solve_free=0, solve=0)
    by_program = run(module, BY_PROGRAM)
    for one, other in zip(default, by_program, strict=True):
        np.testing.assert_allclose(one.q, other.q, rtol=0.0, atol=1e-6)
    limited = [[record.counts.limited for record in records] for records in (default, by_program)]
    assert limited[0] == limited[1]
    assert any(limited[0]) is (module is com)

    assert calls["solve_free"] == 0
    periods = sum(round(record.times[-1] / CONTROL_PERIOD) for record in by_program)
    # Periods of a blow in which no plan is asked for are left out.
    assert (0.8 if module is hammer else 1.0) * periods <= calls["solve"] <= periods + len(by_program)
