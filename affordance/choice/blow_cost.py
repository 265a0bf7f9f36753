"""Cost of a blow with one tool, as a function of the tool's inertial parameters.

Swings are planned for a grid of tip speeds. The tool's inertia determines the effective mass at the tip, and thus the
required tip speed and swing. Costs are interpolated between swings of the grid.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array
from affordance.choice.demand import Demand
from affordance.choice.motion_cost import Costs, MotionCost
from affordance.control.swing import Swing, Target
from affordance.plant.contact import EffectiveMass
from affordance.plant.nail import Nail

# Function that computes quantities, (s,) each, for tools, (s, 10), at a node of the grid of tip speeds.
_AtNode = Callable[[int, Array], tuple[Array, ...]]

# A blow with less than the demanded force does not drive the nail to the demanded depth. With an aim of 1.00 the
# simulated peak is 0.988 to 1.031 times the demanded one (three start postures, 22 blows;
# docs/decisions/0013-nail.md), so blows aim 2 % higher.
AIM = 1.02
# Tip speed assigned to a body that cannot strike, relative to the fastest swing.
_BEYOND = 2.0
# Bisection steps in the search for the greatest depth, which is then known to micrometres.
_HALVINGS = 16


@dataclass(frozen=True, eq=False)
class BlowCost:
    """Swings at all planned tip speeds, with their costs."""

    nail: Nail
    force: float  # demanded peak of the nail's resistance, [N]
    target: Target  # target point, and the point of the tool that strikes it
    swings: tuple[Swing, ...]  # in order of increasing tip speed
    speeds: Array  # tip speeds of the swings, (K,), [m/s]
    masses: tuple[EffectiveMass, ...]  # effective mass at each strike
    motions: tuple[MotionCost, ...]  # costs of the swings
    joint_names: tuple[str, ...]
    infeasible_reason: str  # reason why no swing strikes the nail, whatever the tool's inertia; empty if one does

    @property
    def q_start(self) -> Array:
        """Joint angles at the start, (num_joints,), [rad]. The array is empty if no swing strikes the nail."""
        return self.swings[0].q_start if self.swings else np.zeros(0)

    def compute_speed(self, pi: Array, force: float | None = None) -> Array:
        """Computes the tip speed for slightly more than a peak force, (S,), [m/s].

        The force is in [N]; None is the demanded force.
        """
        aim = np.array(AIM * (self.force if force is None else force))
        # The posture at the strike, and with it the mass, hardly depends on the speed.
        middle = self.masses[len(self.masses) // 2].compute(pi)
        speed = self._compute_speed(aim, middle)
        (mass,) = self._interpolate(speed, pi, lambda node, chunk: (self.masses[node].compute(chunk),))
        return self._compute_speed(aim, mass)

    def _compute_speed(self, force: Array, mass: Array) -> Array:
        """Computes the tip speed for a peak force, (S,), [m/s]. The force is in [N], effective masses, (S,), in [kg].

        Geometry errors are modelled to first order, so a sample can be an impossible body with a negative effective
        mass at the tip. Such a body gets a speed beyond all swings.
        """
        possible = mass > 0.0
        speed = self.nail.compute_tip_speed(force, np.where(possible, mass, 1.0))
        return np.where(possible, speed, _BEYOND * self.speeds[-1])

    def pick_swing(self, speed: float) -> Swing | None:
        """Finds the slowest swing that reaches a speed, [m/s]. Returns None if all swings are slower."""
        near = int(np.searchsorted(self.speeds, speed))
        return self.swings[near] if near < len(self.swings) else None

    def compute(self, pi: Array, force: float | None = None) -> Costs:
        """Computes the costs for S tools with parameters pi about To in T, (S, 10).

        A tool that needs more speed than the fastest swing is infeasible. A tool that needs less than the slowest
        swing uses the slowest. ``force`` is the peak resistance, [N], at most the demanded force; None is the
        demanded force.
        """
        if self.infeasible_reason:
            return Costs.of_nothing(len(pi))
        return self.compute_at_speed(pi, self.compute_speed(pi, force))

    def compute_at_speed(self, pi: Array, speed: Array) -> Costs:
        """Computes the costs of swings that strike at given speeds, (S,), [m/s]; see ``compute``.

        Speeds above the fastest swing are infeasible; their costs grow with the square of the speed, like kinetic
        energy.
        """
        work, effort, cost, load = self._interpolate(
            speed, pi, lambda node, chunk: self.motions[node].compute_load(chunk)
        )
        beyond = np.square(np.maximum(1.0, speed / self.speeds[-1]))
        return Costs(beyond * work, beyond * effort, (load <= 1.0) & (speed <= self.speeds[-1]), beyond * cost)

    def compute_demand(self, pi: Array) -> Demand:
        """Computes the largest loads on joints and grip before the strike. The impact is excluded; see ``compute``.

        At speeds above the fastest swing, loads grow with the square of the speed.
        """
        if self.infeasible_reason:
            return Demand.of_nothing(len(self.joint_names), len(pi))
        speed = self.compute_speed(pi)

        def compute(node: int, chunk: Array) -> tuple[Array, ...]:
            loads, force, moment = self.motions[node].compute_demand(chunk)
            return *loads, force, moment

        beyond = np.square(np.maximum(1.0, speed / self.speeds[-1]))
        *loads, force, moment = (beyond * each for each in self._interpolate(speed, pi, compute))
        return Demand(np.array(loads), force, moment)

    def explain_infeasibility(self, pi: Array) -> str:
        """Describes the limit that makes a blow with a tool infeasible.

        The parameters pi are (10,). The text is empty if the blow is feasible.
        """
        if self.infeasible_reason or self.compute(pi[None]).feasible[0]:
            return self.infeasible_reason
        speed = self.compute_speed(pi[None])
        if speed[0] > self.speeds[-1]:
            return f"the tip must strike with {speed[0]:.3g} m/s, the joints' limits allow {self.speeds[-1]:.3g} m/s"
        loads = self._interpolate(
            speed, pi[None], lambda node, one: tuple(self.motions[node].compute_joint_loads(one))
        )
        worst = int(np.argmax(loads))
        (*_, load) = self._interpolate(speed, pi[None], lambda node, one: self.motions[node].compute_load(one))
        return f"{self.joint_names[worst]} must bear {load[0]:.3g} times its torque limit"

    def find_greatest_depth(self, pi: Array) -> float:
        """Finds the depth to which a tool can drive the nail, [m].

        The tool has parameters pi, (10,). The depth is between the initial and the demanded depth of the nail.
        """
        low, high = self.nail.depth_set, self.nail.depth_demanded
        if self.compute(pi[None]).feasible[0]:
            return high
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            feasible = self.compute(pi[None], self.nail.stiffness * middle).feasible[0]
            low, high = (middle, high) if feasible else (low, middle)
        return low

    def _interpolate(self, speed: Array, pi: Array, compute: _AtNode) -> tuple[Array, ...]:
        """Interpolates quantities between the grid's tip speeds. Each of S tools has one speed."""
        last = len(self.speeds) - 1
        at = np.interp(speed, self.speeds, np.arange(last + 1.0))
        below = np.minimum(at.astype(int), max(0, last - 1))
        share = at - below
        results: tuple[Array, ...] = ()
        for node in np.unique(np.concatenate([below, np.minimum(below + 1, last)])):
            weight = np.where(below == node, 1.0 - share, 0.0) + np.where(below + 1 == node, share, 0.0)
            chosen = np.flatnonzero(weight)
            if not len(chosen):
                continue
            values = compute(int(node), pi[chosen])
            results = results or tuple(np.zeros(len(pi)) for _ in values)
            for result, value in zip(results, values, strict=True):
                result[chosen] += weight[chosen] * value
        return results
