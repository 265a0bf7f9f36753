"""Nothing remembered, own memory, own and shared memory: against Bayes' rule and delta rules written out by hand."""

import numpy as np
import pytest

from affordance.belief.holds import Felt
from affordance.belief.learner import Seen
from affordance.belief.learners import LEARNERS, list_learners
from affordance.belief.prior import Prior
from affordance.commands.catalogue import find_learner
from affordance.extensions.people.rivals import NOTHING_REMEMBERED, OWN_AND_SHARED, OWN_MEMORY, RIVALS, label_learner

PRIOR = Prior(mode=1000.0, sd=4000.0)


def start(learner, size=2, num_colours=2):
    return learner.start(None, learner.parameters, PRIOR, num_colours, size)


def feel(rho, *colours, sd=1.0):
    """Measurements of the densities of one object of two observers, of one density unless its colours are given."""
    m = len(colours) or 1
    return Felt.from_torques(np.broadcast_to(rho, (2, m)), np.zeros(m), np.tile(np.eye(m), (2, 1, 1)), (sd, 0.0))


def see(thing, *colours, size=2):
    return Seen(colours or (0,), np.full(size, thing))


def test_own_memory_is_bayes_rule_for_each_object_alone():
    state = start(OWN_MEMORY)
    for rho in (3000.0, 3400.0):
        state = OWN_MEMORY.learn(state, see(1), feel(rho, sd=500.0), None).state
    precision = PRIOR.sd**-2 + 2.0 / 500.0**2
    mean = (PRIOR.mode / PRIOR.sd**2 + 6400.0 / 500.0**2) / precision
    known = OWN_MEMORY.expect(state, see(1))
    np.testing.assert_allclose(known.mean, [[mean]] * 2)
    np.testing.assert_allclose(known.covariance, [[[1.0 / precision]]] * 2)
    new = OWN_MEMORY.expect(state, see(0))
    np.testing.assert_allclose((new.mean[0, 0], new.covariance[0, 0, 0]), (PRIOR.mode, PRIOR.sd**2))
    np.testing.assert_allclose(OWN_MEMORY.believe(state).mean, PRIOR.mode)


def test_nothing_remembered_feels_each_lift_and_forgets_it():
    """What is felt is Bayes' rule from the prior, in the second lift of an object as in its first."""
    state = start(NOTHING_REMEMBERED)
    precision = PRIOR.sd**-2 + 1.0 / 500.0**2
    mean = (PRIOR.mode / PRIOR.sd**2 + 3000.0 / 500.0**2) / precision
    for _ in range(2):
        lesson = NOTHING_REMEMBERED.learn(state, see(1), feel(3000.0, sd=500.0), None)
        np.testing.assert_allclose(lesson.densities.mean, [[mean]] * 2)
        state = lesson.state
    for seen in (see(0), see(1)):
        expected = NOTHING_REMEMBERED.expect(state, seen)
        np.testing.assert_allclose((expected.mean[0, 0], expected.covariance[0, 0, 0]), (PRIOR.mode, PRIOR.sd**2))
    np.testing.assert_allclose(NOTHING_REMEMBERED.believe(state).mean, PRIOR.mode)


def test_own_and_shared_are_two_delta_rules():
    learner = OWN_AND_SHARED.change(own_rate=0.3, shared_rate=0.1)
    state = start(learner)
    shared, own = 1000.0, {0: 0.0, 1: 0.0}
    for thing, rho in ((0, 2000.0), (1, 3000.0), (0, 2000.0)):
        state = learner.learn(state, see(thing), feel(rho), None).state
        error = rho - shared - own[thing]
        shared, own[thing] = shared + 0.1 * error, own[thing] + 0.3 * error
    np.testing.assert_allclose(learner.believe(state).mean, [[shared, 1000.0]] * 2, rtol=1e-6)
    assert (learner.believe(state).covariance <= np.eye(2)).all()
    for thing, value in own.items():
        np.testing.assert_allclose(learner.expect(state, see(thing)).mean, shared + value, rtol=1e-6)
    np.testing.assert_allclose(learner.expect(state, see(5)).mean, shared, rtol=1e-6)


@pytest.mark.parametrize("learner", RIVALS.values(), ids=RIVALS)
def test_colours_are_met_and_selected(learner):
    """A thing of two colours keeps its densities where a third colour is met and others are left out."""
    state = learner.learn(start(learner), see(0, 0, 1), feel([2000.0, 5000.0], 0, 1), None).state
    before = learner.expect(state, see(0, 0, 1)).mean
    assert learner.meet(state, np.array([0.1, 0.8, 0.1]))[1] == 1
    met, index = learner.meet(state, np.array([0.1, 0.1, 0.8]))
    assert index == 2
    np.testing.assert_allclose(learner.believe(met).mean[:, 2], PRIOR.mode)
    kept = learner.select(met, [1, 0, 2], [0])
    np.testing.assert_allclose(learner.believe(kept).mean, learner.believe(met).mean[:, [1, 0, 2]])
    if learner is not NOTHING_REMEMBERED:
        assert kept[next(iter({*kept} & {"own", "hold_count"}))].shape[1] == 1
    np.testing.assert_allclose(learner.expect(met, see(0, 0, 1)).mean, before)


def test_rivals_are_found_by_name_and_simulated_only_where_they_are_named():
    assert [find_learner(name) for name in RIVALS] == [NOTHING_REMEMBERED, OWN_MEMORY, OWN_AND_SHARED]
    assert label_learner("own_memory") == "own memory of each object"
    assert not {*RIVALS} & {*LEARNERS}
    assert list_learners(LEARNERS["density"]) == [*LEARNERS.values()]
