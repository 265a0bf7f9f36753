"""Benefit of four more seconds of motion: a line where something was not seen, none where all was."""

import re

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_run

from affordance.identification.identify import Runs, identify
from affordance.identification.settings import IdentificationSettings

SETTINGS = IdentificationSettings(num_samples=500)


def run_pair(robot, rng, noise_sd, duration):
    runs = [
        generate_run(robot, pi, truth=Truth(noise_sd=noise_sd), rng=rng, duration=duration) for pi in (PAYLOAD, None)
    ]
    return identify(robot, Runs(runs[0], (runs[1],)), settings=SETTINGS)


@pytest.fixture
def lines(robot, rng):
    return lambda noise_sd, duration: [
        note for note in run_pair(robot, rng, noise_sd, duration).notes if note.startswith("4 s more")
    ]


def test_a_short_run_is_told_what_more_would_bring(lines):
    (line,) = lines(0.02, 4.0)
    found = re.search(r"SD of the (\w[\w ]*) from ([\d.e-]+) to ([\d.e-]+) (g|mm|kg m\^2); affordance excite", line)
    assert found is not None, line
    assert 0.0 < float(found[3]) < 0.8 * float(found[2])


def test_what_cannot_be_shown_is_said(lines):
    (line,) = lines(1.0, 6.0)
    assert line.startswith("4 s more would hardly show the moments of inertia, even if moved faster (up to ")


def test_nothing_is_said_where_all_was_seen(lines):
    assert lines(0.001, 20.0) == []


def test_suggestion_does_not_change_the_belief(robot, monkeypatch):
    with_it = run_pair(robot, np.random.default_rng(3), 1.0, 6.0)
    monkeypatch.setattr("affordance.identification.identify.suggest_motion", lambda *arguments: ())
    without = run_pair(robot, np.random.default_rng(3), 1.0, 6.0)
    np.testing.assert_array_equal(with_it.bodies.pi, without.bodies.pi)
    assert len(with_it.notes) == len(without.notes) + 1
