"""Evidence of a change, and its date, from cells whose signals follow known loads."""

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD

from affordance.extensions.payload.evidence.fitted_arm import FittedArm
from affordance.extensions.payload.evidence.joint_statistics import ChannelSamples
from affordance.extensions.payload.live.load_change import Cell, LoadChange

NOISE = 0.1


@pytest.fixture
def change(robot, gains):
    n = robot.num_joints
    fitted = FittedArm(robot, np.ones(n), np.zeros(10 * n), np.zeros((n, 7)), np.eye(10 * n))
    fitted = fitted.__class__(
        **{**vars(fitted), "least_variance": np.full(n, NOISE**2), "friction_left": np.full((n, 3), 0.05)}
    )
    return LoadChange(fitted, gains)


def build_cells(robot, rng, loads, jitter=0.0):
    """Cells of half a second along a slow motion, each with its load, (10,)."""
    n, cells = robot.num_joints, []
    for k, load in enumerate(loads):
        t = 0.5 * k + 0.05 * np.arange(10)
        phase = t[:, None] * (0.5 + 0.1 * np.arange(n)) + np.arange(n)
        q, v, vdot = np.sin(phase), 0.6 * np.cos(phase), -0.4 * np.sin(phase)
        Y = robot.compute_payload_regressors(q, v, vdot)
        signal = Y @ load + NOISE * rng.standard_normal((10, n))
        samples = ChannelSamples.of_joints(Y, v, vdot, signal, arm_torque=np.ones_like(v), min_speed=0.03)
        cells.append(Cell.of(samples, t, np.full_like(v, jitter)))
    return cells


@pytest.mark.parametrize("load", [np.zeros(10), PAYLOAD])
def test_the_same_load_is_no_change(robot, rng, change, load):
    cells = build_cells(robot, rng, [load] * 40)
    assert max(change.measure(cells[:k]) for k in range(8, 41)) < 0.0


def test_another_load_is_noticed_within_two_seconds_and_dated(robot, rng, change):
    cells = build_cells(robot, rng, [*[np.zeros(10)] * 12, *[PAYLOAD] * 8])
    first = next(k for k in range(8, 21) if change.is_change(cells[:k]))
    assert 12 < first <= 16
    assert change.date(cells) == 8


def test_errors_by_jitter_make_evidence_weaker(robot, rng, change):
    loads = [*[np.zeros(10)] * 12, *[PAYLOAD] * 4]
    exact, jittered = (
        change.measure(build_cells(robot, np.random.default_rng(1), loads, jitter)) for jitter in (0.0, NOISE**2)
    )
    assert 0.5 * exact < jittered < 0.9 * exact  # twice the variance, but not of the load that was before


def test_few_cells_and_an_arm_at_rest_show_nothing(robot, rng, change):
    cells = build_cells(robot, rng, [*[np.zeros(10)] * 3, *[PAYLOAD] * 2])
    assert change.measure(cells) == -np.inf
    still = [cell._replace(counts=0.0 * cell.counts) for cell in build_cells(robot, rng, [PAYLOAD] * 20)]
    assert change.measure(still) == -np.inf
