"""Motions interpolated over beliefs: accurate to the stated error, and simulated where that cannot be reached."""

import numpy as np
import pytest

from studies.robustness.interpolation import TOLERANCE, interpolate_motions

TIMES = np.linspace(0.0, 3.0, 31)
TRUE = np.array([700.0, 8000.0])


class Simulator:
    """Simulator of heights that depend on two densities, which counts its calls."""

    def __init__(self, move):
        self.move = move
        self.asked = []

    def __call__(self, believed):
        self.asked.append(tuple(believed))
        return 0.1 * self.move(believed) * (1.0 - np.exp(-TIMES))

    def list_all(self, believed):
        return np.array([Simulator(self.move)(each) for each in believed])


def smooth(believed):
    return np.tanh((believed[0] / TRUE[0] - 1.0) + 2.0 * (believed[-1] / TRUE[-1] - 1.0))


def limited(believed):
    return min(smooth(believed), 0.031)


@pytest.fixture
def believed(rng):
    wood = rng.normal(700.0, 250.0, 200)
    return np.column_stack([wood, 8000.0 - 2.0 * (wood - 700.0) + rng.normal(0.0, 150.0, 200)])


def test_motions_of_many_follow_from_those_of_a_few(believed):
    simulate = Simulator(smooth)
    motions = interpolate_motions(simulate, believed, TRUE)
    everyone = simulate.list_all(believed)
    assert np.abs(motions.heights - everyone).max() < TOLERANCE
    assert len(simulate.asked) == motions.num_simulated + 1 < 40  # one more for the observer who believes the truth
    assert (motions.num_distinct, len(motions.heights)) == (200, 200)


def test_error_is_that_of_motions_not_simulated_yet(believed):
    """The stated error is at most the tolerance and over half of the true one, by motions new to the polynomial."""
    motions = interpolate_motions(Simulator(smooth), believed, TRUE)
    error = np.abs(motions.heights - Simulator(smooth).list_all(believed)).max()
    assert 0.0 < motions.error <= TOLERANCE
    assert error < 2.0 * motions.error
    rough = interpolate_motions(Simulator(smooth), believed, TRUE, tolerance=1e-3)
    assert rough.num_simulated < motions.num_simulated
    assert TOLERANCE < np.abs(rough.heights - Simulator(smooth).list_all(believed)).max() < 1e-3


def test_true_densities_are_a_node_and_drops_have_their_kink_there():
    rods = np.random.default_rng(1).uniform(5000.0, 12000.0, (200, 1))
    simulate = Simulator(lambda rho: np.log(rho[0] / 8500.0))
    motions = interpolate_motions(simulate, rods, np.array([8500.0]))
    assert (8500.0,) in simulate.asked
    drop = np.maximum(0.0, -motions.heights.min(axis=1))
    np.testing.assert_allclose(drop, np.maximum(0.0, -simulate.list_all(rods).min(axis=1)), atol=TOLERANCE)
    assert (drop == 0.0)[rods[:, 0] > 8510.0].all()
    assert (drop > 0.0)[rods[:, 0] < 8490.0].all()


def test_all_are_simulated_where_motions_are_not_smooth(believed):
    simulate = Simulator(limited)
    motions = interpolate_motions(simulate, believed, TRUE)
    assert motions.num_simulated == motions.num_distinct == 200
    assert motions.error == 0.0
    np.testing.assert_array_equal(motions.heights, simulate.list_all(believed))
    assert len(set(simulate.asked)) == len(simulate.asked)


def test_nodes_gather_where_the_arm_meets_a_limit(rng):
    """Nodes over one density gather at the arm's limit, on both sides of which a single polynomial would ring."""
    rods = rng.uniform(500.0, 3000.0, (200, 1))
    simulate = Simulator(lambda rho: 0.2 * max(0.0, rho[0] / 2000.0 - 0.4) + 0.05 * np.sin(rho[0] / 1000.0))
    motions = interpolate_motions(simulate, rods, np.array([2000.0]))
    assert motions.num_simulated < 40
    assert np.abs(motions.heights - simulate.list_all(rods)).max() < TOLERANCE
    near = np.abs(np.array(simulate.asked)[:, 0] - 800.0) < 100.0
    assert near.sum() > 5


def test_some_may_believe_the_truth(rng):
    rods = np.append(rng.uniform(500.0, 3000.0, 50), [2000.0, 2000.0 + 1e-12, 500.0])[:, np.newaxis]
    simulate = Simulator(smooth)
    motions = interpolate_motions(simulate, rods, np.array([2000.0]))
    assert motions.num_simulated < motions.num_distinct
    assert np.abs(motions.heights - simulate.list_all(rods)).max() < TOLERANCE


def test_those_who_believe_the_same_are_simulated_once():
    simulate = Simulator(smooth)
    motions = interpolate_motions(simulate, np.tile([[500.0, 7000.0]], (200, 1)), TRUE)
    assert (motions.num_simulated, motions.num_distinct, len(simulate.asked)) == (1, 1, 1)
    np.testing.assert_array_equal(motions.heights, np.tile(simulate([500.0, 7000.0]), (200, 1)))


def test_beliefs_along_a_line_take_nodes_along_it():
    wood = np.linspace(200.0, 1200.0, 50)
    believed = np.column_stack([wood, 8000.0 - 2.0 * (wood - 700.0)])
    motions = interpolate_motions(Simulator(smooth), believed, TRUE)
    assert motions.num_simulated <= 14
    assert np.abs(motions.heights - Simulator(smooth).list_all(believed)).max() < TOLERANCE


def test_a_limit_that_only_extreme_beliefs_meet_is_found(rng):
    """A limit met by one of the six most extreme beliefs alone, no node of a smooth motion, is found."""
    believed = rng.multivariate_normal([700.0, 3500.0], [[6400.0, 0.0], [0.0, 22_500.0]], 200)
    plain = Simulator(lambda rho: 1e-4 * rho.sum())
    interpolate_motions(plain, believed)
    centred = believed - believed.mean(axis=0)
    extreme = believed[np.argsort(-np.einsum("ni,ij,nj->n", centred, np.linalg.inv(np.cov(centred.T)), centred))[:6]]
    nodes = plain.asked[:6]  # up to degree two, which compares the line with two more
    corner = next(tuple(rho) for rho in extreme if tuple(rho) not in nodes)
    limited = Simulator(lambda rho: 1e-4 * rho.sum() + 0.1 * (tuple(rho) == corner))
    motions = interpolate_motions(limited, believed)
    assert corner in limited.asked
    assert np.abs(motions.heights - limited.list_all(believed)).max() <= 2.0 * TOLERANCE
