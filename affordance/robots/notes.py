"""Notes on an import: what was taken, assumed and left out, and warnings."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from affordance.reporting.formatting import format_number
from affordance.robots.home import TEST_DISTANCE, TEST_MASS
from affordance.robots.importer import ImportedArm, ImportOptions

# Fraction of a joint's torque limit that damping takes at full velocity, above which it was hardly measured.
_MUCH_DAMPING = 0.5
# Reflected inertia below that of any geared motor: the file contains none, [kg m^2].
_NO_ROTOR = 1e-3
# Static payload over arm mass above which torque limits look like placeholders; the largest of twenty robots is 4.1.
_MANY_WEIGHTS = 5.0
_MANY = 12


class Notes(NamedTuple):
    """Sentences that describe an import.

    Attributes:
        taken: Statements about the extracted arm.
        assumed: Assumptions where the file gives no information.
        dropped: Contents of the file that the arm lacks.
        warnings: Warnings about surprising values.
    """

    taken: tuple[str, ...]
    assumed: tuple[str, ...]
    dropped: tuple[str, ...]
    warnings: tuple[str, ...]


def list_notes(imported: ImportedArm, options: ImportOptions) -> Notes:
    """Lists all notes on an import."""
    return Notes(
        tuple(_list_taken(imported, options)),
        tuple(_list_assumed(imported, options)),
        tuple(_list_dropped(imported, options)),
        tuple(_list_warnings(imported)),
    )


def _list_taken(imported: ImportedArm, options: ImportOptions) -> Iterator[str]:
    arm, chain = imported.arm, imported.chain
    yield f"{len(arm.links)} joints from {arm.base} to {options.tip}: {', '.join(arm.joint_names)}"
    yield f"base: {arm.base}, as {chain.why_base}"
    how = (
        "as given" if options.out_axis else "the axis nearest to the line from the last joints; --out-axis overrides"
    )
    yield f"axis out of the hand: {arm.out_axis} of {options.tip} ({how})"
    merged = [f"{len(link.bodies) - 1} to {link.name}" for link in arm.links if len(link.bodies) > 1]
    if merged:
        yield f"links that move with another were added to it: {', '.join(merged)}"
    yield f"mass of the arm: {arm.mass:.3g} kg"


def _list_assumed(imported: ImportedArm, options: ImportOptions) -> Iterator[str]:
    arm = imported.arm
    yield (
        f"the base is fixed to the world, {options.up} of the robot's root pointing up, and turned so that the hand "
        "points forward"
    )
    frozen = arm.frozen
    if frozen:
        listed = [f"{name} at {value:.4g}" for name, value in frozen.items() if value or name in options.posture]
        rest = len(frozen) - len(listed)
        shown = ", ".join([*listed[:_MANY], *([f"{len(listed) - _MANY} more"] if len(listed) > _MANY else [])])
        zero = f"{rest} at 0" if rest else ""
        yield f"{len(frozen)} other joints are frozen: {'; '.join(part for part in (shown, zero) if part)}"
    free = [link.joint for link in arm.links if not (np.isfinite(link.lower) and np.isfinite(link.upper))]
    if free:
        yield f"no position limit: {', '.join(free)}"
    fast = [link.joint for link in arm.links if not np.isfinite(link.velocity)]
    if fast:
        yield f"no velocity limit: {', '.join(fast)}"
    bare = [link.joint for link in arm.links if link.rotor_inertia < _NO_ROTOR]
    if bare:
        some = "every joint" if len(bare) == len(arm.links) else ", ".join(bare)
        gives = "--rotor-inertia gives it, as in --rotor-inertia 0.1 (kg m^2)"
        yield f"no inertia of rotors and gears, for {some}; {gives}"
    if options.effort:
        yield "limits of torque are those that were given, not the file's" + (
            "" if "" in options.effort else f", for {', '.join(options.effort)}"
        )
    light = [link.name for link in arm.links if link.inertial.mass == 0.0]
    if light:
        yield f"no mass: {', '.join(light)}, as the file has it"


def _list_dropped(imported: ImportedArm, options: ImportOptions) -> Iterator[str]:
    tree, description = imported.tree, imported.tree.description
    of_arm = {joint.name(): tree.note(joint) for joint in imported.chain.joints}
    friction = [f"{name} {notes.friction:g}" for name, notes in of_arm.items() if notes.friction]
    if friction:
        yield f"Coulomb friction (N m), which Drake's joints do not know: {', '.join(friction)}"
    springs = [f"{name} {notes.stiffness:g}" for name, notes in of_arm.items() if notes.stiffness]
    if springs:
        yield f"springs (N m/rad): {', '.join(springs)}"
    if not options.damping:
        yield "damping of all joints, as requested"
    couplers = [name for name, notes in description.joints.items() if notes.mimic is not None]
    if couplers:
        yield f"couplings of joints, which are frozen where they follow to: {', '.join(couplers[:_MANY])}"
    yield "collision shapes: only the object that is held touches anything, the nail"
    yield from description.dropped
    for link, fault in description.faults.items():
        yield f"inertia of the link {link}, which is not part of the arm: it {fault}"
    for name, notes in description.joints.items():
        if notes.fault:
            yield f"limits of the joint {name}, which is not part of the arm: it {notes.fault}"


def _list_warnings(imported: ImportedArm) -> Iterator[str]:
    for link in imported.arm.links:
        part = link.damping * link.velocity / link.effort
        if np.isfinite(part) and part > _MUCH_DAMPING:
            yield (
                f"{link.joint} is damped by {link.damping:g} N m s/rad, which takes {100.0 * part:.0f} % of its "
                "torque limit at its rate limit; --damping none omits damping"
            )
    if imported.payload > _MANY_WEIGHTS * imported.arm.mass:
        yield (
            f"static payload {format_number(imported.payload)} kg, mass of the arm {imported.arm.mass:.3g} kg: the "
            "torque limits may be placeholders; --effort gives others"
        )
    if imported.home.load > 1.0:
        yield (
            f"no level posture holds {TEST_MASS:g} kg {100.0 * TEST_DISTANCE:g} cm out of the hand within the torque "
            f"limits: {100.0 * imported.home.load:.0f} % in the best one"
        )
    for remark in imported.tree.remarks:
        yield f"Drake says: {remark}"
