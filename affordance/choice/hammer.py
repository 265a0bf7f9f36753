"""Task of driving a nail with a demanded peak force.

Frames are the world W and the tool T. S is the striking point on the tool's surface.
"""

import contextlib
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator
from pydrake.math import RotationMatrix

from affordance.arrays import Array
from affordance.choice.blow_cost import AIM, BlowCost
from affordance.choice.motion_cost import MotionCost, PlannedMotion
from affordance.choice.options import Option
from affordance.control.strike import Strike
from affordance.control.swing import ALONG, HAND, Swing, Target, find_target, plan_swing
from affordance.control.task import Start, StartEntry
from affordance.exceptions import AffordanceError
from affordance.files.constraints import StrPath, Vector, Within, check_path, complain
from affordance.files.data_model import DataModel, load_model
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.objects.tool import PosedShape
from affordance.plant.arm_model import ArmModel
from affordance.plant.contact import ContactFace, EffectiveMass
from affordance.plant.nail import Nail, NailEntry, NailPlacement
from affordance.settings import Settings

# Swings are planned at tip speeds that increase by the larger of a constant, [m/s], and a fraction of the speed. The
# interpolation error of the costs is below 0.5 % (tests/choice/test_hammer.py). Intermediate speeds are added if a
# slow arm has fewer speeds than the last number.
_SPEED_STEP, _SPEED_GROWTH, _FEWEST_SPEEDS = 0.125, 0.06, 16
# Minimum length of a vector that defines a direction, and minimum distance to a nail's head for a swing, [m].
_MIN_LENGTH = 0.01
# Time of a swing from rest to the strike, [s].
_DURATION = Within(0.2, 10.0)
# Easier blows: factors on the duration of the swing, and on the increase in depth.
_EASIER_PACES, _EASIER_DEPTHS = (1.5, 2.0), (0.75, 0.5, 0.25)
# Number of joints needed to bring a face to a position (three) and square to a direction (two).
_FEWEST_JOINTS = 5
# Rolls that are proposed for a grip whose face points the wrong way, [degrees]; names of the positive and negative
# directions of each world axis.
_ROLLS = (180, 90, -90)
_DIRECTIONS = (("ahead", "back"), ("left", "right"), ("up", "down"))
# Number of samples of a swing at which angles and rates are compared with the limits.
_NUM_CHECKED = 50


@dataclass(frozen=True)
class Hammer:
    """Task of driving a nail until its resistance reaches a demanded peak.

    Attributes:
        nail: Nail to be driven.
        offset: Position of the nail's head relative to the striking point at the start, in the world frame W, [m].
        direction: Unit vector of the direction in which the nail is driven, in W.
        duration: Duration of the swing from rest to the strike, [s].
        force: Demanded peak resistance, [N].
        start: Start angles, [rad], of joints that do not start at their home angles.

    Example:
        >>> from affordance import MODELS, load_hammer
        >>> task = load_hammer(MODELS / "nail.yaml")
        >>> f"{task.force:.0f} N in {task.duration} s"
        '427 N in 0.8 s'
    """

    nail: Nail
    offset: tuple[float, float, float]
    direction: tuple[float, float, float]
    duration: float
    force: float
    start: Start = ()

    def list_easier(self) -> "Iterator[tuple[Hammer, str]]":
        """Yields easier tasks, with slower swings or shallower nails, and their descriptions."""
        for pace in _EASIER_PACES:
            if self.duration * pace > _DURATION.high:
                break
            yield replace(self, duration=self.duration * pace), f"{pace:g} times slower"
        for share in _EASIER_DEPTHS:
            depth = self.nail.depth_set + share * (self.nail.depth_demanded - self.nail.depth_set)
            nail = replace(self.nail, depth_demanded=depth)
            yield replace(self, nail=nail, force=nail.force_demanded), f"to a depth of {1e3 * depth:.3g} mm"

    def find_target(self, model: ArmModel, parts: Sequence[PosedShape]) -> Target:
        """Finds striking point and position of the nail for a tool.

        Args:
            model: Model of the arm; its state is changed.
            parts: Parts of the tool, posed relative to the hand.

        Raises:
            AffordanceError: The start posture has an unknown joint or violates joint limits.
        """
        return find_target(
            model,
            parts,
            q_start=model.arm.find_posture(dict(self.start)),
            offset_W=np.array(self.offset),
            direction_W=np.array(self.direction),
        )

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> BlowCost:
        """Plans swings at increasing tip speeds, and returns the cost of the blow as a function of inertia.

        The swings do not depend on the tool's inertia. The highest speed is the speed that a massless tool requires.
        If no swing is possible, the result contains the reason.

        Args:
            model: Model of the arm; its state and payload are changed.
            parts: Parts of the tool, posed relative to the hand.
            settings: Settings of the controller.
        """
        target = self.find_target(model, parts)
        swings, infeasible_reason = dict[float, Swing](), "the face is in the hand in this grip"
        if target.p_TS[0] > HAND or not any(part.strikes for part in parts):
            swings, infeasible_reason = _plan_swings(model, target, self)
        period, measure = settings.control_period, settings.cost_measure
        return BlowCost(
            nail=self.nail,
            force=self.force,
            target=target,
            swings=tuple(swings.values()),
            speeds=np.array(list(swings)),
            masses=tuple(_build_effective_mass(model, target, swing) for swing in swings.values()),
            motions=tuple(MotionCost(model, sample_swing(each, period), measure=measure) for each in swings.values()),
            joint_names=tuple(model.arm.joint_names),
            infeasible_reason=infeasible_reason,
        )


class _BlowEntry(DataModel):
    """Entry of a blow in a file."""

    offset: Annotated[
        Annotated[tuple[float, float, float], Vector(3, Within(-2.0, 2.0))],
        Field(description="Position of the nail's head relative to the striking point at the start, [m]."),
    ]
    direction: Annotated[
        Annotated[tuple[float, float, float], Vector(3, Within(-1.0, 1.0))],
        Field(description="Direction in which the nail is driven."),
    ]
    duration: Annotated[float, _DURATION, Field(description="Time from rest to the strike, [s].")]
    start: StartEntry = Field(default_factory=dict)

    @model_validator(mode="after")
    def check_place(self) -> Self:
        """Checks that the direction is not zero, and that the blow starts far enough in front of the nail."""
        direction = np.array(self.direction)
        length = float(np.linalg.norm(direction))
        if length < _MIN_LENGTH:
            raise complain(f"has a length of {length:g}, must be at least {_MIN_LENGTH:g}", "direction")
        ahead = float(np.array(self.offset) @ direction) / length
        if ahead < _MIN_LENGTH:  # the tool would have to pass through the nail
            problem = f"puts the head {ahead:.3g} m ahead of the tool's point along the blow"
            raise complain(f"{problem}, must be at least {_MIN_LENGTH:g} m", "offset")
        return self


class HammerEntry(NailEntry):
    """Entry of a hammering task in a file: a nail and a blow."""

    blow: _BlowEntry

    def build_task(self) -> Hammer:
        """Builds the hammering task."""
        nail, direction = self.build(), np.array(self.blow.direction)
        a, b, c = (float(value) for value in direction / float(np.linalg.norm(direction)))
        start = tuple(self.blow.start.items())
        return Hammer(nail, self.blow.offset, (a, b, c), self.blow.duration, nail.force_demanded, start)


def keep_strikers(options: Sequence[Option]) -> list[Option]:
    """Selects options with a striking face, or all options if no tool has one, such as the tools of the paper."""
    kept = [option for option in options if any(part.strikes for part in option.features)]
    return kept or list(options)


def load_hammer(path: StrPath) -> Hammer:
    """Loads a hammering task from a file with a nail and, under ``blow``, its position and the swing.

    Raises:
        BadValueError: The file or one of its values is invalid. The message contains file, key and reason.
    """
    return load_model(check_path("path", path), HammerEntry).build_task()


def _plan_swings(model: ArmModel, target: Target, hammer: Hammer) -> tuple[dict[float, Swing], str]:
    """Plans swings at increasing tip speeds, [m/s], and adds intermediate speeds if few succeed.

    Returns:
        Swings by tip speed, and the reason if there is no swing.
    """
    swings: dict[float, Swing] = {}
    speed, fastest, infeasible_reason = 0.0, _SPEED_STEP, ""
    while speed < fastest:
        guess = swings.get(speed)
        speed += max(_SPEED_STEP, _SPEED_GROWTH * speed)
        try:
            swings[speed] = find_swing(model, target, hammer, speed, guess)
        except AffordanceError as error:
            infeasible_reason = "" if swings else f"{error}: {_explain_no_swing(model, target, hammer, speed)}"
            break
        # A tool can only increase the effective mass, so this is the highest speed that any tool requires.
        (least_mass,) = _build_effective_mass(model, target, swings[speed]).compute(np.zeros((1, NUM_PARAMETERS)))
        fastest = float(hammer.nail.compute_tip_speed(np.array(AIM * hammer.force), least_mass))
    added = len(swings)
    while added and len(swings) < _FEWEST_SPEEDS:
        known = [0.0, *sorted(swings)]
        known.append(2.0 * known[-1] - known[-2])  # half a step beyond the last speed may still be possible
        for low, high in itertools.pairwise(known):
            middle, guess = 0.5 * (low + high), swings[low or known[1]]
            with contextlib.suppress(AffordanceError):
                swings[middle] = find_swing(model, target, hammer, middle, guess)
        added = len(swings) + 2 - len(known)
    return dict(sorted(swings.items(), key=lambda each: each[0])), infeasible_reason


def _explain_no_swing(model: ArmModel, target: Target, hammer: Hammer, speed: float) -> str:
    """Explains why no swing was found: the face points the wrong way at the start, or a joint exceeds a limit.

    To find the joint, the swing is planned for an arm without limits of angle and rate.
    """
    if wrong_way := _describe_facing(model, target):
        return wrong_way
    arm = model.arm
    free = np.full(arm.num_joints, np.inf)
    unlimited = ArmModel(replace(arm, limits=arm.limits._replace(q_lower=-free, q_upper=free, v_max=free)))
    try:
        swing = plan_swing(unlimited, target, speed=speed, duration=hammer.duration)
    except AffordanceError:
        few = f", or {arm.num_joints} joints are too few" if arm.num_joints < _FEWEST_JOINTS else ""
        return f"nor does any swing without limits of angle and rate: the nail is out of reach{few}"
    q, v, _ = swing.evaluate(np.linspace(0.0, swing.duration, _NUM_CHECKED))
    beyond = np.maximum(arm.limits.q_lower - q, q - arm.limits.q_upper)
    row, joint = np.unravel_index(np.argmax(beyond), beyond.shape)
    name = arm.joint_names[int(joint)]
    if beyond[row, joint] > 0.0:
        low, high = arm.limits.q_lower[joint], arm.limits.q_upper[joint]
        return f"{name} would have to turn to {q[row, joint]:.3g} rad, its limits are {low:.3g} and {high:.3g} rad"
    rates = np.abs(v) / arm.limits.v_max
    row, joint = np.unravel_index(np.argmax(rates), rates.shape)
    name, limit = arm.joint_names[int(joint)], arm.limits.v_max[joint]
    return f"{name} would have to turn with {abs(v[row, joint]):.3g} rad/s, its limit is {limit:.3g} rad/s"


def _describe_facing(model: ArmModel, target: Target) -> str:
    """Describes the direction of a face that points the wrong way, and the roll of the grip that corrects it."""
    model.set_posture(target.q_start)
    R_WH, direction_W = model.compute_hand_pose().rotation().matrix(), target.direction_W
    normal_W = R_WH @ target.normal_T
    if direction_W @ normal_W > ALONG:
        return ""
    found = (
        f"the face points {_name_direction(normal_W)} in this grip, but the blow goes {_name_direction(direction_W)}"
    )
    # Rolling the grip about its x axis rotates the face in the hand by the opposite angle.
    turned = {roll: direction_W @ R_WH @ _turn_about_x(-roll) @ target.normal_T for roll in _ROLLS}
    roll = max(turned, key=lambda each: turned[each])
    if turned[roll] <= ALONG:
        return found
    return f"{found}; rpy_deg [{roll}, 0, 0] turns it (if the grip has a roll, add {roll})"


def _turn_about_x(degrees: float) -> Array:
    R: Array = RotationMatrix.MakeXRotation(np.radians(degrees)).matrix()
    return R


def _name_direction(direction_W: Array) -> str:
    """Returns the name of the world axis that is nearest to a direction."""
    axis = int(np.argmax(np.abs(direction_W)))
    return _DIRECTIONS[axis][0 if direction_W[axis] > 0.0 else 1]


def _build_effective_mass(model: ArmModel, target: Target, swing: Swing) -> EffectiveMass:
    return EffectiveMass(model, target.p_TS, target.direction_W, swing.q_end)


def plan_strike(
    planned: BlowCost,
    hammer: Hammer,
    model: ArmModel,
    pi: Array,
    settings: Settings,
) -> Strike:
    """Plans one blow with a tool.

    Args:
        planned: Swings at all planned tip speeds.
        hammer: Task.
        model: Model of the arm.
        pi: Parameters of the tool about To in T, (10,).
        settings: Settings of the controller.

    Raises:
        AffordanceError: No swing is fast enough.
    """
    if planned.infeasible_reason:
        raise AffordanceError(planned.infeasible_reason)
    speed = float(planned.compute_speed(pi[None])[0])
    if speed > planned.speeds[-1]:
        raise AffordanceError(
            f"the blow needs a tip speed of {speed:.3g} m/s, the joints' limits allow {planned.speeds[-1]:.3g} m/s"
        )
    speed = max(speed, float(planned.speeds[0]))
    swing = find_swing(model, planned.target, hammer, speed, planned.pick_swing(speed))
    target = planned.target
    face = ContactFace(target.p_TS, target.normal_T, target.radius)
    placement = NailPlacement(hammer.nail, target.p_WS, target.direction_W, face)
    return Strike(swing, placement, settings.control_period)


def find_swing(model: ArmModel, target: Target, hammer: Hammer, speed: float, guess: Swing | None) -> Swing:
    """Plans a swing with a given tip speed, [m/s].

    The search starts from a similar swing, if one is given. If that fails, it starts from scratch.

    Raises:
        AffordanceError: No swing within the limits of angle and rate strikes as demanded.
    """
    if guess is not None:
        with contextlib.suppress(AffordanceError):
            return plan_swing(model, target, speed=speed, duration=hammer.duration, guess=guess)
    return plan_swing(model, target, speed=speed, duration=hammer.duration)


def sample_swing(swing: Swing, control_period: float) -> PlannedMotion:
    """Samples a swing once per control period, with the mean acceleration over the period."""
    times: Array = control_period * np.arange(round(swing.duration / control_period) + 1.0)
    q, v, _ = swing.evaluate(times)
    return PlannedMotion(control_period, q[:-1], v[:-1], np.diff(v, axis=0) / control_period)
