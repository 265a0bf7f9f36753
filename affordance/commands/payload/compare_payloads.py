"""``affordance compare-payloads``: tests if two payloads are the same body."""

import argparse

from affordance.commands import answers
from affordance.exceptions import BadValueError
from affordance.extensions.payload.payload_comparison import (
    NAMES,
    UNITS,
    Comparison,
    Estimate,
    compare_estimates,
    read_estimate,
)
from affordance.extensions.robots.recorded_arm import find_flange, load_robot
from affordance.reporting.formatting import tabulate

_VERDICTS = {
    "same": "can be the same body",
    "different": "are different bodies",
    "open": "may be the same body or not",
}


def run(arguments: argparse.Namespace) -> int:
    """Compares the payloads and prints the verdict. The exit status is 0, or 3 if a payload is not trusted."""
    paths = arguments.first, arguments.second
    first, second = map(read_estimate, paths)
    if first.name == second.name:
        first, second = (each._replace(name=str(path)) for each, path in zip((first, second), paths, strict=True))
    if arguments.robot is not None and first.frame != second.frame:
        for each in (first, second):
            if not each.frame:
                raise BadValueError(
                    each.name, "frame", "is missing, must name the payload's frame in the robot's file"
                )
        robot = load_robot(arguments.robot, second.frame)
        flange = find_flange(robot, first.frame)
        assert flange is not None  # because its name is given
        second = second.express(first.frame, flange.X_FT)
    comparison = compare_estimates(first, second)
    text = "\n".join(_describe(first, second, comparison))
    content = comparison.to_dict() | {"files": [first.name, second.name], "frames": [first.frame, second.frame]}
    answers.print_answer(arguments, text, content | {"trusted": [first.is_trusted, second.is_trusted]})
    return 0 if first.is_trusted and second.is_trusted else 3


def _describe(first: Estimate, second: Estimate, comparison: Comparison) -> list[str]:
    p = f"p = {comparison.p_value:.2g}"
    lines = [f"{first.name} and {second.name} {_VERDICTS[comparison.verdict]} ({p})"]
    if comparison.decides:
        lead = "Would decide" if comparison.verdict == "open" else "Found"
        lines.append(f"{lead}: {comparison.decides}")
    rows: list[tuple[str, ...]] = [("", first.name, "SD", second.name, "SD", "apart (SDs of both)", "")]
    (values, others), (sds, other_sds) = comparison.values, comparison.sds
    for i, apart in enumerate(comparison.apart):
        cells = [f"{each:.4g}" for each in (values[i], sds[i], others[i], other_sds[i])]
        rows.append((NAMES[i], *cells, f"{apart:+.1f}", UNITS[i]))
    lines += ["", *tabulate(rows, right=range(1, 6)), ""]
    frames = [each.frame or "no frame named" for each in (first, second)]
    if len(comparison.apart) == 1 and min(len(first.mean), len(second.mean)) > 1:
        lines.append(
            f"Only the masses are compared, as the frames differ ({', '.join(frames)}): --robot FILE converts"
        )
    elif not (first.frame and second.frame):
        lines.append(f"Assumed: both are in the same frame ({', '.join(frames)})")
    lines += [f"{each.name} was not to be trusted" for each in (first, second) if not each.is_trusted]
    return lines
