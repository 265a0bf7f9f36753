"""``affordance memory``: shows, edits and verifies a lasting memory of the objects that robots have held."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

from affordance.belief.density_belief import Prior
from affordance.commands import options
from affordance.commands.memory.memory_options import read_same_colours
from affordance.commands.options import add_same_colours
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.memory.exchange import export_trials, read_trials
from affordance.extensions.memory.ledger import Ledger, open_memory
from affordance.extensions.memory.memory_figure import draw_memory
from affordance.extensions.memory.stored_trials import Selection
from affordance.extensions.memory.summary import ExperienceSummary, MemorySummary, summarise
from affordance.extensions.memory.trial_evidence import TrialEvidence
from affordance.extensions.memory.weighed_trial import list_weighed_trials
from affordance.objects.colour import Colour, find_nearest_colour, is_same_colour, show_colour
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials
from affordance.reporting.formatting import tabulate, tabulate_within

# Exit status if verify finds faults.
FAULTY = 3
# Columns of the table of materials to drop first if it is too wide: things and since.
_LESS_IMPORTANT = (4, 5)
ACTIONS = ("show", "forget", "merge", "export", "import", "weigh", "verify")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("action", choices=ACTIONS, help="what to do; forget requires options that select trials")
    add("memory", metavar="MEMORY", help="SQLite file of the memory")
    what = "memories to merge, file to export to, files to import, or tools files with weighings"
    add("files", nargs="*", metavar="FILE", help=what)
    add("--robot", default="", metavar="NAME", help="select trials of this robot")
    add("--object", default="", metavar="NAME", help="select trials with objects of this name")
    what = "select trials from this time on, UTC: 2026-03-01 or 2026-03-01T12:00"
    add("--since", default="", metavar="TIME", help=what)
    add("--until", default="", metavar="TIME", help="select trials before this time")
    add("--trial", default="", metavar="ID", help="select the trial whose id begins with these digits, at least four")
    add_same_colours(parser)
    what = "materials whose names are shown (default: those of the package)"
    add("--materials", type=Path, metavar="FILE", help=what)
    options.add_answer(parser, "the figure and the table of show")
    options.add_prior_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Performs the action and returns the exit status: FAULTY if verify finds faults, else 0."""
    prior = options.read_prior(arguments, "a memory")
    _check_arguments(arguments)
    trials: list[TrialEvidence] = []  # read first, so that nothing is written if a file is invalid
    if arguments.action == "import":
        trials = [trial for file in arguments.files for trial in read_trials(Path(file))]
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
                options.print_answer(arguments, text, {"forgotten": number, "trials": len(ledger)})
            case "merge" | "import" | "weigh":
                new, replaced = ledger.add(trials)
                earlier = f", {replaced} replaced by an earlier record" if replaced else ""
                text = f"{ledger.place}: {new} of {_count(len(trials))} new{earlier}, {len(ledger)} in all"
                content = {"given": len(trials), "new": new, "replaced": replaced, "trials": len(ledger)}
                options.print_answer(arguments, text, content)
            case "export":
                path = Path(arguments.files[0])
                number = export_trials(ledger, path)
                options.print_answer(arguments, f"{path}: {_count(number)} written", {"written": number})
            case "verify":
                faults = ledger.verify()
                text = "\n".join(faults) or f"{ledger.place}: {_count(len(ledger))}, all sound"
                options.print_answer(arguments, text, {"faults": faults, "trials": len(ledger)})
                return FAULTY if faults else 0
    return 0


def name_colours(summary: MemorySummary, path: Path | None) -> dict[Colour, str]:
    """Names the materials of a memory: the known material of the same colour, or else the colour itself."""
    known = {name: each.colour for name, each in load_materials(path or MATERIALS).items()}
    names = {}
    for each in summary.materials:
        nearest = find_nearest_colour(each.colour, known)
        is_known = is_same_colour(each.colour, known[nearest])
        shown = nearest.replace("_", " ")
        names[each.colour] = f"{shown} {show_colour(each.colour)}" if is_known else show_colour(each.colour)
    return names


def _read_weighings(paths: Sequence[Path], materials: Path) -> list[TrialEvidence]:
    """Reads the weighings of tools files; a file without any raises a BadValueError."""
    trials = []
    for path in paths:
        found = list(list_weighed_trials(load_tools(path, load_materials(materials)), path))
        if not found:
            raise BadValueError(path, "", "has no weighing, must have the mass (kg) of a tool or of a part")
        trials += found
    return trials


def _forget(arguments: argparse.Namespace, ledger: Ledger) -> int:
    """Removes the selected trials and returns their number; an unknown robot or object raises a BadValueError."""
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
    """Checks that the action has the files it needs, and no option that it would ignore."""
    needed = {"merge": "at least one memory", "export": "one file", "import": "at least one file"}
    needed["weigh"] = "at least one file of tools"
    files = len(arguments.files)
    if (arguments.action in needed and not files) or (arguments.action == "export" and files > 1):
        raise BadValueError(arguments.action, "", f"is given {files} files, must be given {needed[arguments.action]}")
    if arguments.action not in needed and files:
        raise BadValueError(arguments.action, "", f"is given the file {arguments.files[0]!r}, must be given none")
    if arguments.same_colour and arguments.action != "show":
        raise BadValueError("--same-colour", "", f"has no effect on {arguments.action}, must be given with show only")
    given = [name for name in ("robot", "object", "since", "until", "trial") if getattr(arguments, name)]
    if given and arguments.action != "forget":
        raise BadValueError(
            f"--{given[0]}", "", f"has no effect on {arguments.action}, must be given with forget only"
        )


def _show(arguments: argparse.Namespace, ledger: Ledger, prior: Prior) -> None:
    summary = summarise(ledger, prior, read_same_colours(arguments, {}))
    names = name_colours(summary, arguments.materials)
    content = {
        "trials": len(ledger),
        "materials": [{"name": names[each.colour], **_unfold(each)} for each in summary.materials],
        "things": [_unfold(each) for each in summary.things],
    }
    text = _describe(ledger, summary, names)
    options.give_answer(arguments, "memory", text, content, lambda: draw_memory(summary, names))


def _unfold(each: object) -> dict[str, object]:
    content: dict[str, object] = each._asdict()  # type: ignore[attr-defined]
    experience = content.pop("experience")
    assert isinstance(experience, ExperienceSummary)
    return {**content, **experience._asdict()}


def _count(number: int) -> str:
    return f"{number} trial{'' if number == 1 else 's'}"


def _describe(ledger: Ledger, summary: MemorySummary, names: Mapping[Colour, str]) -> str:
    """Formats the tables of materials and objects."""
    lines = [f"{ledger.place}: {_count(len(ledger))}"]
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
