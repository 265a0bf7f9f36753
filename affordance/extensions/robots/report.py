"""Writes the report of an import, as text and HTML, with contents, assumptions and omissions."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.exceptions import UnavailableError
from affordance.extensions.robots.arm_checks import gather
from affordance.extensions.robots.fitting import Fitted, show
from affordance.extensions.robots.home import TEST_DISTANCE, TEST_MASS, UPRIGHT, HomePosture
from affordance.extensions.robots.plausibility import is_nearly_massless, list_implausible
from affordance.extensions.robots.reduced_arm import ReducedArm
from affordance.files.atomic import write_atomic, write_text
from affordance.files.model_folder import MODELS
from affordance.files.template import render_template
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.reporting.figures import OBJECT_COLOURS, tidy
from affordance.reporting.formatting import format_number, tabulate
from affordance.reporting.object_drawings import Drawing, compute_limits, draw_object
from affordance.reporting.renderings import Pose, render_poses

TEXT, PAGE, PICTURE = "report.txt", "report.html", "posture.png"
# Fraction of a joint's torque limit that damping takes at full velocity, above which it was probably not measured.
_MUCH_DAMPING = 0.5
# Reflected inertia below that of any geared motor, which the file therefore does not contain, [kg m^2].
_NO_ROTOR = 1e-3
# Ratio of static payload to arm mass above which torque limits seem to be placeholders; at most 4.1 in twenty robots.
_MANY_WEIGHTS = 5.0
_MANY, _HEAVIEST = 12, 3
_WIDTH, _HEIGHT = 720, 540
# Tool in the figure of the hand; length of the drawn axes, [cm]; smallest visible fraction of a drawn axis.
_HAMMER, _ARROW, _SEEN = "claw hammer", 9.0, 0.3


class ReportPart(NamedTuple):
    """Part of the report with heading, sentences and an optional table, whose first row is its header."""

    heading: str
    sentences: Sequence[str]
    table: Sequence[Sequence[str]] = ()


def write_report(
    models: Path, arm: ReducedArm, home: HomePosture, fitted: Fitted | None, looks: Sequence[str]
) -> None:
    """Writes ``report.txt``, ``report.html`` and a picture into a model folder."""
    parts = _list_parts(arm, home, fitted, looks)
    title = f"The arm of {arm.tree.description.path.name}, to {arm.options.tip}"
    figure = draw_posture(models)
    write_atomic(models / PICTURE, lambda path: figure.savefig(path, dpi=130))
    write_text(models / TEXT, _write_text(title, parts))
    page = render_template(
        "affordance.extensions.robots", "report.html.j2", escapes=True, title=title, picture=PICTURE, parts=parts
    )
    write_text(models / PAGE, page)


def _list_parts(arm: ReducedArm, home: HomePosture, fitted: Fitted | None, looks: Sequence[str]) -> list[ReportPart]:
    """Lists the non-empty parts of the report."""
    head = ("joint", "from", "to (rad)", "rate (rad/s)", "torque (N m)", "damping", "rotor", "home (rad)")
    rows = [
        (
            link.joint,
            f"{link.lower:.4g}",
            f"{link.upper:.4g}",
            f"{link.velocity:.4g}",
            f"{link.effort:.4g}",
            f"{link.damping:.3g}",
            f"{link.rotor_inertia:.3g}",
            f"{angle:.3f}",
        )
        for link, angle in zip(arm.links, home.q, strict=True)
    ]
    holding = [
        f"distance from shoulder to hand: {100.0 * home.reach:.0f} % of the arm's length of {home.length:.3g} m",
        f"the arm's weight takes {100.0 * home.empty_load:.0f} % of the torque limit of the most loaded joint; "
        f"with {TEST_MASS:g} kg at {100.0 * TEST_DISTANCE:g} cm from the hand, {100.0 * home.load:.0f} %",
        describe_payload(home),
        "torques for the arm's own weight in this posture (N m): "
        + ", ".join(f"{name} {torque:.3g}" for name, torque in zip(arm.joint_names, home.own, strict=True)),
        f"least singular value of the hand's Jacobian: {home.smallest_singular_value / home.length:.3f} lengths",
        f"angle between up and the hand's z, which is up in drawings of tools: {np.degrees(home.tilt):.3g} degrees",
    ]
    if fitted is None:
        adapted = "not adapted"
    elif fitted.changes:
        adapted = "changed to be feasible:"
    else:
        adapted = "nothing was changed" if fitted.lacks else "paths, blow and objects are feasible"
    changes, lacks = fitted or ((), {})
    table = [(each.file, each.key, show(each.old), show(each.new), each.why) for each in changes]
    parts = [
        ReportPart("Imported", [*_list_taken(arm)], [head, *rows]),
        ReportPart("Home posture", holding),
        ReportPart("Assumed", [*_list_assumed(arm)]),
        ReportPart("Left out", [*list_dropped(arm)]),
        ReportPart("Warnings", [*list_warnings(arm, home)]),
        ReportPart("Tasks", [adapted], [("file", "value", "old", "new", "why"), *table] if table else ()),
        ReportPart("Infeasible", [f"{name}: {why}" for name, why in lacks.items()]),
        ReportPart("Shapes", looks),
    ]
    return [part for part in parts if part.sentences]


def _list_taken(arm: ReducedArm) -> Iterator[str]:
    options = arm.options
    yield f"{len(arm.links)} joints from {arm.base} to {options.tip}: {', '.join(arm.joint_names)}"
    if arm.why_tip:
        yield arm.why_tip
    yield f"base: {arm.base}, because {arm.chain.why_base}"
    found = "the axis closest to the line from the last joints; --out-axis overrides it"
    yield f"axis out of the hand: {arm.out_axis} of {options.tip} ({'as given' if options.out_axis else found})"
    yield describe_roll(arm)
    if merged := [f"{len(link.bodies) - 1} to {link.name}" for link in arm.links if len(link.bodies) > 1]:
        yield f"links merged into the link they are fixed to: {', '.join(merged)}"
    yield f"mass of the arm: {arm.mass:.3g} kg"


def describe_payload(home: HomePosture) -> str:
    """Describes an arm's static payload in the hand and farther out, as with a tool."""
    return (
        f"static payload at home {format_number(home.payload_in_hand)} kg in the hand, {format_number(home.payload)} "
        f"kg at {100.0 * TEST_DISTANCE:g} cm from it, limited by {home.weakest}"
    )


def describe_roll(arm: ReducedArm) -> str:
    """Describes the roll of the hand frame, in which tools are gripped."""
    why = "so that its z is up at home; if the gripper is mounted otherwise, give --roll"
    if arm.options.roll is not None:
        why = "as given by --roll"
    return (
        f"roll of the hand: {np.degrees(arm.roll):.4g} degrees about its x from the axes of {arm.options.tip}, {why}"
    )


def _list_assumed(arm: ReducedArm) -> Iterator[str]:
    options = arm.options
    yield (
        f"the base is fixed to the world, with {arm.up} of the robot's root pointing up, and turned so that the hand "
        "points forward"
    )
    if arm.frozen:
        listed = [f"{name} at {value:.4g}" for name, value in arm.frozen.items() if value or name in options.posture]
        shown = ", ".join([*listed[:_MANY], *([f"{len(listed) - _MANY} more"] if len(listed) > _MANY else [])])
        rest = len(arm.frozen) - len(listed)
        parts = filter(None, (shown, f"{rest} at 0" if rest else ""))
        yield f"{len(arm.frozen)} other joints are frozen: {'; '.join(parts)}"
    if free := [link.joint for link in arm.links if not (np.isfinite(link.lower) and np.isfinite(link.upper))]:
        yield f"joints without a position limit: {', '.join(free)}"
    if fast := [link.joint for link in arm.links if not np.isfinite(link.velocity)]:
        yield f"joints without a velocity limit: {', '.join(fast)}"
    if bare := [link.joint for link in arm.links if link.rotor_inertia < _NO_ROTOR]:
        some = "every joint" if len(bare) == len(arm.links) else ", ".join(bare)
        gives = "set it with --rotor-inertia, for example --rotor-inertia 0.1 (kg m^2)"
        yield f"no inertia of rotors and gears for {some}; {gives}"
    for kind, given in (("torque", options.effort), ("velocity", options.velocity)):
        if given:
            some = "" if "" in given else f", for {', '.join(given)}"
            yield f"{kind} limits as given, not the file's{some}"
    if endless := [joint.name() for joint in arm.chain.joints if not arm.tree.note(joint).has_range]:
        yield f"joints taken as unlimited, because their position limits are missing: {', '.join(endless)}"
    if light := [link.name for link in arm.links if link.inertial.mass == 0.0]:
        yield f"links without mass, as in the file: {', '.join(light)}"


def list_dropped(arm: ReducedArm) -> Iterator[str]:
    """Lists contents of the file that were left out."""
    tree, description = arm.tree, arm.tree.description
    of_arm = {joint.name(): tree.note(joint) for joint in arm.chain.joints}
    if friction := [f"{name} {notes.friction:g}" for name, notes in of_arm.items() if notes.friction]:
        yield f"Coulomb friction (N m), which Drake's joints do not have: {', '.join(friction)}"
    if springs := [f"{name} {notes.stiffness:g}" for name, notes in of_arm.items() if notes.stiffness]:
        yield f"springs (N m/rad): {', '.join(springs)}"
    if not arm.options.damping:
        yield "damping of all joints, as requested"
    yield from list_couplings(arm)
    yield "collision shapes: the only contact is between the held object and the nail"
    yield from description.dropped
    mended = {link: fault for link, (fault, _) in description.mended.items() if link not in arm.mended}
    for link, fault in {**description.faults, **mended}.items():
        yield f"inertia of the link {link}, which is not part of the arm: it {fault}"
    for name, notes in description.joints.items():
        if notes.fault:
            yield f"limits of the joint {name}, which is not part of the arm: it {notes.fault}"


def list_warnings(arm: ReducedArm, home: HomePosture) -> Iterator[str]:
    """Lists warnings about surprising values of an imported arm."""
    yield from list_remarks(arm)
    yield from list_implausible(arm)
    for link in arm.links:
        part = link.damping * link.velocity / link.effort
        if np.isfinite(part) and part > _MUCH_DAMPING:
            yield (
                f"{link.joint} is damped by {link.damping:g} N m s/rad, which takes {100.0 * part:.0f} % of its "
                "torque limit at its rate limit; --damping none omits damping"
            )
    if home.payload > _MANY_WEIGHTS * arm.mass and not is_nearly_massless(arm) and not arm.options.effort:
        yield (
            f"static payload {format_number(home.payload)} kg, mass of the arm {arm.mass:.3g} kg: the "
            "torque limits may be placeholders; --effort overrides them"
        )
    if home.empty_load > 1.0:
        efforts = [link.effort for link in arm.links]
        worst = int(np.argmax(np.abs(home.own) / efforts))
        needed = abs(home.own[worst])
        heaviest = sorted(arm.links[worst:], key=lambda link: -link.inertial.mass)[:_HEAVIEST]
        weights = ", ".join(f"{link.name} {link.inertial.mass:.3g} kg" for link in heaviest)
        yield (
            f"the arm cannot carry its own weight at home: {arm.joint_names[worst]} would need {needed:.3g} N m, "
            f"its limit is {efforts[worst]:.3g} N m; the heaviest links that it carries are {weights}"
        )
    elif home.load > 1.0:
        yield (
            f"no posture with a level hand holds {TEST_MASS:g} kg at {100.0 * TEST_DISTANCE:g} cm from the hand "
            f"within the torque limits: the best one needs {100.0 * home.load:.0f} %"
        )
    if home.tilt > UPRIGHT:
        yield (
            f"the hand's z points {np.degrees(home.tilt):.3g} degrees away from up at home, so tools are held tilted "
            "by this angle; another --roll or --posture can turn it up"
        )
    for remark in arm.tree.remarks:
        yield f"Drake says: {remark}"


def list_couplings(arm: ReducedArm) -> Iterator[str]:
    """Describes frozen joints that follow another joint."""
    if couplers := [name for name, notes in arm.tree.description.joints.items() if notes.mimic is not None]:
        more = f" and {len(couplers) - _MANY} more" if len(couplers) > _MANY else ""
        yield f"couplings of joints, each frozen where its leader puts it: {', '.join(couplers[:_MANY])}{more}"


def list_remarks(arm: ReducedArm) -> Iterator[str]:
    """Lists duplicates, omissions and contradictions in the file that concern the arm."""
    description = arm.tree.description
    yield from description.remarks
    if len(arm.tree.roots) > 1 and description.kind == "urdf":
        roots = ", ".join(arm.tree.roots)
        yield f"{len(arm.tree.roots)} links have no parent and are fixed to the world: {roots}"
    if arm.chain.above:
        yield f"the arm begins at {arm.base}: {arm.chain.above}"
    bodies = [name for link in arm.links for name, _ in link.bodies]
    joints = [arm.tree.key(joint) for joint in arm.chain.joints]
    remarks = [
        (kind, name, remark, "")
        for kind, names in (("link", bodies), ("joint", joints))
        for name in names
        for remark in description.remarks_of.get(f"{kind} {name}", ())
    ]
    mended = []
    for name in arm.mended:
        fault, written = description.mended[name]
        nearest = "the nearest possible one" if written.mass > 0.0 else "no inertia"
        mended.append(("link", name, fault, f"; {nearest} is used instead"))
    for element, remark, instead in gather([*remarks, *mended]):
        yield f"{element} {remark}{instead}"


def _write_text(title: str, parts: Sequence[ReportPart]) -> str:
    lines = [title, "=" * len(title)]
    for part in parts:
        lines += ["", part.heading, "-" * len(part.heading), *(f"- {sentence}" for sentence in part.sentences)]
        if part.table:
            lines += ["", *tabulate(part.table)]
    return "\n".join(lines) + "\n"


def draw_posture(models: Path) -> Figure:
    """Plots the arm at home: rendered with an object, its joints from two sides, and the hand frame."""
    arm = load_arm(models / ARM.name)
    tools = load_tools(models / "tools" / "weight.yaml", load_materials(models / "materials.yaml"))
    longest = max(tools[:-1], key=lambda tool: float(tool.p_TTfree[0]))
    try:
        (picture,) = render_poses(arm.source, [Pose(longest, None, arm.home)], width=_WIDTH, height=_HEIGHT)
    except UnavailableError:
        picture = np.full((_HEIGHT, _WIDTH, 3), 255, dtype=np.uint8)  # without a renderer, only joints are drawn
    context: Any = arm.plant.CreateDefaultContext()
    joints = [arm.plant.GetJointByName(name) for name in arm.joint_names]
    hand: Any = arm.hand.CalcPoseInWorld(context)
    free = hand @ longest.p_TTfree
    places = [joint.frame_on_child().CalcPoseInWorld(context).translation() for joint in joints]
    points = np.array([*places, hand.translation()])
    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    (rendered, side), (frame, above) = figure.subplots(2, 2, width_ratios=[1.2, 1.0])
    rendered.imshow(picture)
    rendered.set_axis_off()
    rendered.set_title(f"at home, with {longest.name.replace('_', ' ')}")
    for axes, row, name, label in (
        (side, 2, "from the right", "up (m)"),
        (above, 1, "from above", "to the left (m)"),
    ):
        axes.plot(points[:, 0], points[:, row], "o-", color=OBJECT_COLOURS[0], label="joints and hand")
        ends = np.array([hand.translation(), free])
        axes.plot(ends[:, 0], ends[:, row], "-", color=OBJECT_COLOURS[4], linewidth=3.0, label="object")
        axes.set_aspect("equal", adjustable="datalim")
        axes.set(xlabel="forward (m)", ylabel=label, title=name)
    side.legend(frameon=False, fontsize=8)
    tidy(side, above)
    _draw_hand_frame(frame, hand.rotation().matrix())
    return figure


def _draw_hand_frame(axes: Axes, R_WH: Array) -> None:
    """Plots the hand's axes with a hammer, seen from the right: world x forward, z up."""
    hammer = next(tool for tool in load_tools(MODELS / "workshop" / "tools.yaml") if tool.name == _HAMMER)
    held = hammer.gripped_by(hammer.grips[0])
    R_VH = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]) @ R_WH  # V: view along -Vz
    X_VH = np.eye(4)
    X_VH[:3, :3] = R_VH
    parts = tuple(replace(part, X_TE=X_VH @ part.X_TE) for part in held.components)
    shown = replace(held, components=parts)
    draw_object(axes, Drawing(shown, ""))
    for name, direction in zip("xyz", R_VH.T, strict=True):
        along = direction[:2]
        if np.linalg.norm(along) > _SEEN:
            end = (_ARROW * along).tolist()
            axes.annotate(
                "",
                end,
                (0.0, 0.0),
                arrowprops={"arrowstyle": "-|>", "linewidth": 2.0, "color": "#AA3377", "shrinkA": 0.0},
            )
            axes.annotate(name, (1.15 * _ARROW * along).tolist(), ha="center", va="center", color="#AA3377")
        else:
            away = "away from" if direction[2] < 0.0 else "towards"
            axes.annotate(f"{name} points {away} you", (0.0, -1.1 * _ARROW), color="#AA3377", fontsize=9)
    text = f"the hand's frame at home, from the right, with\nthe {_HAMMER} by its {held.grip} (cross: centre of mass)"
    axes.set_title(text, fontsize=10)
    low, high = compute_limits([shown])
    around = 1.3 * _ARROW * np.ones(2)
    low, high = np.minimum(low, -around), np.maximum(high, around)
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.axis("off")
