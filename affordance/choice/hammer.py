"""Hammer: the free end of the tool drives a nail with a demanded peak force."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from affordance.arrays import Array
from affordance.choice.motion_cost import Costs, MotionCost, PlannedMotion
from affordance.control.strike import Strike
from affordance.control.swing import Swing, Target, find_target, plan_swing
from affordance.exceptions import AffordanceError
from affordance.files.yaml_reader import read_record
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.objects.tool import PosedShape
from affordance.plant.arm_model import ArmModel
from affordance.plant.effective_mass import EffectiveMass
from affordance.plant.nail import Nail, NailPlacement, read_nail
from affordance.settings import Settings

# Computes quantities of some tools, (s, 10), at a node of the table, (s,) each.
_AtNode = Callable[[int, Array], tuple[Array, ...]]

# Between tip speeds at which swings are planned: at least so much, [m/s], and at least this part of the speed. Costs
# are interpolated between them, which errs by less than 0.5 % (tests/test_hammer_task.py).
_SPEED_STEP, _SPEED_GROWTH = 0.25, 0.06
# Shorter vectors do not say a direction, [1]; and a head that is nearer cannot be swung at, [m].
_MIN_LENGTH = 0.01
# Of the search for the greatest depth: a nail's length is then known to micrometres.
_HALVINGS = 16


@dataclass(frozen=True)
class Hammer:
    """What is asked of any tool: to drive a nail with a demanded peak of its resistance.

    Attributes:
        nail: The nail.
        offset: Where its head is, from where the home posture holds the striking point, in W, [m].
        direction: Where it is driven to, a unit vector in W.
        duration: Of the swing, from rest in the home posture to the strike, [s].
        force: Peak resistance that is asked for, [N].
    """

    nail: Nail
    offset: tuple[float, float, float]
    direction: tuple[float, float, float]
    duration: float
    force: float

    def find_target(self, model: ArmModel, parts: Sequence[PosedShape]) -> Target:
        """Finds striking point and nail for a tool's parts, posed relative to the hand; sets the model's state."""
        return find_target(model, parts, offset_W=np.array(self.offset), direction_W=np.array(self.direction))

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> "BlowCost":
        """Plans swings of all speeds, which are the same whatever the tool weighs.

        Args:
            model: The arm; its state and payload are set.
            parts: What the tool is made of, posed relative to the hand.
            settings: Those of the controller.
        """
        return BlowCost(model, parts, self, settings)


def load_hammer(path: Path) -> Hammer:
    """Reads a nail file: the nail, and under ``blow`` where it stands and how it is struck.

    Raises:
        BadValueError: The file or one of its values is wrong; the message says which and how.
    """
    record = read_record(path)
    nail = read_nail(record)
    blow = record.record("blow")
    x, y, z = (float(value) for value in blow.vector("offset", 3, low=-2.0, high=2.0))
    direction = blow.vector("direction", 3, low=-1.0, high=1.0)
    length = float(np.linalg.norm(direction))
    if length < _MIN_LENGTH:
        raise blow.error("direction", f"has a length of {length:g}, must be at least {_MIN_LENGTH:g}")
    ahead = float(np.array([x, y, z]) @ direction) / length
    if ahead < _MIN_LENGTH:  # the tool would have to pass through the nail
        problem = f"puts the head {ahead:.3g} m ahead of the tool's point along the blow"
        raise blow.error("offset", f"{problem}, must be at least {_MIN_LENGTH:g} m")
    duration = blow.number("duration", low=0.2, high=10.0)
    blow.finish()
    record.finish()
    a, b, c = (float(value) for value in direction / length)
    return Hammer(nail, (x, y, z), (a, b, c), duration, nail.force_demanded)


class BlowCost:
    """The costs of a blow as a function of the tool's inertial parameters.

    Swings are planned for a row of tip speeds. What the tool is believed to weigh decides how fast the tip must be,
    by the effective mass behind it, and with it which swing it takes; between two swings costs are interpolated.

    Attributes:
        hammer: What is asked for.
        target: What is struck, and with which point.
        swings: Swings of rising speed.
        speeds: Their tip speeds, (K,), [m/s].
        infeasible_reason: Why no swing strikes the nail, whatever the tool weighs; empty if one does.
    """

    def __init__(self, model: ArmModel, parts: Sequence[PosedShape], hammer: Hammer, settings: Settings) -> None:
        """Plans the swings; arguments are those of ``Hammer.build_energies``."""
        self.hammer = hammer
        self.infeasible_reason = ""
        self.target = hammer.find_target(model, parts)
        self._joint_names = model.arm.joint_names
        self.swings: list[Swing] = []
        self._masses: list[EffectiveMass] = []
        speeds, fastest = [0.0], _SPEED_STEP
        while speeds[-1] < fastest:
            speed = speeds[-1] + max(_SPEED_STEP, _SPEED_GROWTH * speeds[-1])
            try:
                self.swings.append(self._plan_swing(model, speed, len(self.swings) - 1))
            except AffordanceError as error:
                if not self.swings:
                    self.infeasible_reason = str(error)
                break
            speeds.append(speed)
            self._masses.append(EffectiveMass(model, self.target, self.swings[-1].q_end))
            # No tool has less behind it than the arm alone.
            (least_mass,) = self._masses[-1].compute(np.zeros((1, NUM_PARAMETERS)))
            fastest = float(hammer.nail.compute_tip_speed(np.array(hammer.force), least_mass))
        self.speeds = np.array(speeds[1:])
        self._motions = [MotionCost(model, _sample_swing(swing, settings.control_period)) for swing in self.swings]

    def find_speed(self, pi: Array, force: float | None = None) -> Array:
        """Tip speed that gives a peak force, (S,), [m/s].

        Args:
            pi: Inertial parameters of S tools about To, expressed in T, (S, 10).
            force: Peak resistance, at most the one that is asked for, [N]; that if None.
        """
        nail, demanded = self.hammer.nail, np.array(self.hammer.force if force is None else force)
        # The posture at the strike, and with it the mass, hardly depends on the speed.
        middle = self._masses[len(self._masses) // 2].compute(pi)
        speed = nail.compute_tip_speed(demanded, middle)
        (mass,) = self._interpolate(speed, pi, lambda node, chunk: (self._masses[node].compute(chunk),))
        return nail.compute_tip_speed(demanded, mass)

    def compute(self, pi: Array, force: float | None = None) -> Costs:
        """Computes the costs for S tools of inertial parameters pi about To, expressed in T, (S, 10).

        A tool that must be faster than the fastest swing is not feasible; one that could be slower than the slowest
        one is swung with it.

        Args:
            pi: The tools.
            force: Peak resistance, at most the one that is asked for, [N]; that if None.
        """
        if self.infeasible_reason:
            nothing = np.full(len(pi), np.inf)
            return Costs(nothing, nothing, np.zeros(len(pi), dtype=bool))
        return self.compute_at_speed(pi, self.find_speed(pi, force))

    def compute_at_speed(self, pi: Array, speed: Array) -> Costs:
        """Computes the costs of swings that strike with given speeds, (S,), [m/s]; see ``compute``."""
        work, effort, load = self._interpolate(speed, pi, lambda node, chunk: self._motions[node].compute_load(chunk))
        return Costs(work, effort, (load <= 1.0) & (speed <= self.speeds[-1]))

    def describe_lack(self, pi: Array) -> str:
        """Says what a tool of inertial parameters pi, (10,), lacks for the blow; empty if nothing."""
        if self.infeasible_reason or self.compute(pi[None]).feasible[0]:
            return self.infeasible_reason
        speed = self.find_speed(pi[None])
        if speed[0] > self.speeds[-1]:
            return f"the tip must strike with {speed[0]:.3g} m/s, the joints' limits allow {self.speeds[-1]:.3g} m/s"
        loads = self._interpolate(
            speed, pi[None], lambda node, one: tuple(self._motions[node].compute_joint_loads(one))
        )
        worst = int(np.argmax(loads))
        (_, _, load) = self._interpolate(speed, pi[None], lambda node, one: self._motions[node].compute_load(one))
        return f"{self._joint_names[worst]} must bear {load[0]:.3g} times its torque limit"

    def find_greatest_depth(self, pi: Array) -> float:
        """Finds how deep the nail can be driven at most with a tool of inertial parameters pi, (10,), [m].

        Returns: A depth up to the one that is asked for; the one it is set to if no blow can be dealt.
        """
        nail = self.hammer.nail
        low, high = nail.depth_set, nail.depth_demanded
        if self.compute(pi[None]).feasible[0]:
            return high
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            feasible = self.compute(pi[None], nail.stiffness * middle).feasible[0]
            low, high = (middle, high) if feasible else (low, middle)
        return low

    def plan(
        self, model: ArmModel, pi: Array, settings: Settings, force: float | None = None, nail: Nail | None = None
    ) -> Strike:
        """Plans the blow with a tool of known inertia.

        Args:
            model: The arm; its state is set.
            pi: Its inertial parameters about To, expressed in T, shape (10,).
            settings: Those of the controller.
            force: Peak resistance, at most the one that is asked for, [N]; that if None.
            nail: What stands there in truth; the one that is asked for if None.

        Raises:
            AffordanceError: No swing is fast enough.
        """
        if self.infeasible_reason:
            raise AffordanceError(self.infeasible_reason)
        speed = float(self.find_speed(pi[None], force)[0])
        if speed > self.speeds[-1]:
            raise AffordanceError(
                f"the blow needs a tip speed of {speed:.3g} m/s, the joints' limits allow {self.speeds[-1]:.3g} m/s"
            )
        speed = max(speed, float(self.speeds[0]))
        swing = self._plan_swing(model, speed, int(np.searchsorted(self.speeds, speed)))
        placement = NailPlacement(nail or self.hammer.nail, self.target.p_WS, self.target.direction_W)
        return Strike(swing, placement, settings.control_period)

    def _plan_swing(self, model: ArmModel, speed: float, near: int) -> Swing:
        """Plans a swing from one that is planned already, or if that leads nowhere or there is none, from home."""
        if 0 <= near < len(self.swings):
            with contextlib.suppress(AffordanceError):
                return plan_swing(
                    model, self.target, speed=speed, duration=self.hammer.duration, guess=self.swings[near]
                )
        return plan_swing(model, self.target, speed=speed, duration=self.hammer.duration)

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


def _sample_swing(swing: Swing, control_period: float) -> PlannedMotion:
    """The swing in ticks, with the mean acceleration of each."""
    times: Array = control_period * np.arange(round(swing.duration / control_period) + 1.0)
    q, v, _ = swing.evaluate(times)
    return PlannedMotion(control_period, q[:-1], v[:-1], np.diff(v, axis=0) / control_period)
