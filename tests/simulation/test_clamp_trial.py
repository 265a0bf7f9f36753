import numpy as np
import pytest

from affordance.belief.kind_memory import start_memory
from affordance.belief.learner import Learner
from affordance.belief.material_memory import MaterialMemory
from affordance.control.hold import ClampAndRelease
from affordance.experiments import linear_plus_plus
from affordance.experiments.observers import Setup
from affordance.plant.clamp import STIFFNESS
from affordance.simulation.clamp_trial import CLAMPED, run_clamp_and_release
from affordance.simulation.trial import TrialRunner

GRAVITY = 9.81


@pytest.fixture(scope="module")
def lifted():
    """The test object of Linear++, twice: held at its middle, it is a load without a moment."""
    return linear_plus_plus.read(Setup())[-1]


def believe(tool, density):
    (part,) = tool.components
    return MaterialMemory.from_densities({part.looks_like.colour: density})


@pytest.mark.parametrize(
    ("held", "believed"), [("middle", 300.0), ("middle", 1500.0), ("middle", 2500.0), ("end", 4000.0)]
)
def test_force_in_closed_form_agrees_with_the_simulation(runner, lifted, weight, held, believed):
    """The clamp's force is the believed weight to 0.1 %, also where the object's moment turns the hand."""
    tool = lifted if held == "middle" else weight.tools[3]
    _, clamp = run_clamp_and_release(runner, tool, believe(tool, believed), duration=0.1, seed=(0,))
    mass = tool.mass * believed / tool.components[0].material.density
    assert clamp.force == pytest.approx(GRAVITY * mass, rel=1e-3)


def test_after_release_the_hand_sinks_rises_or_stays_as_the_object_was_believed(runner, lifted):
    density = lifted.components[0].material.density
    excursions = {}
    for factor in (0.6, 1.0, 1.4):
        record, clamp = run_clamp_and_release(
            runner, lifted, believe(lifted, factor * density), duration=1.0, seed=(0,)
        )
        assert record.times[-1] == pytest.approx(CLAMPED + 1.0)
        excursions[factor] = clamp.excursion
    assert excursions[0.6] < -0.02
    assert excursions[1.4] > 0.01
    spring = GRAVITY * lifted.mass / STIFFNESS  # what the clamp gave way under the right force
    assert excursions[1.0] == pytest.approx(-spring, rel=0.03)


def test_only_what_is_felt_after_release_is_learned_from(runner, lifted):
    """Samples count from release on, as before it the arm feels its own push."""
    memory = start_memory(Learner.KINDS_MAP, (0,))
    record, _ = run_clamp_and_release(runner, lifted, memory, duration=1.0, seed=(0, 1))
    period = runner.settings.sample_period
    assert record.samples.accepted in (round(1.0 / period), round(1.0 / period) + 1)
    assert record.samples.rejected == 0
    assert record.memory.belief.untruncated_mean[0] == pytest.approx(2500.0, rel=0.25)
    assert record.memory.kinds.objects[0].memberships[0].num_lifts == 1


def test_an_open_clamp_changes_no_hold(lifted, weight):
    """A hold with an open clamp is the same to the last bit as one without."""
    records = []
    for has_clamp in (False, True):
        runner = TrialRunner(weight.settings)
        trial = runner.get_diagram(0.2, has_clamp=has_clamp)
        simulator = runner.prepare(trial, lifted, trial.hold, believe(lifted, 1500.0), (0,))
        simulator.AdvanceTo(0.2)
        state = trial.arm.plant.GetMyContextFromRoot(simulator.get_context())
        records.append(trial.arm.plant.GetPositionsAndVelocities(state))
    np.testing.assert_array_equal(*records)


def test_task_corrects_nothing_until_release(model):
    task = ClampAndRelease(model.arm.home, release_time=1.0)
    x = np.concatenate([model.arm.home + 0.1, np.zeros(7)])
    before = task.compute_goal(model, x, 0.995, 0.24)
    after = task.compute_goal(model, x, 1.0 - 1e-13, 0.24)
    np.testing.assert_array_equal(before.d_q, x[:7])
    np.testing.assert_array_equal(after.d_q, model.arm.home)
    assert before.C_q is after.C_q
    assert task.choose_horizon(0.5, 0.24) == 0.24
