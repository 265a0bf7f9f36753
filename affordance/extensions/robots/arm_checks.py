"""Checks the links and joints of an arm, and reports all faults in one message with options that fix them."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from pydrake.multibody.tree import Joint, RevoluteJoint, RigidBody
from pydrake.systems.framework import Context

from affordance.exceptions import BadValueError
from affordance.extensions.robots.chain import FEWEST_JOINTS, Chain
from affordance.extensions.robots.description import JointNotes
from affordance.extensions.robots.tree import RobotTree

# Fraction of the arm's mass, and of its largest moment of inertia about the base, below which an impossible inertia
# of a link is negligible.
_HARDLY = 0.01
# Verbs at the beginning of a problem, with their singular and plural; other problems use "does" and "do".
_VERBS = {"has": ("has", "have"), "is": ("is", "are")}
_NUMBER = re.compile(r"(?<![\w^])-?\d[\d.]*(e[-+]?\d+)?")


class _Fault(NamedTuple):
    element: str  # ``joint`` or ``link``
    name: str
    problem: str
    way_out: str = ""  # options that fix it; empty without any


class JointLimits(NamedTuple):
    """Limits of a joint, from the user or the file."""

    effort: float | None  # torque limit, [N m]; None without a limit
    velocity: float  # [rad/s]
    damping: float  # [N m s/rad]
    rotor_inertia: float  # [kg m^2]


def find_limits(
    joint: RevoluteJoint,
    notes: JointNotes,
    given: Mapping[str, Mapping[str, float]],
    *,
    has_damping: bool,
) -> JointLimits:
    """Combines the user's limits of a joint with the file's limits. The user's limits take precedence.

    ``given`` maps the kind of limit to values by joint name. The empty name applies to every joint.
    """
    name = joint.name()

    def find(kind: str) -> float | None:
        return given[kind].get(name, given[kind].get(""))

    effort, velocity, rotor = find("effort"), find("velocity"), find("rotor_inertia")
    of_file = float(joint.velocity_upper_limits()[0]) if notes.velocity is None else notes.velocity
    damping = notes.damping or float(joint.default_damping())
    return JointLimits(
        effort=notes.effort if effort is None else effort,
        velocity=of_file if velocity is None else velocity,
        damping=damping if has_damping else 0.0,
        rotor_inertia=notes.rotor_inertia if rotor is None else rotor,
    )


def check_arm(
    tree: RobotTree,
    chain: Chain,
    context: Context,
    groups: Sequence[Sequence[RigidBody]],
    limits: Mapping[str, JointLimits] | None = None,
    *,
    mends: bool = False,
    carries: bool = False,
) -> tuple[str, ...]:
    """Checks the moving links of an arm, and its joints if limits are given.

    Negligible impossible inertias are replaced with the nearest possible inertias. All faults are reported in one
    error.

    Args:
        tree: Robot.
        chain: Joints of the arm.
        context: Context of the robot's plant.
        groups: Bodies that move with each joint.
        limits: Limits of each joint; None to check the links only.
        mends: True to replace all impossible inertias, except if the mass is negative.
        carries: True to accept links whose weight the simulator compensates (gravcomp).

    Returns: Names of the links with replaced inertias.

    Raises:
        BadValueError: A link or joint has a fault.
    """
    bodies = [body for group in groups for body in group]
    heavy = [body for body in bodies if tree.key(body) in tree.description.mended]
    # Replacing a negative mass would change the arm's weight.
    heavy = [body for body in heavy if not mends or tree.description.mended[tree.key(body)][1].mass < 0.0]
    heavy = [body for body in heavy if _matters(tree, chain, context, bodies, body)]
    faults = [*_list_link_faults(tree, bodies, heavy, carries=carries)]
    if not faults and not sum(body.default_mass() for body in bodies) > 0.0:
        another = "another file of this robot, such as one for a simulator, may have them"
        faults.append(_Fault("", "", "has no mass for any link of the arm, must have inertias (<inertial>)", another))
    if limits is not None:
        faults += [fault for joint in chain.joints for fault in _list_joint_faults(tree, chain, joint, limits)]
    if faults:
        raise _describe(tree, faults)
    return tuple(tree.key(body) for body in bodies if tree.key(body) in tree.description.mended)


def _matters(tree: RobotTree, chain: Chain, context: Context, bodies: Sequence[RigidBody], body: RigidBody) -> bool:
    """Returns True if a link's impossible inertia is not negligible in the arm."""
    written = tree.description.mended[tree.key(body)][1]
    solid = [each.index() for each in bodies if each.default_mass() > 0.0]
    if not solid:
        return True
    total = tree.plant.CalcSpatialInertia(context, chain.base.body_frame(), solid)
    largest = float(total.CalcRotationalInertia().get_moments().max())
    return (
        not 0.0 < written.mass <= _HARDLY * float(total.get_mass())  # without a stated mass, the true mass is unknown
        or float(np.abs(written.moments).max()) > _HARDLY * largest
    )


def _list_link_faults(
    tree: RobotTree, bodies: Sequence[RigidBody], heavy: Sequence[RigidBody], *, carries: bool
) -> Iterator[_Fault]:
    for body in bodies:
        if fault := tree.description.faults.get(tree.key(body)):
            yield _Fault("link", body.name(), f"{fault}; it is part of the arm")
    for body in heavy:
        fault, written = tree.description.mended[tree.key(body)]
        way_out = "--mend-inertia of import-arm uses the nearest possible one"
        if written.mass <= 0.0:
            way_out = "--mend-inertia of import-arm treats it as massless" if written.mass == 0.0 else ""
        yield _Fault("link", body.name(), f"{fault}; it is part of the arm", way_out)
    for body in bodies if not carries else ():
        if share := tree.description.carried.get(tree.key(body)):
            problem = f"has a gravcomp of {share:g}: MuJoCo carries its weight, but the motors must carry it"
            yield _Fault("link", body.name(), problem, "--gravcomp none ignores gravcomp")


def _list_joint_faults(
    tree: RobotTree, chain: Chain, joint: Joint, limits: Mapping[str, JointLimits]
) -> Iterator[_Fault]:
    name, of_joint = joint.name(), limits[joint.name()]
    if fault := tree.note(joint).fault:
        yield _Fault("joint", name, fault)
        return
    low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
    if not low < high:
        yield _Fault("joint", name, f"has position limits from {low:g} to {high:g} rad, must be a range")
    if of_joint.effort is None or not of_joint.effort > 0.0:
        found = "has no torque limit (effort), must have one of more than 0 N m"
        if of_joint.effort is not None:
            found = f"has a torque limit (effort) of {of_joint.effort:g} N m, must be more than 0"
        lacking = [k for k, each in enumerate(chain.joints) if not (limits[each.name()].effort or 0.0) > 0.0]
        yield _Fault("joint", name, found, _suggest("--effort", "limits (N m)", chain, lacking))
    if not of_joint.velocity > 0.0:
        found = f"has a velocity limit of {of_joint.velocity:g} rad/s, must be more than 0"
        slow = [k for k, each in enumerate(chain.joints) if not limits[each.name()].velocity > 0.0]
        yield _Fault("joint", name, found, _suggest("--velocity", "limits (rad/s)", chain, slow))
    if of_joint.damping < 0.0:
        found = f"has a damping of {of_joint.damping:g} N m s/rad, must be at least 0"
        yield _Fault("joint", name, found, "--damping none omits damping")
    if of_joint.rotor_inertia < 0.0:
        found = f"has a rotor inertia of {of_joint.rotor_inertia:g} kg m^2, must be at least 0"
        yield _Fault("joint", name, found, f"--rotor-inertia {name}=VALUE sets it (kg m^2)")


def _suggest(option: str, unit: str, chain: Chain, lacking: Sequence[int]) -> str:
    """Suggests options that supply missing limits of joints, given by their indices on the chain."""
    names = [f"{chain.joints[k].name()}=VALUE" for k in lacking]
    given = "VALUE" if len(lacking) == len(chain.joints) else " ".join(names)
    ways = f"{option} {given} sets {unit}"
    below = len(chain.joints) - len(lacking)
    if list(lacking) == list(range(len(lacking))) and below >= FEWEST_JOINTS:
        ways += f", --base {chain.joints[lacking[-1]].child_body().name()} leaves out the joints below it"
    return ways


def gather(faults: Iterable[tuple[str, str, str, str]]) -> list[tuple[str, str, str]]:
    """Groups faults whose problems differ only in their numbers.

    A fault is a tuple of element, name, problem and remedy. The first fault of each group is returned, with the names
    of the others.
    """
    kinds: dict[tuple[str, str, str], list[tuple[str, str]]] = {}
    for element, name, problem, way_out in faults:
        kinds.setdefault((element, _NUMBER.sub("", problem), way_out), []).append((name, problem))
    found = []
    for (element, _, way_out), ((name, problem), *others) in kinds.items():
        verb = _VERBS.get(problem.split()[0], ("does", "do"))[len(others) > 1]
        names = ", ".join(other for other, _ in others)
        numbers = "" if all(text == problem for _, text in others) else ", with other numbers"
        also = f" (as {verb} {names}{numbers})" if others else ""
        found.append((f"{element} {name}".strip(), f"{problem}{also}", way_out))
    return found


def _describe(tree: RobotTree, faults: Sequence[_Fault]) -> BadValueError:
    """Combines all faults in one error message, grouped by kind, with options that fix them."""
    found = gather((fault.element, fault.name, fault.problem, fault.way_out) for fault in faults)
    parts = [(where, f"{problem}{f'; {way_out}' if way_out else ''}") for where, problem, way_out in found]
    (where, first), *others = parts
    return BadValueError(
        tree.description.path, where, "; ".join([first, *(": ".join(filter(None, each)) for each in others)])
    )
