"""A shallow family: masses, numbers by hand, and that only memories of each object come to be right."""

import numpy as np
import pandas as pd
import pytest

from affordance.belief.learners import DENSITY
from affordance.experiments.shared.holds import compute_volume
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import shallow_family
from affordance.extensions.people.experiments.lifts import measure_each, run_lifts
from affordance.extensions.people.rivals import OWN_MEMORY


def test_masses_are_a_line_that_does_not_go_through_zero():
    tools = shallow_family.read(Setup())
    slope, intercept = np.polyfit([compute_volume(tool) for tool in tools], [tool.mass for tool in tools], 1)
    assert (slope, intercept) == pytest.approx((750.0, 0.45))


def test_numbers_by_hand():
    rows = [(name, 9.0, 99.0) for name in (shallow_family.SMALLEST, shallow_family.LARGEST)] * 24
    rows += [(shallow_family.SMALLEST, 8.0, 6.0), (shallow_family.LARGEST, 10.0, 11.0)] * 16
    found = shallow_family.measure(pd.DataFrame(rows, columns=["object", "weight", "force"]))
    assert found.tolist() == pytest.approx([-0.25, 0.1, 2.5])


def test_learners_by_density_keep_errors_and_own_memory_does_not(tmp_path):
    setup = Setup(observers=2, out=tmp_path)
    tools = shallow_family.read(setup)
    lifts = run_lifts("mine", setup, tools, shallow_family.design, [DENSITY, OWN_MEMORY])
    found = measure_each(lifts, shallow_family.measure)
    assert (found["density"]["smallest"] < -0.1).all()
    assert (found["density"]["largest"] > 0.1).all()
    assert (np.abs([found["own_memory"][end] for end in ("smallest", "largest")]) < 0.1).all()
