"""Detection of joint data in a file that no joint can have.

Some of it aborts Drake, wherever in the robot it is. Readers therefore remove it from the text that Drake parses, and
it is reported only if it belongs to the arm.
"""

from collections.abc import Sequence


def find_joint_fault(
    *,
    lower: float | None = None,
    upper: float | None = None,
    velocity: float | None = None,
    damping: float = 0.0,
    rotor_inertia: float = 0.0,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    unit: str = "rad",
) -> str:
    """Describes the fault of a joint; empty for a valid joint.

    Args:
        lower: Least angle; None for no limit.
        upper: Largest angle; None for no limit.
        velocity: Largest rate, [rad/s]; None for no limit.
        damping: Damping, [N m s/rad].
        rotor_inertia: Reflected inertia of rotor and gears at the joint, [kg m^2].
        axis: Direction of the axis, (3,).
        unit: Unit of the angles, in words.
    """
    if lower is not None and upper is not None and lower > upper:
        return f"has position limits from {lower:g} to {upper:g} {unit}, must be a range"
    if velocity is not None and velocity < 0.0:
        return f"has a velocity limit of {velocity:g} rad/s, must be more than 0"
    if damping < 0.0:
        return f"has a damping of {damping:g} N m s/rad, must be at least 0"
    if rotor_inertia < 0.0:
        return f"has a rotor inertia of {rotor_inertia:g} kg m^2, must be at least 0"
    if not any(axis):
        return "has an axis of zero length, must have a direction"
    return ""
