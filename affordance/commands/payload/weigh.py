"""``affordance weigh``: weighs the load of a force-torque sensor from poses at rest.

No robot file is needed. Drake is not imported, so the answer takes less than a second.
"""

import argparse
from collections.abc import Iterator

import numpy as np

from affordance.commands.answers import give_answer, tell
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError
from affordance.extensions.payload.payload_file import check_target, describe_written, spread_moments, write_payload
from affordance.extensions.payload.weighing.poses import WRENCH, read_poses
from affordance.extensions.payload.weighing.weigh import Weighing, weigh
from affordance.reporting.formatting import break_line, format_known, tabulate

_NAMES = ("mass", "centre x", "y", "z", *(f"offset {name}" for name in WRENCH))
_UNITS = ("kg", "m", "m", "m", "N", "N", "N", "N m", "N m", "N m")


def run(arguments: argparse.Namespace) -> int:
    """Weighs, prints and writes the load. The exit status is 0, or 3 if it is not trusted or shows no mass."""
    check_target(arguments.write, arguments.draws)
    if not np.isfinite(arguments.gravity).all() or not np.any(arguments.gravity):
        raise BadValueError("--gravity", "", f"is {arguments.gravity}, must be a direction of finite numbers")
    poses = read_poses(arguments.poses, arguments.orientation, arguments.gravity)
    if poses.R_BS is None and arguments.axes == "base":
        raise BadValueError(
            "--axes", "", f"is base, must be sensor: a table with {poses.form} does not show the base"
        )
    weighing = weigh(
        poses,
        axes=arguments.axes,
        force_on=arguments.force_on,
        down_B=arguments.gravity,
        seed=arguments.seed,
    )
    lines, width = list(describe(weighing)), find_width()
    text = "\n".join(part for line in lines for part in break_line(line, width))
    content = weighing.to_dict()
    content |= {"frame": arguments.frame, "answer": lines[0]}
    is_used = weighing.is_trusted and weighing.shows_mass
    if arguments.write is not None and is_used:
        bodies = spread_moments(weighing.parameters, np.random.default_rng(arguments.seed))
        note = "moments of inertia are not measured but computed for a ball"
        content["written"] = write_payload(arguments.write, bodies, arguments.frame, note=note, draws=arguments.draws)
    give_answer(arguments, "weighing", text, content)
    if arguments.write is not None:
        tell(arguments, describe_written(arguments.write, content.get("written", [])))
    return 0 if is_used else 3


def describe(weighing: Weighing) -> Iterator[str]:
    """Describes a weighing, one line at a time. The first line is the answer."""
    poses, sd, ends = weighing.poses, weighing.sd, weighing.intervals
    means = [weighing.mass, *weighing.centre_of_mass, *weighing.samples[:, 4:].mean(axis=0)]
    trust = "NOT TO BE TRUSTED" if weighing.doubts else "trusted" if weighing.shows_mass else "NOT SEEN"
    if weighing.is_light:
        yield f"Little or nothing is held, {ends[0, 2]:.3f} to {ends[0, 3]:.3f} kg: {trust}"
    else:
        centre = ", ".join(format_known(1e3 * x, 1e3 * s) for x, s in zip(means[1:4], sd[1:4], strict=True))
        where = f"centre of mass ({centre}) +- {1e3 * sd[1:4].max():.2g} mm in the sensor's axes"
        yield f"{format_known(means[0], sd[0])} kg +- {1e3 * sd[0]:.2g} g, {where}: {trust}"
    rows = f"{len(poses.counts)} poses, {int(poses.counts.sum())} rows"
    acts = f"acts on the {weighing.force_on}" if not weighing.is_light else "shows no weight"
    yield f"{poses.source}: {rows}, {poses.form}; the wrench is in the {weighing.axes}'s axes and {acts}"
    if weighing.doubts:
        yield "NOT TO BE TRUSTED:"
        yield from (f"  {doubt}" for doubt in weighing.doubts)
    else:
        yield "No reason to distrust the result was found."
    yield ""
    table: list[tuple[str, ...]] = [("", "mean", "SD", "50 % interval", "", "90 % interval", "", "")]
    for name, unit, mean, spread, each in zip(_NAMES, _UNITS, means, sd, ends, strict=True):
        table.append((name, *(f"{x:.4f}" for x in (mean, spread, *each)), unit))
    yield from tabulate(table, right=range(1, 7))
    yield ""
    shown = ", ".join(f"{name} {x:.2g}" for name, x in zip(WRENCH, weighing.residual, strict=True))
    yield f"Residual (root mean square, N and N m): {shown}"
    yield from (f"Found: {note}" for note in weighing.notes)
    if poses.num_left_out:
        yield f"Left out: {poses.num_left_out} rows between the poses"
    yield from (f"Not seen: {each}" for each in weighing.unseen)
    if not weighing.is_light:
        yield f"Next pose: {weighing.next_pose}"
    yield "Assumed: forces in N, at rest, nothing touches the load, all that hangs below the sensor counts as load"
