"""Free parameters: which there are, their priors, and values that are set by observer."""

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.belief.kinds_learner import Kinds
from affordance.belief.learner_file import load_learner
from affordance.belief.learners import DENSITY, KINDS_DRAWN
from affordance.extensions.people.free_parameters import list_free, set_values
from affordance.extensions.people.participant import Participant
from affordance.extensions.people.rivals import OWN_AND_SHARED

PUSHES = Participant(push_error=0.2)


@pytest.mark.parametrize(
    ("learner", "names"),
    [
        (DENSITY, ["push_error"]),
        (KINDS_DRAWN, ["push_error", "kappa"]),
        (OWN_AND_SHARED, ["push_error", "own_rate", "shared_rate"]),
        (load_learner("examples/forgetting.py:Forgetting"), ["push_error", "drift"]),
    ],
)
def test_what_is_fitted_unless_it_is_said(learner, names):
    assert [each.name for each in list_free(learner, Participant())] == names


def test_medians_and_spreads_of_priors():
    z = np.array([0.0, 1.0])
    by_name = {each.name: each.convert(z) for each in list_free(KINDS_DRAWN, PUSHES, ["kappa", "own_drift", "lapse"])}
    np.testing.assert_allclose(by_name["kappa"], KINDS_DRAWN.parameters.kappa * np.exp([0.0, 0.5]))
    np.testing.assert_allclose(by_name["own_drift"], 0.07 * np.exp([0.0, 0.5]))
    odds = by_name["lapse"] / (1.0 - by_name["lapse"])
    np.testing.assert_allclose(odds, 0.05 / 0.95 * np.exp([0.0, 1.0]))
    (rate, _) = list_free(OWN_AND_SHARED, PUSHES, ["own_rate", "shared_rate"])
    assert rate.convert(np.array([0.0]))[0] == pytest.approx(0.3)
    assert (rate.convert(np.array([-60.0, 60.0])) <= 1.0).all()
    (error,) = list_free(DENSITY, PUSHES, ["push_error"])
    assert error.convert(np.array([9.0]))[0] == 1.0


def test_values_are_set_by_observer_and_all_else_is_kept():
    learner, participant = Kinds("drawn", spread=3.0), Participant(push_error=0.2, gain=1.1)
    free = list_free(learner, participant, ["kappa", "lapse"])
    own, pushed = set_values(learner, participant, free, np.array([[0.2, 0.1], [0.3, 0.05]]))
    assert own.parameters.kappa == (0.2, 0.3)
    assert own.parameters.spread == 3.0
    assert (pushed.push_error, pushed.gain, pushed.lapse) == (0.2, 1.1, (0.1, 0.05))


def test_too_many_parameters_are_refused():
    names = ["push_error", "gain", "lapse", "kappa", "concentration", "switching", "own_drift", "spread"]
    assert len(list_free(KINDS_DRAWN, PUSHES, names)) == 8
    assert "has gain twice" in refuse(list_free, KINDS_DRAWN, PUSHES, ["gain", "gain"])
