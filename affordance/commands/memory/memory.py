"""``affordance memory``: shows, edits and verifies a lasting memory of held objects."""

import argparse
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from affordance.belief.density_belief import Prior
from affordance.belief.likelihood import Quadratic
from affordance.commands import answers, options
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError, describe_choice, show_text
from affordance.extensions.memory.ledger import Ledger, Selection, export_trials, import_trials, open_memory
from affordance.extensions.memory.summary import ExperienceSummary, MemorySummary, summarise
from affordance.extensions.memory.trial_evidence import PayloadQuadratic, TrialEvidence, pack
from affordance.objects.colour import (
    COLOUR_FORM,
    Colour,
    find_nearest_colour,
    is_colour,
    is_same_colour,
    parse_colour,
    show_colour,
)
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.objects.materials import MATERIALS, load_materials
from affordance.objects.tool import Tool
from affordance.reporting.formatting import tabulate, tabulate_within
from affordance.vision.eye import measure_drawing
from affordance.vision.prediction import measure_geometry

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Exit status if verify finds faults.
FAULTY = 3
# Columns (things and since) that are dropped first if the table of materials is too wide.
_LESS_IMPORTANT = (4, 5)
# Name of the robot in trials that are weighings.
SCALE = "a scale"
# Heights of a row, and of the rest of the figure, [inch].
_ROW, _REST = 0.3, 1.2
# Largest number of materials, and of objects, in the figure; the earliest are drawn.
_MOST_DRAWN = 100
# Ticks of the density axis, and its lower limit, [kg/m^3].
_TICKS, _LIGHTEST = (20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000), 10.0
# Half the width of the standard normal distribution's 90 % interval.
_HALF90 = 1.645


def run(arguments: argparse.Namespace) -> int:
    """Performs the action and returns the exit status: FAULTY if ``verify`` finds faults, else 0."""
    prior = options.read_prior(arguments, "a memory")
    _check_arguments(arguments)
    trials: list[TrialEvidence] = []  # all files are read first, so that nothing is written if one is invalid
    if arguments.action == "import":
        trials = [trial for file in arguments.files for trial in import_trials(Path(file))]
    elif arguments.action == "weigh":
        trials = _read_weighings([Path(file) for file in arguments.files], arguments.materials or MATERIALS)
    elif arguments.action == "merge":
        for file in arguments.files:
            with open_memory(file, create=False) as other:
                trials += other.list_trials()
    with open_memory(arguments.memory, create=arguments.action in ("merge", "import", "weigh")) as ledger:
        match arguments.action:
            case "show":
                _show(arguments, ledger, prior)
            case "forget":
                number = _forget(arguments, ledger)
                text = f"{ledger.place}: {_count(number)} forgotten, {len(ledger)} remain"
                answers.print_answer(arguments, text, {"forgotten": number, "trials": len(ledger)})
            case "merge" | "import" | "weigh":
                new, replaced = ledger.add(trials)
                earlier = f", {replaced} replaced by an earlier record" if replaced else ""
                text = f"{ledger.place}: {new} of {_count(len(trials))} new{earlier}, {len(ledger)} in all"
                content = {"given": len(trials), "new": new, "replaced": replaced, "trials": len(ledger)}
                answers.print_answer(arguments, text, content)
            case "export":
                path = Path(arguments.files[0])
                number = export_trials(ledger, path)
                answers.print_answer(arguments, f"{path}: {_count(number)} written", {"written": number})
            case "join":
                ledger.join([_read_pair(word) for word in arguments.files])
                joins = ledger.list_joins()
                text = f"{ledger.place}: {_describe_joins(joins) or 'no colours are joined'}"
                answers.print_answer(arguments, text, {"joins": dict(joins)})
            case "verify":
                faults = ledger.verify()
                text = "\n".join(faults) or f"{ledger.place}: {_count(len(ledger))}, all sound"
                answers.print_answer(arguments, text, {"faults": faults, "trials": len(ledger)})
                return FAULTY if faults else 0
    return 0


def name_colours(summary: MemorySummary, path: Path | None) -> dict[Colour, str]:
    """Names the materials in a memory: after a known material of the same colour, or by the colour itself."""
    known = {name: each.colour for name, each in load_materials(path or MATERIALS).items()}
    names = {}
    for each in summary.materials:
        nearest = find_nearest_colour(each.colour, known)
        is_known = is_same_colour(each.colour, known[nearest])
        shown = nearest.replace("_", " ")
        names[each.colour] = f"{shown} {show_colour(each.colour)}" if is_known else show_colour(each.colour)
    return names


def _read_weighings(paths: Sequence[Path], materials: Path) -> list[TrialEvidence]:
    """Reads the weighings in tools files.

    Raises:
        BadValueError: A file contains no weighing.
    """
    trials = []
    for path in paths:
        tools, _ = options.read_tools(path, load_materials(materials))
        found = list(list_weighed_trials(tools, path))
        if not found:
            raise BadValueError(path, "", "has no weighing, must have the mass (kg) of a tool or of a part")
        trials += found
    return trials


def list_weighed_trials(tools: Iterable[Tool], path: Path) -> Iterator[TrialEvidence]:
    """Lists one trial for each weighing of the tools in a file.

    Weighed parts of a tool are a separate object. A weighing measures only the mass, the first of the ten parameters.
    A memory counts the same weighing only once.
    """
    for tool in tools:
        features = measure_drawing(tool)
        for weighing in tool.weighings:
            chosen = weighing.parts or tuple(range(len(features)))
            parts = [features[k] for k in chosen]
            shown = f"part {', '.join(str(k + 1) for k in chosen)} of {tool.name}" if weighing.parts else tool.name
            precision, information = np.zeros((NUM_PARAMETERS, NUM_PARAMETERS)), np.zeros(NUM_PARAMETERS)
            precision[0, 0], information[0] = weighing.sd**-2, weighing.mass * weighing.sd**-2
            yield TrialEvidence(
                object_name=shown,
                parts=tuple(part.appearance for part in parts),
                geometry=measure_geometry(parts, range(len(parts)), len(parts)),
                model=PayloadQuadratic(),
                features=pack(Quadratic(precision, information)),
                num_samples=1,
                num_joints=1,
                robot=SCALE,
                source=show_text(path.name),
            )


def draw_memory(summary: MemorySummary, names: Mapping[Colour, str]) -> "Figure":
    """Plots densities of materials and masses of objects, with 90 % intervals and numbers of trials."""
    # Imported here, so that answers without a figure are faster.
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter, ScalarFormatter

    from affordance.reporting.figures import tidy

    left_out = [max(len(each) - _MOST_DRAWN, 0) for each in summary]
    summary = MemorySummary(summary.materials[:_MOST_DRAWN], summary.things[:_MOST_DRAWN])
    rows = max(len(summary.materials), len(summary.things), 1)
    figure = Figure(figsize=(11.0, _REST + _ROW * rows), layout="constrained")
    of_materials, of_things = figure.subplots(1, 2)
    for place, each in enumerate(summary.materials):
        low, high = each.interval90
        of_materials.plot([low, high], [place, place], color=each.colour, linewidth=6.0, solid_capstyle="butt")
        of_materials.plot(each.median, place, "o", color="black", markersize=4.0)
    of_materials.set_xscale("log")
    ends = [end for each in summary.materials for end in each.interval90] or [100.0, 10_000.0]
    of_materials.set_xlim(max(min(ends) / 1.5, _LIGHTEST), max(ends) * 1.5)
    of_materials.set_xticks([tick for tick in _TICKS if min(ends) / 1.5 <= tick <= max(ends) * 1.5])
    of_materials.xaxis.set_major_formatter(ScalarFormatter())
    of_materials.xaxis.set_minor_formatter(NullFormatter())
    of_materials.set_xlabel("density: median and 90 % interval (kg/m³)")
    labels = [_label(names[each.colour], each.experience) for each in summary.materials]
    of_materials.set_yticks(range(len(labels)), labels)
    for place, thing in enumerate(summary.things):
        low, high = thing.mass - _HALF90 * thing.mass_sd, thing.mass + _HALF90 * thing.mass_sd
        of_things.plot([max(low, 0.0), high], [place, place], color="0.6", linewidth=6.0, solid_capstyle="butt")
        of_things.plot(thing.mass, place, "o", color="black", markersize=4.0)
    of_things.set_xlim(left=0.0)
    of_things.set_xlabel("mass: mean and 90 % interval (kg)")
    labels = [_label(each.name, each.experience) for each in summary.things]
    of_things.set_yticks(range(len(labels)), labels)
    for axes in (of_materials, of_things):
        axes.set_ylim(rows - 0.5, -0.5)
    for axes, number in zip((of_materials, of_things), left_out, strict=True):
        if number:
            axes.set_title(f"the first {_MOST_DRAWN}; {number} more are not drawn")
    tidy(of_materials, of_things)
    return figure


def _label(name: str, experience: ExperienceSummary) -> str:
    return f"{name} ({experience.trials})"


def _forget(arguments: argparse.Namespace, ledger: Ledger) -> int:
    """Removes the selected trials, and returns their number.

    Raises:
        BadValueError: No trials are selected, or a robot or object is unknown.
    """
    selection = Selection(arguments.robot, arguments.object, arguments.since, arguments.until, arguments.trial)
    if not any(selection):
        raise BadValueError(
            "forget", "", "selects no trials, must be given --robot, --object, --since, --until or --trial"
        )
    number = ledger.forget(selection)
    robots, objects = ([], []) if number else ledger.list_names()
    for option, name, known in (("--robot", arguments.robot, robots), ("--object", arguments.object, objects)):
        if known and name and name not in known:
            raise BadValueError(option, "", describe_choice(name, known))
    return number


def _check_arguments(arguments: argparse.Namespace) -> None:
    """Checks that the action has the files that it needs, and no option that it would ignore."""
    needed = {"merge": "at least one memory", "export": "one file", "import": "at least one file"}
    needed["weigh"] = "at least one file of tools"
    files = len(arguments.files)
    if (arguments.action in needed and not files) or (arguments.action == "export" and files > 1):
        raise BadValueError(arguments.action, "", f"is given {files} files, must be given {needed[arguments.action]}")
    if arguments.action not in (*needed, "join") and files:
        raise BadValueError(arguments.action, "", f"is given the file {arguments.files[0]!r}, must be given none")
    given = [name for name in ("robot", "object", "since", "until", "trial") if getattr(arguments, name)]
    if given and arguments.action != "forget":
        raise BadValueError(
            f"--{given[0]}", "", f"has no effect on {arguments.action}, must be given with forget only"
        )


def _show(arguments: argparse.Namespace, ledger: Ledger, prior: Prior) -> None:
    summary = summarise(ledger, prior)
    names = name_colours(summary, arguments.materials)
    content = {
        "trials": len(ledger),
        "materials": [{"name": names[each.colour], **_unfold(each)} for each in summary.materials],
        "things": [_unfold(each) for each in summary.things],
    }
    text = _describe(ledger, summary, names)
    answers.give_answer(arguments, "memory", text, content, lambda: draw_memory(summary, names))


def _unfold(each: object) -> dict[str, object]:
    content: dict[str, object] = each._asdict()  # type: ignore[attr-defined]
    experience = content.pop("experience")
    assert isinstance(experience, ExperienceSummary)
    return {**content, **experience._asdict()}


def _read_pair(word: str) -> tuple[Colour, Colour]:
    """Reads a pair of colours that must be treated as the same colour."""
    one, _, other = word.partition("=")
    if not (is_colour(one) and is_colour(other)):
        raise BadValueError("join", "", f"is {word!r}, must be two colours, each of which {COLOUR_FORM}")
    return parse_colour(one), parse_colour(other)


def _describe_joins(joins: Sequence[tuple[str, str]]) -> str:
    return ", ".join(f"{colour} is read as {meant}" for colour, meant in joins)


def _count(number: int) -> str:
    return f"{number} trial{'' if number == 1 else 's'}"


def _describe(ledger: Ledger, summary: MemorySummary, names: Mapping[Colour, str]) -> str:
    """Formats the tables of materials and objects."""
    lines = [f"{ledger.place}: {_count(len(ledger))}", *filter(None, [_describe_joins(ledger.list_joins())])]
    names_shown = (*names.values(), *(thing.name for thing in summary.things))
    width, longest = find_width(), max(map(len, names_shown), default=0)
    pad = 0 if width else longest  # without a terminal, both tables have the same column widths
    rows = [["material".ljust(pad), " kg/m^3", "90 % interval", "trials", "things", "since", "robots"]]
    for each in summary.materials:
        low, high = each.interval90
        felt = each.experience
        interval = f"{low:6.0f} to {high:5.0f}"
        numbers = [f"{each.median:.0f}", interval, str(felt.trials), str(len(each.things))]
        rows.append([names[each.colour], *numbers, felt.since[:10], ", ".join(felt.robots)])
    lines += ["", *tabulate_within(rows, width, _LESS_IMPORTANT, right=range(1, 5))] if summary.materials else []
    rows = [["thing".ljust(pad), "     kg", "     SD", "trials", "since", "robots"]]
    for thing in summary.things:
        felt = thing.experience
        numbers = [f"{thing.mass:.3f}", f"{thing.mass_sd:.3f}", str(felt.trials)]
        rows.append([thing.name, *numbers, felt.since[:10], ", ".join(felt.robots)])
    lines += ["", *tabulate(rows, range(1, 4), width)] if summary.things else []
    return "\n".join([*lines, *([] if summary.materials else ["The memory is empty."])])
