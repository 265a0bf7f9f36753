"""Selection of learners: against integrals over the frequency of one of two learners."""

import numpy as np
import pytest

from affordance.extensions.people.selection import select_learners

LOG_EVIDENCE = np.array([[0.0, -5.0], [0.0, -6.0], [0.0, -4.0], [0.0, -5.0], [-3.0, 0.0]]) - 200.0


def test_frequencies_of_two_learners_are_those_of_an_integral():
    r = np.linspace(0.0, 1.0, 20_001)[1:-1, None]
    one, other = np.exp(LOG_EVIDENCE + 200.0).T
    mixed = r * one + (1.0 - r) * other
    p = mixed.prod(axis=1)
    found = select_learners(LOG_EVIDENCE)
    assert found.frequencies[0] == pytest.approx((p * r[:, 0]).sum() / p.sum(), abs=0.005)
    assert found.exceedance[0] == pytest.approx(p[r[:, 0] > 0.5].sum() / p.sum(), abs=0.005)
    people = ((r * one / mixed) * p[:, None]).sum(axis=0) / p.sum()
    np.testing.assert_allclose(found.people[:, 0], people, atol=0.005)
    evidence = np.array([p.mean(), ((one + other) / 2.0).prod()])
    assert found.equal == pytest.approx(evidence[1] / evidence.sum(), abs=0.01)
    expected = (1.0 - found.equal) * found.exceedance + found.equal / 2.0
    np.testing.assert_allclose(found.protected, expected)


def test_data_that_tell_nothing_leave_all_learners_equal():
    found = select_learners(np.zeros((9, 3)))
    np.testing.assert_allclose(found.protected, 1.0 / 3.0, atol=0.01)
    assert found.equal == pytest.approx(0.5)
    np.testing.assert_allclose(found.people, 1.0 / 3.0, atol=0.01)
