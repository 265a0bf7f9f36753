"""Mistakes in simulated pairs."""

import numpy as np
from numpy.testing import assert_allclose

from studies.payload.mistakes import SizedMistake, _delay, _scale
from studies.payload.simulated_mistakes import MistakesConfig, list_sizes, run_mistakes, tabulate_mistakes


def test_mistakes_of_a_pair_are_noticed_or_move_its_mass(monkeypatch):
    """Velocities that are late by 100 ms are noticed; both signals 5 % larger pass, and make the load 5 % heavier."""
    few = (
        SizedMistake("scale", "", (1.05,), lambda case, size: _scale(case, size, both=True)),
        SizedMistake("late", "ms", (100.0,), _delay),
    )
    for module in ("simulated_mistakes", "mistakes"):
        monkeypatch.setattr(f"studies.payload.{module}.list_mistakes", lambda _: few)
    found = run_mistakes(MistakesConfig("panda"), 0)
    assert list_sizes() == [("scale", 1.05), ("late", 100.0)]
    assert_allclose(found["passes"], [1.0, 0.0])
    rows = tabulate_mistakes({name: values[None] for name, values in found.items()})
    assert [(row["passes"], row["pairs"]) for row in rows] == [(1, 1), (0, 1)]
    mass = abs(found["moved"][0]) / 0.05
    assert 0.1 < mass < 4.0
    assert rows[1]["moved_g"] is None


def test_pairs_that_are_not_trusted_count_for_nothing():
    num = len(list_sizes())
    passes = np.array([np.full(num, np.nan), np.ones(num), np.zeros(num)])
    rows = tabulate_mistakes({"passes": passes, "moved": 0.2 * passes, "sds": 3.0 * passes})
    assert {(row["passes"], row["pairs"], row["moved_g"], row["moved_sd"]) for row in rows} == {(1, 2, 200.0, 3.0)}
