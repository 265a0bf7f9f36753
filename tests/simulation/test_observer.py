"""One observer and several objects: learning of the memory, and separation of presentations in one Context."""

import dataclasses

import numpy as np
import pytest
from helpers.seen_objects import know

from affordance.belief.material_memory import MaterialMemory
from affordance.experiments import com
from affordance.experiments.shared.observers import Setup
from affordance.proprioception.faults import Faults
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.simulation.trial import Observer, TrialRunner
from affordance.vision.features import ComponentFeatures

DURATION = 0.5
FIRST, SECOND, DECOY = com.read(Setup())
BEECH, STEEL = (part.looks_like.colour for part in FIRST.components[1:])


def list_numbers(value):
    """All numbers of a record and of the memory in it, in one order."""
    if isinstance(value, MaterialMemory):
        return [*value.colours, *list_numbers(value.belief.precision), *list_numbers(value.belief.information_vector)]
    if isinstance(value, ComponentFeatures):
        return list_numbers((value.colour, *value.shape.sizes, value.X_TE))
    if isinstance(value, tuple):
        return [number for each in value for number in list_numbers(each)]
    return np.ravel(value).tolist()


def test_memory_changes_by_the_forced_event_at_the_end_and_by_nothing_else(runner, weight):
    before = MaterialMemory().add_colours(weight.colours, weight.settings.prior)
    tool, trial = weight.tools[2], runner.get_diagram()
    simulator = trial.prepare(trial.diagram.CreateDefaultContext(), tool, trial.hold, before, (0,))
    context = simulator.get_mutable_context()
    for time in (0.05, 0.1, 0.25, 0.4, DURATION):
        simulator.AdvanceTo(time)
        assert trial.get_memory(context) is before
    simulator.AdvancePendingEvents()
    assert trial.get_memory(context) is before
    trial.diagram.ExecuteForcedEvents(context, publish=False)
    after = trial.get_memory(context)
    assert after.colours == before.colours
    assert after.belief.precision[0, 0] > 2.0 * before.belief.precision[0, 0]
    expected = runner.run_hold(tool, before, duration=DURATION, seed=(0,)).memory
    assert list_numbers(after) == list_numbers(expected)
    simulator.AdvanceTo(1.9 * DURATION)
    assert trial.get_memory(context) is after


@pytest.mark.parametrize("duration", [0.3, 0.7, 1.1, 3.0])
def test_last_sample_and_last_row_belong_to_a_presentation_whatever_rounding_does(runner, weight, duration):
    """Drake's time of the last sample, 0.1 + 29 x 0.1, is after the end, 3 s."""
    record = runner.run_hold(weight.tools[0], MaterialMemory(), duration=duration, seed=(0,))
    assert record.samples.accepted == round(duration / weight.settings.sample_period)
    assert record.times[-1] == pytest.approx(duration, abs=1e-9)
    assert len(record.times) == round(duration / weight.settings.log_period) + 1


def test_every_presentation_adds_what_it_taught_alone(weight):
    """Equal presentations add equal information, with white noise and an object that weighs what is believed.

    The object does not deviate from its material, as later presentations would add less otherwise.
    """
    prior = dataclasses.replace(weight.settings.prior, deviation=0.0)
    settings = dataclasses.replace(weight.settings, noise=WhiteNoise(1.0), prior=prior)
    tool = weight.tools[0]
    observer = Observer(TrialRunner(settings), know(weight), duration=DURATION)
    told = [0.0]
    for number in range(4):
        observer.hold(tool, (number,))
        state = observer.memory.state
        told.append(float((state["hold_weight"][..., None, None] * state["hold_regressor"] ** 2).sum()))
    gains = np.diff(told)
    assert gains[0] > 0.0
    np.testing.assert_allclose(gains, gains[0], rtol=1e-5)  # the arm moves a little by what was learned before


@pytest.mark.parametrize("faults", [Faults(), Faults(delay_samples=2, drop_probability=0.3, bias_sd=1.0)])
def test_presentations_in_one_context_are_separate_trials_with_the_memory_handed_on(weight, faults):
    """Records, which stay as they are when the next object is held, are those of separate trials to the last bit."""
    runner = TrialRunner(dataclasses.replace(weight.settings, faults=faults))
    tools = (FIRST, DECOY, SECOND, FIRST)
    observer = Observer(runner, MaterialMemory(), duration=DURATION)
    records = [observer.hold(tool, (7, number)) for number, tool in enumerate(tools)]
    memory = MaterialMemory()
    for number, (tool, record) in enumerate(zip(tools, records, strict=True)):
        alone = runner.run_hold(tool, memory, duration=DURATION, seed=(7, number))
        assert list_numbers(record) == list_numbers(alone)
        memory = alone.memory
    assert list_numbers(observer.memory) == list_numbers(memory)
    assert np.abs(record.q - record.q[0]).max() > 0.0


def test_two_observers_of_one_runner_do_not_disturb_each_other(runner):
    one, other = (Observer(runner, MaterialMemory(), duration=0.2) for _ in range(2))
    records = [one.hold(FIRST, (1,)), other.hold(SECOND, (2,)), one.hold(SECOND, (3,)), other.hold(FIRST, (4,))]
    again = Observer(runner, MaterialMemory(), duration=0.2)
    assert list_numbers(again.hold(FIRST, (1,))) == list_numbers(records[0])
    assert list_numbers(again.hold(SECOND, (3,))) == list_numbers(records[2])


def test_only_colours_that_are_to_be_remembered_are(runner, weight):
    """A material that is not to be remembered is forgotten, but its evidence about the others is kept."""
    known = MaterialMemory().add_colours([BEECH], weight.settings.prior)
    every, some = (Observer(runner, known, duration=0.2, remembered=remembered) for remembered in ((), (BEECH,)))
    for observer in (every, some):
        observer.hold(FIRST, (1,))
    assert every.memory.colours == (BEECH, STEEL)
    assert some.memory.colours == (BEECH,)
    belief = every.memory.belief
    assert some.memory.belief.untruncated_mean[0] == pytest.approx(belief.untruncated_mean[0], rel=1e-9)
    assert some.memory.belief.covariance[0, 0] == pytest.approx(belief.covariance[0, 0], rel=1e-9)


def test_hold_without_shapes_is_that_with_shapes(runner, weight):
    """A hold is the same to the last bit with and without shapes, as nothing touches anything at home."""
    for tool in (weight.tools[0], weight.tools[-1], SECOND):
        memory = MaterialMemory()
        without = runner.run_hold(tool, memory, duration=DURATION, seed=(3,))
        with_shapes = runner.run(tool, runner.get_diagram(tool).hold, memory, duration=DURATION, seed=(3,))
        assert np.abs(without.height_centre).max() > 0.01
        assert list_numbers(without) == list_numbers(with_shapes)
