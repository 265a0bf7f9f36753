"""``affordance excite``: designs a motion from which a payload can be identified accurately."""

import argparse
from collections.abc import Iterator

import numpy as np
import yaml

from affordance.arguments import check_number, check_whole
from affordance.arrays import Array
from affordance.commands import answers, options
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError
from affordance.extensions.payload.excitation.expectation import Aim, Expectation, Spread, find_errors
from affordance.extensions.payload.excitation.more_motion import USUAL_ACCELERATION
from affordance.extensions.payload.excitation.motion_design import MotionDesign, NoMotionError, design_motion
from affordance.extensions.payload.excitation.planned_motion import (
    FourierFamily,
    MotionFamily,
    MotionLimits,
    PostureFamily,
    compute_lowest,
    plan_way,
)
from affordance.extensions.payload.recording.preparation import PreparedRun
from affordance.extensions.payload.settings import SignalKind
from affordance.files.atomic import write_text
from affordance.files.constraints import Whole
from affordance.plant.serial_chain import SerialChain
from affordance.reporting.formatting import break_line
from affordance.robot import Robot

# Mass error that does not average out over time, [kg], and the ratio up to which an SD counts as close to it.
_FLOOR, _NEAR_FLOOR = 0.01, 1.2
# Bounds of options, with their units.
_BOUNDS = {
    "seconds": (1.0, 120.0, "s"),
    "mass": (0.02, 100.0, "kg"),
    "acceleration": (0.05, 100.0, "rad/s^2"),
    "tip-speed": (0.01, 20.0, "m/s"),
    "reach": (0.05, np.pi, "rad"),
    "above": (-5.0, 5.0, "m"),
}
_POSTURES = Whole(1, 50)
_NAME = "excite"
_SECOND = 1_000_000_000  # [ns]


def run(arguments: argparse.Namespace) -> int:
    """Designs the motion, prints the predicted precision, and writes the motion to files."""
    _check(arguments)
    robot = options.open_robot(arguments)
    given, num = np.array(arguments.acceleration), len(robot.joint_names)
    if len(given) not in (0, 1, num):
        raise BadValueError(
            "--acceleration", "", f"has {len(given)} numbers, must have 1, or one for each of {num} joints"
        )
    chain = robot.chain
    acceleration = _limit_acceleration(chain, given)
    expectation, aim = _expect(arguments, robot), Aim(arguments.aim)
    limits = MotionLimits.around(
        robot.home,
        robot.limits._replace(v_max=np.minimum(robot.limits.v_max, chain.velocity_limits)),
        reach=arguments.reach,
        acceleration=acceleration,
        tip_speed=arguments.tip_speed,
        height=arguments.above,
    )
    seconds, postures = arguments.seconds, arguments.postures
    family: MotionFamily = (
        FourierFamily(chain, limits, seconds) if postures is None else PostureFamily(chain, limits, seconds, postures)
    )
    try:
        design, spread = design_motion(expectation, family, aim, home=robot.home, seed=arguments.seed)
    except NoMotionError as error:
        advice = "choose more seconds, fewer postures, a lighter load, or a smaller --above"
        raise BadValueError("--seconds", "", f"is {seconds:g}: {error}; {advice}") from error
    way = plan_way(chain, limits, robot.home, design.motion.q[0])
    lines, width = list(_describe(arguments, robot, aim, design, spread, way, acceleration)), find_width()
    content = {
        "for": arguments.aim,
        "predicted_sd": {"mass_g": 1e3 * spread.mass, "com_mm": 1e3 * spread.com, "inertia_kg_m2": spread.inertia},
        "typical_over_this": design.typical / design.score,
        "floor_g": 1e3 * _FLOOR,
        "seconds": seconds,
        "postures": postures,
        "acceleration_limits": dict(zip(robot.joint_names, acceleration.tolist(), strict=True)),
        "start": dict(zip(robot.joint_names, design.motion.q[0], strict=True)),
        "sentence": "\n".join(lines),
    }
    if arguments.out is not None:
        write_text(arguments.out / "motion.csv", format_csv(design.motion))
        write_text(arguments.out / "trajectory.yaml", format_trajectory(robot.joint_names, design.motion))
        there = plan_way(chain, limits, robot.home, design.motion.q[0])
        back = plan_way(chain, limits, design.motion.q[-1], robot.home)
        write_text(arguments.out / "to_start.yaml", format_trajectory(robot.joint_names, there))
        write_text(arguments.out / "back_home.yaml", format_trajectory(robot.joint_names, back))
    text = "\n".join(part for line in lines for part in break_line(line, width))
    answers.give_answer(arguments, _NAME, text, content)
    return 0


def _limit_acceleration(chain: SerialChain, given: Array) -> Array:
    """Returns the acceleration limits, (n,), [rad/s^2].

    Given limits are reduced to the limits in the robot's file. By default, the file's limits are used, or the usual
    limit for joints without one.
    """
    usual = np.where(np.isfinite(chain.acceleration_limits), chain.acceleration_limits, USUAL_ACCELERATION)
    return np.minimum(given, chain.acceleration_limits) if len(given) else usual


def format_csv(motion: PreparedRun) -> str:
    """Formats a motion as CSV, with the columns of a recording."""
    n = motion.q.shape[1]
    head = ["time", *(f"{name}_{j + 1}" for name in ("q", "v", "vdot") for j in range(n))]
    rows = np.column_stack([motion.times, *motion.motion])
    return "\n".join([",".join(head), *(",".join(f"{value:.6f}" for value in row) for row in rows)]) + "\n"


def format_trajectory(joint_names: tuple[str, ...], motion: PreparedRun) -> str:
    """Formats a motion as a trajectory_msgs/JointTrajectory message in YAML."""

    def show(values: Array) -> list[float]:
        return [round(float(value), 6) for value in values]

    points = []
    for t, q, v, vdot in zip(motion.times, *motion.motion, strict=True):
        nanoseconds = round(1e9 * float(t))
        point = {"positions": show(q), "velocities": show(v), "accelerations": show(vdot)}
        time = {"sec": nanoseconds // _SECOND, "nanosec": nanoseconds % _SECOND}
        points.append({**point, "time_from_start": time})
    message = {"joint_names": list(joint_names), "points": points}
    return str(yaml.safe_dump(message, sort_keys=False, default_flow_style=None, width=1000))


def _check(arguments: argparse.Namespace) -> None:
    options.check_bounds(arguments)
    if arguments.postures is not None:
        check_whole("--postures", arguments.postures, _POSTURES)
    for name, bounds in _BOUNDS.items():
        value = getattr(arguments, name.replace("-", "_"))
        for each in value if isinstance(value, list) else [value]:
            check_number(f"--{name}", each, *bounds)


def _expect(arguments: argparse.Namespace, robot: Robot) -> Expectation:
    """Builds the model that predicts the precision, from gains, torque errors and the assumed load.

    Raises:
        BadValueError: A joint has no effort limit, and no gains file contains its error.
    """
    chain = robot.chain
    gains, density = find_errors(chain.joint_names, robot.limits.tau_max, SignalKind.JOINT_TORQUE, arguments.gains)
    known = np.isfinite(density) & (density > 0.0)
    if not known.all():
        name = chain.joint_names[int(np.argmin(known))]
        raise BadValueError(
            robot.directives, name, "has no effort limit, must have one, or its errors must be given with --gains"
        )
    return Expectation.of_load(chain, gains, density, mass=arguments.mass, floor=_FLOOR)


def _describe(
    arguments: argparse.Namespace,
    robot: Robot,
    aim: Aim,
    design: MotionDesign,
    spread: Spread,
    way: PreparedRun,
    acceleration: Array,
) -> Iterator[str]:
    """Describes the motion and its predicted precision, one line at a time."""
    of = {Aim.MASS: "the mass", Aim.COM: "the centre of mass", Aim.INERTIA: "the moments of inertia"}
    form = "Fourier motion" if arguments.postures is None else f"Visit of {arguments.postures} postures"
    yield f"{form}, {arguments.seconds:g} s, to identify {of[aim]} with {robot.name}"
    yield (
        f"Predicted standard deviations: mass {1e3 * spread.mass:.0f} g, centre of mass {1e3 * spread.com:.1f} mm, "
        f"moments of inertia {spread.inertia:.2g} kg m^2"
    )
    yield (
        f"The median of random motions within the same limits has an SD {design.typical / design.score:.1f} times as "
        f"large; a mass error of {1e3 * _FLOOR:g} g remains however long the motion is"
    )
    if spread.mass <= _NEAR_FLOOR * _FLOOR:
        yield f"The SD of the mass is within a factor of {_NEAR_FLOOR:g} of that error: longer motions help little"
    angles = zip(robot.joint_names, design.motion.q[0], strict=True)
    yield f"Start at rest at {', '.join(f'{name} {angle:.3f}' for name, angle in angles)} rad"
    lowest = compute_lowest(robot.chain, robot.home, design.motion.q[[0, -1]])
    yield (
        f"From home, a straight path in joint space takes {way.times[-1]:.1f} s; the tip stays above {lowest:.2f} m "
        "(to_start.yaml and back_home.yaml in --out)"
    )
    height = float(robot.chain.compute_positions(robot.home[None], np.zeros(3))[0, 2])
    if height < arguments.above:
        yield f"The tip at home is at {height:.2f} m, below --above {arguments.above:g} m: so are ends of the ways"
    most = zip(robot.joint_names, acceleration, strict=True)
    yield f"Accelerations within {', '.join(f'{name} {limit:g}' for name, limit in most)} rad/s^2"
    yield "Run it with an empty hand, then with the load; record from one second before to one second after"
    assumed = "Assumed: errors typical of arms with similar effort limits"
    yield assumed if arguments.gains is None else f"Errors and gains come from {arguments.gains}"
    yield "Not checked: collisions, with itself or anything else; try it slowly first (limits: --reach, --above)"
