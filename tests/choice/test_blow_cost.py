"""Costs of a blow from a table of swings, against kinetic energies that are computed by hand.

A swing of tip speed v costs the work E = m v^2 and fixed multiples of it, where m is a tool's first parameter; its
second one is the effective mass at the tip. So work, torques and wrench are known at any speed.
"""

import dataclasses

import numpy as np
import pytest

from affordance.choice.blow_cost import AIM, BlowCost
from affordance.choice.hammer import load_hammer
from affordance.files.model_folder import MODELS
from affordance.plant.contact import CONTACT_STIFFNESS

NAIL = load_hammer(MODELS / "nail.yaml").nail
SPEEDS = np.array([1.0, 2.0, 4.0])
# Energy at which the second joint, the weaker one, reaches its torque limit.
STRONG = 1e3


class Swing:
    """Effective mass and costs of a swing of a tip speed."""

    def __init__(self, speed):
        self.speed = speed

    def compute(self, pi):
        return pi[:, 1]

    def compute_joint_loads(self, pi):
        energy = pi[:, 0] * self.speed**2
        return [0.5 * energy / STRONG, energy / STRONG]

    def compute_load(self, pi):
        energy = pi[:, 0] * self.speed**2
        return energy, 2.0 * energy, 3.0 * energy, energy / STRONG

    def compute_demand(self, pi):
        energy = pi[:, 0] * self.speed**2
        return self.compute_joint_loads(pi), 4.0 * energy, 5.0 * energy


def build(force=NAIL.force_demanded, **changes):
    swings = tuple(map(Swing, SPEEDS))
    cost = BlowCost(NAIL, force, None, ("slow", "medium", "fast"), SPEEDS, swings, swings, ("shoulder", "elbow"), "")
    return dataclasses.replace(cost, **changes)


def make_tool(m=2.0, mass=1.0):
    return np.array([[m, mass, *np.zeros(8)]])


def find_force(speed, mass=1.0):
    """The peak force of a blow: its energy drives the nail from where it is set, and loads the contact."""
    set_energy = NAIL.stiffness * NAIL.depth_set**2
    return np.sqrt((mass * speed**2 + set_energy) / (1.0 / NAIL.stiffness + 1.0 / CONTACT_STIFFNESS)) / AIM


@pytest.mark.parametrize(
    ("speed", "energy", "feasible"),
    [
        (0.5, 2.0, True),  # by the slowest swing
        (1.0, 2.0, True),
        (2.0, 8.0, True),
        (3.0, 20.0, True),  # interpolated between 8 and 32
        (4.0, 32.0, True),
        (4.0 + 1e-9, 32.0, False),
        (6.0, 72.0, False),
        (40.0, 3200.0, False),
    ],
)
def test_costs_beyond_the_fastest_swing_grow_as_kinetic_energy_does(speed, energy, feasible):
    found = build().compute_at_speed(make_tool(), np.array([speed]))
    np.testing.assert_allclose([found.work, found.effort, found.cost], energy * np.array([[1.0], [2.0], [3.0]]))
    assert found.feasible.tolist() == [feasible]


@pytest.mark.parametrize("speed", [1.0, 2.0, 4.0, 6.0, 40.0])
@pytest.mark.parametrize("mass", [0.5, 2.0])
def test_demands_beyond_the_fastest_swing_grow_as_kinetic_energy_does(speed, mass):
    cost, energy = build(find_force(speed, mass)), 2.0 * speed**2
    demand = cost.compute_demand(make_tool(mass=mass))
    np.testing.assert_allclose(demand.loads[:, 0], [0.5 * energy / STRONG, energy / STRONG])
    np.testing.assert_allclose([demand.force, demand.moment], [[4.0 * energy], [5.0 * energy]])
    np.testing.assert_allclose(cost.compute(make_tool(mass=mass)).work, energy)


def test_body_that_cannot_be_costs_a_swing_of_twice_the_greatest_speed():
    """Other bodies keep their costs."""
    bodies = np.concatenate([make_tool(mass=1.0), make_tool(mass=-1.0), make_tool(mass=0.0)])
    found = build(find_force(2.0)).compute(bodies)
    assert found.feasible.tolist() == [True, False, False]
    np.testing.assert_allclose(found.work, [8.0, 128.0, 128.0])


def test_tool_that_needs_too_much_torque_is_infeasible_though_its_speed_is_not():
    tools = np.concatenate([make_tool(m=0.999 * STRONG / 4.0), make_tool(m=1.001 * STRONG / 4.0)])
    cost = build(find_force(2.0))
    assert cost.compute(tools).feasible.tolist() == [True, False]
    assert [cost.explain_infeasibility(pi) for pi in tools] == ["", "elbow must bear 1 times its torque limit"]
    fast = build(find_force(6.0)).explain_infeasibility(make_tool()[0])
    assert fast == "the tip must strike with 6 m/s, the joints' limits allow 4 m/s"


@pytest.mark.parametrize(
    ("speed", "swing"), [(0.0, "slow"), (1.0, "slow"), (1.1, "medium"), (4.0, "fast"), (4.1, None)]
)
def test_swing_picked_is_the_slowest_that_is_fast_enough(speed, swing):
    assert build().pick_swing(speed) == swing


def test_greatest_depth_is_where_the_energy_of_the_fastest_swing_ends():
    mass = 0.01
    depth = find_force(4.0, mass) / NAIL.stiffness
    assert NAIL.depth_set < depth < NAIL.depth_demanded
    found = build().find_greatest_depth(make_tool(mass=mass)[0])
    assert found == pytest.approx(depth, abs=(NAIL.depth_demanded - NAIL.depth_set) * 2.0**-16)
    assert build().find_greatest_depth(make_tool(mass=1e3)[0]) == NAIL.depth_demanded
    assert build().find_greatest_depth(make_tool(m=2.0 * STRONG)[0]) == pytest.approx(NAIL.depth_set, abs=1e-6)


def test_where_no_swing_strikes_the_nail_costs_and_demands_are_infinite():
    none = build(swings=(), speeds=np.zeros(0), masses=(), motions=(), infeasible_reason="out of reach")
    costs, demand = none.compute(make_tool()), none.compute_demand(make_tool())
    assert [*costs.work, *costs.effort, *costs.cost] == [np.inf] * 3
    assert costs.feasible.tolist() == [False]
    assert (demand.loads.tolist(), [*demand.force, *demand.moment]) == ([[np.inf], [np.inf]], [np.inf] * 2)
    assert (none.q_start.shape, none.explain_infeasibility(make_tool()[0])) == ((0,), "out of reach")
