"""Two families of one look: objects, trials, and the numbers of one observer by hand."""

import numpy as np
import pandas as pd
import pytest

from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import two_families

NAMES = [*two_families.SMALL, *two_families.LARGE]


def test_small_objects_weigh_more_than_large_ones():
    tools = two_families.read(Setup())
    assert [tool.name for tool in tools] == NAMES
    masses = [tool.mass for tool in tools]
    assert min(masses[:2]) > max(masses[2:])
    assert len({part.looks_like.colour for tool in tools for part in tool.components}) == 1


def test_every_repetition_has_every_object():
    objects = two_families.design(0, np.random.default_rng(0))["object"].tolist()
    assert len(objects) == 64
    assert all(sorted(objects[k : k + 4]) == sorted(NAMES) for k in range(0, 64, 4))


def test_numbers_of_one_observer_are_of_the_last_eight_repetitions():
    """Small ones of 10 N are lifted with 5 N in the end, and large ones of 4 N with 6 N: the illusion is 3."""
    rows = []
    for cycle in range(16):
        small, large = (50.0, 60.0) if cycle < 8 else (5.0, 6.0)
        rows += [(name, 10.0, small) for name in two_families.SMALL]
        rows += [(name, 4.0, large) for name in two_families.LARGE]
    found = two_families.measure(pd.DataFrame(rows, columns=["object", "weight", "force"]))
    assert found.to_dict() == pytest.approx(
        {"small_weight_N": 10.0, "large_weight_N": 4.0, "small_N": 5.0, "large_N": 6.0, "illusion": 3.0}
    )


def test_one_density_has_the_illusion_for_ever_and_kinds_have_not(shipped):
    illusion = {learner: found["illusion"] for learner, found in shipped.numbers["learners"].items()}
    assert illusion["density"] > 1.5 * illusion["kinds_map"]
    assert illusion["kinds_map"] == pytest.approx(1.0, abs=0.3)
