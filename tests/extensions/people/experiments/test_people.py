"""People's published values, and the spread between people that their intervals imply."""

import numpy as np
import pytest
from scipy.stats import t as student_t

from affordance.extensions.people.experiments.linear import Published, describe_people, find_spread


def test_values_have_their_interval_where_one_is_published():
    people = {"end_N": Published(9.0, 8.0, 10.0), "weight_N": Published(11.77)}
    assert describe_people(people) == {"end_N": 9.0, "end_N_ci95": [8.0, 10.0], "weight_N": 11.77}


def test_spread_follows_from_the_interval_of_the_mean():
    """A 95 % interval of +- 0.945 N over nine people is an SD of 0.945 / 2.306 * 3."""
    assert find_spread(Published(8.13, 7.19, 9.08), 9, "a paper").sd == pytest.approx(0.945 / 2.306 * 3.0, rel=1e-4)
    rng = np.random.default_rng(0)
    drawn = rng.normal(10.0, 2.0, 14)
    half = student_t.ppf(0.975, 13) * drawn.std(ddof=1) / np.sqrt(14)
    found = find_spread(Published(10.0, 10.0 - half, 10.0 + half), 14, "a paper")
    assert (found.sd, found.source) == (pytest.approx(drawn.std(ddof=1)), "a paper")
