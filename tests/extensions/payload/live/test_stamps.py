"""Stamps are used as they are unless they overtake each other."""

import numpy as np
import pytest

from affordance.extensions.payload.live.stamps import Stamps


def put(times):
    stamps = Stamps()
    return [each for i, t in enumerate(times) for each in stamps.put(float(t), i)], stamps


@pytest.mark.parametrize("jitter", [0.0, 0.001])
def test_stamps_in_order_are_kept(rng, jitter):
    times = 0.004 * np.arange(300) + jitter * rng.random(300)
    out, stamps = put(times)
    assert stamps.overtake is False
    assert out == list(zip(times, range(300), strict=True))


def test_stamps_that_overtake_each_other_lose_most_of_their_jitter(rng):
    true = 0.004 * np.arange(1000)
    out, stamps = put(true + 0.005 * np.abs(rng.standard_normal(1000)))
    assert stamps.overtake is True
    times, numbers = map(np.array, zip(*out, strict=True))
    assert list(numbers) == list(range(15, 985))
    assert (np.diff(times) > 0.0).all()
    assert (times - true[numbers]).std() < 0.25 * 0.005 * 0.603  # SD of |N(0, 1)|
