"""What a blow costs with one tool, as a function of the tool's inertial parameters.

Swings are planned for a row of tip speeds. The inertia of the tool decides how fast the tip must be, by the effective
mass behind it, and with it which swing it takes; between two swings costs are interpolated.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array
from affordance.choice.motion_cost import Costs, MotionCost
from affordance.control.swing import Swing, Target
from affordance.plant.effective_mass import EffectiveMass
from affordance.plant.nail import Nail

# Computes quantities of some tools, (s, 10), at a node of the table, (s,) each.
_AtNode = Callable[[int, Array], tuple[Array, ...]]

# A blow that falls short of the demanded force does not drive the nail to the demanded depth. With an aim of 1.00 the
# simulated peak is 0.988 to 1.031 times the demand (three start postures, 22 blows; docs/decisions/0013-nail.md), so
# blows aim 2 % above it.
AIM = 1.02
# Of the search for the greatest depth: a nail's length is then known to micrometres.
_HALVINGS = 16


@dataclass(frozen=True, eq=False)
class BlowCost:
    """The swings of all tip speeds, and what they cost.

    Attributes:
        nail: The nail that is to be driven.
        force: Peak of its resistance that is asked for, [N].
        target: What is struck, and with which point.
        swings: Swings of rising tip speed.
        speeds: Their tip speeds, (K,), [m/s].
        masses: Effective masses at their strikes.
        motions: What they cost.
        joint_names: Those of the arm.
        infeasible_reason: Why no swing strikes the nail, whatever the tool's inertia; empty if one does.
    """

    nail: Nail
    force: float
    target: Target
    swings: tuple[Swing, ...]
    speeds: Array
    masses: tuple[EffectiveMass, ...]
    motions: tuple[MotionCost, ...]
    joint_names: tuple[str, ...]
    infeasible_reason: str

    def find_speed(self, pi: Array, force: float | None = None) -> Array:
        """Tip speed that gives a peak force, and a little more, (S,), [m/s].

        Args:
            pi: Inertial parameters of S tools about To, expressed in T, (S, 10).
            force: Peak resistance, at most the one that is asked for, [N]; that if None.
        """
        aim = np.array(AIM * (self.force if force is None else force))
        # The posture at the strike, and with it the mass, hardly depends on the speed.
        middle = self.masses[len(self.masses) // 2].compute(pi)
        speed = self.nail.compute_tip_speed(aim, middle)
        (mass,) = self._interpolate(speed, pi, lambda node, chunk: (self.masses[node].compute(chunk),))
        return self.nail.compute_tip_speed(aim, mass)

    def pick_swing(self, speed: float) -> Swing | None:
        """Picks the slowest swing that is at least as fast as a speed, [m/s]; None if there is none."""
        near = int(np.searchsorted(self.speeds, speed))
        return self.swings[near] if near < len(self.swings) else None

    def compute(self, pi: Array, force: float | None = None) -> Costs:
        """Computes the costs for S tools of inertial parameters pi about To, expressed in T, (S, 10).

        A tool that must be faster than the fastest swing is infeasible; one that could be slower than the slowest
        swing takes that.

        Args:
            pi: The tools.
            force: Peak resistance, at most the one that is asked for, [N]; that if None.
        """
        if self.infeasible_reason:
            nothing = np.full(len(pi), np.inf)
            return Costs(nothing, nothing, np.zeros(len(pi), dtype=bool), nothing)
        return self.compute_at_speed(pi, self.find_speed(pi, force))

    def compute_at_speed(self, pi: Array, speed: Array) -> Costs:
        """Computes the costs of swings that strike with given speeds, (S,), [m/s]; see ``compute``.

        Beyond the fastest swing, which is infeasible, they grow as the square of the speed, as kinetic energy does.
        """
        work, effort, cost, load = self._interpolate(
            speed, pi, lambda node, chunk: self.motions[node].compute_load(chunk)
        )
        beyond = np.square(np.maximum(1.0, speed / self.speeds[-1]))
        return Costs(beyond * work, beyond * effort, (load <= 1.0) & (speed <= self.speeds[-1]), beyond * cost)

    def explain_infeasibility(self, pi: Array) -> str:
        """Says which limit forbids the blow with a tool of inertial parameters pi, (10,); empty if none does."""
        if self.infeasible_reason or self.compute(pi[None]).feasible[0]:
            return self.infeasible_reason
        speed = self.find_speed(pi[None])
        if speed[0] > self.speeds[-1]:
            return f"the tip must strike with {speed[0]:.3g} m/s, the joints' limits allow {self.speeds[-1]:.3g} m/s"
        loads = self._interpolate(
            speed, pi[None], lambda node, one: tuple(self.motions[node].compute_joint_loads(one))
        )
        worst = int(np.argmax(loads))
        (*_, load) = self._interpolate(speed, pi[None], lambda node, one: self.motions[node].compute_load(one))
        return f"{self.joint_names[worst]} must bear {load[0]:.3g} times its torque limit"

    def find_greatest_depth(self, pi: Array) -> float:
        """Finds how deep the nail can be driven at most with a tool of inertial parameters pi, (10,), [m].

        Returns: A depth up to the one that is asked for; the one it is set to if no blow is feasible.
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
        """Interpolates quantities that are known at the speeds of the table, for S tools with a speed each."""
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
