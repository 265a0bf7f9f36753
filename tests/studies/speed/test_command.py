"""The study of speed: what its options select, and decisions compared both ways."""

import numpy as np
import pytest
from helpers.answers import answer

from affordance.choice.motion_cost import Costs
from studies.speed import command, regressor
from studies.speed.decision import Comparison
from studies.study import import_part


@pytest.mark.parametrize("name", command.MEASURED)
def test_every_part_makes_a_table(name):
    part = import_part(f"studies.speed.{name}")
    assert len(set(part.HEADER)) == len(part.HEADER)
    assert callable(part.measure)


def test_named_tables_are_printed_and_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(regressor, "measure", lambda: ([["ours", "1.00", "0.9"]], {}))
    said = answer("study", "speed", "--only", "regressor", "--out", tmp_path / "out")
    assert said.lines[2] == "| ours | 1.00 | 0.9 |"
    assert not (tmp_path / "out").exists()


def test_choices_and_works_of_both_ways_are_compared_where_both_can_be_done():
    nothing, work = np.zeros((2, 3)), np.array([[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]])
    inner = Costs(work, nothing, np.ones((2, 3), dtype=bool), work)
    executed = np.array([[1.1, 3.0, np.inf], [2.0, 2.0, 9.0]])
    full = inner._replace(work=executed, cost=executed, feasible=np.array([[1, 1, 0], [1, 1, 1]], dtype=bool))
    compared = Comparison(inner, full)
    one, other = compared.choose()
    assert (one.tolist(), other.tolist()) == ([0, 0, 0], [0, 1, 1])
    np.testing.assert_allclose(np.sort(compared.differences), [0.0, 0.0, 0.1, 2.0, 3.5])
