"""Cost of a blow with one tool as a function of the tool's inertial parameters.

The tool's inertia determines the effective mass at the tip, and thus the required tip speed. Swings are planned for a
grid of tip speeds, and costs are interpolated between them.
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

# Function of a node of the grid and of the parameters of s tools, (s, 10). It returns quantities of shape (s,).
_AtNode = Callable[[int, Array], tuple[Array, ...]]

# Planned peak force relative to the demanded force. With 1.00, simulated peaks were 0.988 to 1.031 times the demanded
# force (three start postures, 22 blows; docs/decisions/0013-nail.md), so some blows would not reach the demanded
# depth.
AIM = 1.02
# Tip speed relative to the fastest swing for bodies with a negative effective mass.
_BEYOND = 2.0
# Number of bisection steps in the search for the greatest depth; the result is accurate to micrometres.
_HALVINGS = 16


@dataclass(frozen=True, eq=False)
class BlowCost:
    """Swings at all planned tip speeds, with their costs."""

    nail: Nail
    force: float  # demanded peak of the nail's resistance, [N]
    target: Target  # target point, and the point of the tool that strikes it
    swings: tuple[Swing, ...]  # swings in order of increasing tip speed
    speeds: Array  # tip speeds of the swings, (K,), [m/s]
    masses: tuple[EffectiveMass, ...]  # effective mass at each strike
    motions: tuple[MotionCost, ...]  # costs of the swings
    joint_names: tuple[str, ...]
    infeasible_reason: str  # reason if no swing strikes the nail with any inertia of the tool, otherwise empty

    @property
    def q_start(self) -> Array:
        """Joint angles at the start, (num_joints,), [rad]; empty if no swing strikes the nail."""
        return self.swings[0].q_start if self.swings else np.zeros(0)

    def compute_speed(self, pi: Array, force: float | None = None) -> Array:
        """Computes the tip speed that is required for a peak force, (S,), [m/s].

        Args:
            pi: Parameters of S tools about To in T, (S, 10).
            force: Peak force, [N]; None for the demanded force. The factor ``AIM`` is applied.
        """
        aim = np.array(AIM * (self.force if force is None else force))
        # The effective mass hardly depends on the speed, because the posture at the strike hardly does.
        middle = self.masses[len(self.masses) // 2].compute(pi)
        speed = self._compute_speed(aim, middle)
        (mass,) = self._interpolate(speed, pi, lambda node, chunk: (self.masses[node].compute(chunk),))
        return self._compute_speed(aim, mass)

    def _compute_speed(self, force: Array, mass: Array) -> Array:
        """Computes the tip speed, (S,), [m/s], for a peak force, [N], and effective masses, (S,), [kg].

        Samples with large geometry errors may be impossible bodies with a negative effective mass, because these
        errors are modelled to first order. They get a speed beyond all swings.
        """
        possible = mass > 0.0
        speed = self.nail.compute_tip_speed(force, np.where(possible, mass, 1.0))
        return np.where(possible, speed, _BEYOND * self.speeds[-1])

    def pick_swing(self, speed: float) -> Swing | None:
        """Returns the slowest swing that reaches a speed, [m/s], or None if all swings are slower."""
        near = int(np.searchsorted(self.speeds, speed))
        return self.swings[near] if near < len(self.swings) else None

    def compute(self, pi: Array, force: float | None = None) -> Costs:
        """Computes the costs of blows with S tools.

        Tools that require more speed than the fastest swing are infeasible. Tools that require less speed than the
        slowest swing use the slowest swing.

        Args:
            pi: Parameters of the tools about To in T, (S, 10).
            force: Peak force, [N], at most the demanded force; None for the demanded force.
        """
        if self.infeasible_reason:
            return Costs.of_nothing(len(pi))
        return self.compute_at_speed(pi, self.compute_speed(pi, force))

    def compute_at_speed(self, pi: Array, speed: Array) -> Costs:
        """Computes the costs of swings with given tip speeds, (S,), [m/s] (``compute``).

        Speeds above the fastest swing are infeasible. Their costs are extrapolated with the square of the speed, like
        kinetic energy.
        """
        work, effort, cost, load = self._interpolate(
            speed, pi, lambda node, chunk: self.motions[node].compute_load(chunk)
        )
        beyond = np.square(np.maximum(1.0, speed / self.speeds[-1]))
        return Costs(beyond * work, beyond * effort, (load <= 1.0) & (speed <= self.speeds[-1]), beyond * cost)

    def compute_demand(self, pi: Array) -> Demand:
        """Computes the peak loads on joints and grip before the impact, for parameters pi, (S, 10).

        Above the fastest swing, loads are extrapolated with the square of the speed.
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
        """Describes the limit that a blow with parameters pi, (10,), exceeds; empty if the blow is feasible."""
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
        """Finds the greatest depth, [m], to which a tool with parameters pi, (10,), can drive the nail.

        The result is between the initial and the demanded depth.
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
        """Interpolates quantities between the grid's tip speeds, with one speed, (S,), for each tool, (S, 10)."""
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
