"""Benefit of four more seconds of motion: a line on the mass always, another on what was not seen."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_run

from affordance.extensions.payload.excitation import more_motion
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind

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
    said = "\n".join(lines(0.02, 4.0))
    found = re.search(r"SD of the (\w[\w ]*) from ([\d.]+) to ([\d.]+) (g|mm|kg m\^2); affordance excite", said)
    assert found is not None, said
    assert 0.0 < float(found[3]) < 0.8 * float(found[2])


def test_the_line_and_the_table_agree(robot, rng):
    belief = run_pair(robot, rng, 0.02, 4.0)
    line = next(note for note in belief.notes if " SD of the mass " in note)
    assert float(re.search(r"from ([\d.]+) to", line)[1]) == pytest.approx(1e3 * belief.mass_sd, rel=0.05)


def test_what_cannot_be_shown_is_said(lines):
    _, line = lines(1.0, 6.0)
    assert line.startswith("4 s more would hardly help: the best of 9 random motions (up to ")
    assert re.search(r"leaves the SD of the moments of inertia at ([\d.]+) \(now ([\d.]+)\) kg m\^2$", line)


def test_only_the_mass_is_spoken_of_where_all_was_seen(lines):
    (line,) = lines(0.001, 20.0)
    assert " SD of the mass " in line


def test_three_motions_of_each_pace_show_more_than_one(robot, monkeypatch):
    def find_least():
        line = next(
            note for note in run_pair(robot, np.random.default_rng(0), 0.3, 6.0).notes if " the mass " in note
        )
        return float(re.search(r"SD of the mass (?:from [\d.]+ to|at) ([\d.]+) ", line)[1])

    thrice = find_least()
    monkeypatch.setattr(more_motion, "_DRAWS", 1)
    assert thrice < find_least()


def test_nothing_is_said_without_an_empty_run(robot, rng):
    loaded = generate_run(robot, PAYLOAD, truth=Truth(noise_sd=0.1), rng=rng, duration=4.0)
    assert not [note for note in identify(robot, Runs(loaded), settings=SETTINGS).notes if note.startswith("4 s")]


def test_suggestion_does_not_change_the_belief(robot, monkeypatch):
    with_it = run_pair(robot, np.random.default_rng(3), 1.0, 6.0)
    monkeypatch.setattr("affordance.extensions.payload.identify.suggest_motion", lambda *arguments: ())
    without = run_pair(robot, np.random.default_rng(3), 1.0, 6.0)
    np.testing.assert_array_equal(with_it.bodies.pi, without.bodies.pi)
    assert len(with_it.notes) == len(without.notes) + 2


@pytest.mark.parametrize(
    ("kind", "is_difference", "is_repeated", "is_at_rest", "says"),
    [
        (SignalKind.WRENCH, False, False, False, "turn the sensor slowly through other postures"),
        (SignalKind.CURRENT, False, False, False, "record the same motion with an empty hand (--empty)"),
        (
            SignalKind.JOINT_TORQUE,
            True,
            False,
            False,
            "record the same motion with an empty hand: an arm fitted to other motions",
        ),
        (SignalKind.MOTOR_TORQUE, True, True, False, "move slowly through other postures; affordance excite --for"),
        (SignalKind.WRENCH, False, False, True, "hold more postures"),
        (SignalKind.JOINT_TORQUE, True, True, True, "hold more postures"),
        (SignalKind.JOINT_TORQUE, False, False, True, "hold the same postures also with an empty hand"),
    ],
)
def test_the_run_that_would_show_an_unseen_mass_depends_on_how_the_arm_was_treated(
    kind, is_difference, is_repeated, is_at_rest, says
):
    evidence = SimpleNamespace(kind=kind, is_difference=is_difference, is_repeated=is_repeated, is_at_rest=is_at_rest)
    belief = SimpleNamespace(fit=SimpleNamespace(evidence=evidence), shows_mass=False)
    assert more_motion.suggest_run(belief).startswith(says)
    belief.shows_mass = True
    assert more_motion.suggest_run(belief) == ""


def test_motion_elsewhere_keeps_the_limits_of_the_robot(robot):
    """Limits of the file are never exceeded; where it has none, a run may do again what it showed itself."""
    inf = np.inf
    for factor, limit, v_limit, v_max, vdot_max in (
        (1.0, inf, 0.3, 0.3, 3.0),
        (5.0, inf, 0.3, 0.3, 10.0),
        (5.0, inf, inf, 2.5, 10.0),
        (1.0, 5.0, inf, 0.5, 5.0),
        (5.0, 5.0, inf, 2.5, 5.0),
    ):
        slow = replace(robot, velocity_limits=np.full(6, v_limit), acceleration_limits=np.full(6, limit))
        run = SimpleNamespace(
            q=np.zeros((2, 6)), v=np.full((2, 6), 0.25 * factor), vdot=np.full((2, 6), 2.0 * factor)
        )
        belief = SimpleNamespace(fit=SimpleNamespace(evidence=SimpleNamespace(prepared=run)))
        *_, (_, family) = more_motion._list_families(slow, belief)
        np.testing.assert_allclose(family.limits.v_max, v_max)
        np.testing.assert_allclose(family.limits.vdot_max, vdot_max)
