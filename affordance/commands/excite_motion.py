"""Work of ``affordance excite``: reads what is known of arm and load, designs the motion, prints and writes it."""

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml

from affordance.arguments import check_number, check_whole
from affordance.arrays import Array
from affordance.choice.pricing import plan_options
from affordance.choice.tool_options import list_tool_options
from affordance.commands.options import change_by_name, check_bounds, choose_tools, read_options
from affordance.exceptions import AffordanceError, BadValueError, describe_choice, name_object
from affordance.files.atomic import to_plain, write_json, write_text
from affordance.files.constraints import Whole
from affordance.identification.evidence.gains import arrange_gains, build_nominal_gains, read_gains
from affordance.identification.evidence.model_error import build_phantom_covariance
from affordance.identification.excitation.expectation import Aim, Expectation, Spread
from affordance.identification.excitation.motion_design import MotionDesign, NoMotionError, design_motion
from affordance.identification.excitation.planned_motion import (
    FourierFamily,
    Limit,
    MotionFamily,
    MotionLimits,
    PostureFamily,
)
from affordance.identification.posterior.log_cholesky import theta_from_parameters
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.recording.preparation import PreparedRun
from affordance.identification.settings import DEFAULT_SETTINGS, SignalKind
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials
from affordance.robots.kept import open_robot
from affordance.robots.robot import Robot
from affordance.settings import Settings

# Errors of joint torques if no gains.yaml has them: root of the long-run density over the limit of torque,
# [sqrt(s)]. A Panda's joints have .0015 to .006, those of a UR10e .0008 to .0013.
_ERROR = 0.002
_NUM_BODIES, _MASS_SD = 4, 0.1  # bodies over which the prediction is averaged, and their relative spread in mass
_NEAR_FLOOR = 1.2
_LONGEST = 120.0
_POSTURES = Whole(1, 50)
_STEP = 1e-4  # of a difference by the ten parameters, relative to the body
_NAME = "excite"
_SECOND = 1_000_000_000  # [ns]


def run(arguments: argparse.Namespace) -> int:
    """Designs the motion, prints what it is predicted to show, and writes it."""
    _check(arguments)
    robot = open_robot(arguments.robot, read_options(arguments), (arguments.out or Path("results")) / "arms")
    expectation, limits, aim = _expect(arguments, robot), _limit(arguments, robot), _find_aim(arguments)
    chain, seconds, postures = robot.chain, arguments.seconds, arguments.postures
    family: MotionFamily = (
        FourierFamily(chain, limits, seconds) if postures is None else PostureFamily(chain, limits, seconds, postures)
    )
    try:
        design, spread = design_motion(expectation, family, aim, seed=arguments.seed)
    except NoMotionError as error:
        raise _blame(arguments, error) from error
    text = "\n".join(_describe(arguments, robot, aim, design, spread))
    content = {
        "for": arguments.aim,
        "predicted_sd": {"mass_g": 1e3 * spread.mass, "com_mm": 1e3 * spread.com, "inertia_kg_m2": spread.inertia},
        "typical_over_this": design.typical / design.score,
        "floor_g": arguments.floor,
        "seconds": seconds,
        "postures": postures,
        "start": dict(zip(robot.joint_names, design.motion.q[0], strict=True)),
        "sentence": text,
    }
    if aim is Aim.COST:
        content["predicted_sd"] |= {"cost_J": spread.cost}
    if arguments.out is not None:
        write_text(arguments.out / "motion.csv", format_csv(design.motion))
        write_text(arguments.out / "trajectory.yaml", format_trajectory(robot.joint_names, design.motion))
        write_json(arguments.out / f"{_NAME}.json", content)
        write_text(arguments.out / f"{_NAME}.txt", text + "\n")
    print(json.dumps(to_plain(content), indent=2) if arguments.json else text)
    return 0


def format_csv(motion: PreparedRun) -> str:
    """Formats a motion as a table with the columns of a run."""
    n = motion.q.shape[1]
    head = ["time", *(f"{name}_{j + 1}" for name in ("q", "v", "vdot") for j in range(n))]
    rows = np.column_stack([motion.times, *motion.motion])
    return "\n".join([",".join(head), *(",".join(f"{value:.6f}" for value in row) for row in rows)]) + "\n"


def format_trajectory(joint_names: tuple[str, ...], motion: PreparedRun) -> str:
    """Formats a motion as a message trajectory_msgs/JointTrajectory in YAML."""

    def show(values: Array) -> list[float]:
        return [round(float(value), 6) for value in values]

    points = []
    for t, q, v, vdot in zip(motion.times, *motion.motion, strict=True):
        nanoseconds = round(1e9 * float(t))
        points.append(
            {
                "positions": show(q),
                "velocities": show(v),
                "accelerations": show(vdot),
                "time_from_start": {"sec": nanoseconds // _SECOND, "nanosec": nanoseconds % _SECOND},
            }
        )
    message = {"joint_names": list(joint_names), "points": points}
    return str(yaml.safe_dump(message, sort_keys=False, default_flow_style=None, width=1000))


def _check(arguments: argparse.Namespace) -> None:
    check_bounds(arguments)
    check_number("--seconds", arguments.seconds, 1.0, _LONGEST, "s")
    if arguments.postures is not None:
        check_whole("--postures", arguments.postures, _POSTURES)
    check_number("--mass", arguments.mass, 0.02, 100.0, "kg")
    check_number("--floor", arguments.floor, 0.0, 1e4, "g")
    check_number("--acceleration", arguments.acceleration, 0.05, 100.0, "rad/s^2")
    check_number("--tip-speed", arguments.tip_speed, 0.01, 20.0, "m/s")
    check_number("--reach", arguments.reach, 0.05, np.pi, "rad")
    if arguments.above is not None:
        check_number("--above", arguments.above, -5.0, 5.0, "m")


def _blame(arguments: argparse.Namespace, error: NoMotionError) -> BadValueError:
    """Returns the error of the option by which no motion keeps the limits."""
    if error.limit is Limit.HEIGHT:
        return BadValueError("--above", "", f"is {arguments.above:g} m: {error}; a smaller height")
    if error.limit is not Limit.TORQUE:
        return BadValueError("--seconds", "", f"is {arguments.seconds:g}: {error}; more seconds, or fewer postures")
    if _find_aim(arguments) is Aim.COST:
        return BadValueError("--for", "", f"is {arguments.aim}: with the tool {error}; a lighter tool")
    return BadValueError("--mass", "", f"is {arguments.mass:g} kg: {error}; a lighter load")


def _find_aim(arguments: argparse.Namespace) -> Aim:
    measured = [each.value for each in Aim if each is not Aim.COST]
    return Aim(arguments.aim) if arguments.aim in measured else Aim.COST


def _limit(arguments: argparse.Namespace, robot: Robot) -> MotionLimits:
    limits, home, reach = robot.limits, robot.home, arguments.reach
    return MotionLimits(
        np.maximum(limits.q_lower, home - reach),
        np.minimum(limits.q_upper, home + reach),
        limits.v_max,
        np.full(len(home), arguments.acceleration),
        limits.tau_max,
        arguments.tip_speed,
        -np.inf if arguments.above is None else arguments.above,
    )


def _expect(arguments: argparse.Namespace, robot: Robot) -> Expectation:
    """Collects what is known of gains, errors and load; raises a BadValueError for an unknown aim."""
    chain, settings = robot.chain, DEFAULT_SETTINGS
    if arguments.gains is not None:
        gains = arrange_gains(read_gains(arguments.gains), chain.joint_names, arguments.gains).with_drift(settings)
        density = gains.least_variance / settings.max_rate
    else:
        gains = build_nominal_gains(chain.joint_names, SignalKind(arguments.signal), settings)
        density = (_ERROR * robot.limits.tau_max) ** 2
    if not (np.isfinite(density) & (density > 0.0)).all():
        name = chain.joint_names[int(np.argmin(np.isfinite(density) & (density > 0.0)))]
        raise BadValueError(robot.directives, name, "has no limit of torque, must have one, or --gains its errors")
    rng = np.random.default_rng(0)
    bodies = SolidPrior.for_hand().with_mass(arguments.mass, _MASS_SD * arguments.mass).draw_theta(rng, _NUM_BODIES)
    known = Expectation(chain, gains, density, bodies, build_phantom_covariance(1e-3 * arguments.floor))
    if _find_aim(arguments) is not Aim.COST:
        return known
    if arguments.aim not in robot.tasks:
        names = [*(each.value for each in Aim if each is not Aim.COST), *robot.tasks]
        raise BadValueError("--for", "", describe_choice(arguments.aim, names))
    pi, slope = _differentiate(arguments, robot)
    return replace(known, bodies=theta_from_parameters(pi)[None], slope=slope)


def _differentiate(arguments: argparse.Namespace, robot: Robot) -> tuple[Array, Array]:
    """Computes the parameters of the tool of a task, and the derivative of its cost by them, shape (10,) each."""
    materials = load_materials(robot.folder / MATERIALS.name)
    tools = load_tools(arguments.tools, materials)
    tool, *_ = choose_tools(tools, [arguments.only] if arguments.only else [], arguments.tools)
    options = list_tool_options([tool], by_sight=False, seed=arguments.seed)[:1]
    settings = change_by_name(arguments, Settings(arm=robot.directives))
    choice = plan_options(options, robot.load_task(arguments.aim), settings)
    pi = next(iter(tool.list_gripped().values())).parameters
    scale = _STEP * np.linalg.norm(pi)
    cost = choice.compute_costs(np.concatenate([pi + scale * np.eye(10), pi - scale * np.eye(10)])[None]).cost[0]
    if not np.isfinite(cost).all():
        reason = choice.cost_models[0].infeasible_reason or "its cost is infinite"
        raise AffordanceError(f"{arguments.aim} cannot be done with {name_object(tool.name)}: {reason}")
    return pi, (cost[:10] - cost[10:]) / (2.0 * scale)


def _describe(
    arguments: argparse.Namespace, robot: Robot, aim: Aim, design: MotionDesign, spread: Spread
) -> Iterator[str]:
    """Describes what the motion is predicted to show, a line each."""
    of = {Aim.MASS: "the mass", Aim.COM: "the centre of mass", Aim.INERTIA: "the moments of inertia"}
    form = "Fourier motion" if arguments.postures is None else f"visit of {arguments.postures} postures"
    yield f"{form} of {arguments.seconds:g} s for {of.get(aim, f'the cost of {arguments.aim}')}, {robot.name}"
    cost = f", cost {spread.cost:.2g} J" if aim is Aim.COST else ""
    yield (
        f"predicted standard deviations: mass {1e3 * spread.mass:.0f} g, centre of mass {1e3 * spread.com:.1f} mm, "
        f"moments of inertia {spread.inertia:.2g} kg m^2{cost}"
    )
    yield (
        f"a random motion within the same limits has {design.typical / design.score:.1f} times that in the median; "
        f"{arguments.floor:g} g no motion averages out"
    )
    if spread.mass <= _NEAR_FLOOR * 1e-3 * arguments.floor:
        yield f"the mass is within {_NEAR_FLOOR:g} times of that: longer motions bring little"
    angles = zip(robot.joint_names, design.motion.q[0], strict=True)
    yield f"start at rest at {', '.join(f'{name} {angle:.3f}' for name, angle in angles)} rad"
    yield "run it with an empty hand, then with the load; record from a second before to a second after"
    yield (
        "assumed: errors as of arms with like limits of torque"
        if arguments.gains is None
        else (f"errors and gains by {arguments.gains}")
    )
    yield "not checked: collisions, with itself or anything else; watch it slowly first (--reach and --above confine)"
