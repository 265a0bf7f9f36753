"""``affordance memory``: shows, forgets, merges, exports, imports, weighs and verifies what robots have felt."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

from affordance.belief.density_belief import Prior
from affordance.commands import options
from affordance.exceptions import BadValueError, describe_choice
from affordance.memory.exchange import export_trials, read_trials
from affordance.memory.ledger import Ledger, open_memory
from affordance.memory.stored_trials import Selection
from affordance.memory.summary import ExperienceSummary, MemorySummary, summarise
from affordance.memory.trial_evidence import TrialEvidence
from affordance.memory.weighed_trial import list_weighed_trials
from affordance.objects.colour import Colour, find_nearest_colour, is_same_colour, show_colour
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials
from affordance.reporting.formatting import tabulate
from affordance.reporting.memory_figure import draw_memory

# Exit status if verifying found faults.
FAULTY = 3
ACTIONS = ("show", "forget", "merge", "export", "import", "weigh", "verify")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("action", choices=ACTIONS, help="what to do; forget needs one of the options that select trials")
    add("memory", metavar="MEMORY", help="SQLite file")
    add(
        "files",
        nargs="*",
        metavar="FILE",
        help="memories to merge, file to export to, files to import, or tools weighed",
    )
    add("--robot", default="", metavar="NAME", help="trials of this robot")
    add("--object", default="", metavar="NAME", help="trials with objects of this name")
    add(
        "--since", default="", metavar="TIME", help="trials from this time on, as 2026-03-01 or 2026-03-01T12:00, UTC"
    )
    add("--until", default="", metavar="TIME", help="trials before this time")
    add("--trial", default="", metavar="ID", help="the trial whose id begins so, four digits at least")
    options.add_same_colours(parser)
    add("--materials", type=Path, metavar="FILE", help="materials whose names are shown (default: ours)")
    options.add_answer(parser, "the picture and the table of show")
    options.add_prior_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Does what is asked; returns the exit status, FAULTY if verifying found faults."""
    prior = options.read_prior(arguments, "a memory")
    _check_arguments(arguments)
    trials: list[TrialEvidence] = []  # read first, so that nothing is made if one is wrong
    if arguments.action == "import":
        trials = [trial for file in arguments.files for trial in read_trials(Path(file), prior)]
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
                print(f"{ledger.place}: {_count(_forget(arguments, ledger))} forgotten, {len(ledger)} remain")
            case "merge" | "import" | "weigh":
                new, replaced = ledger.add(trials)
                earlier = f", {replaced} replaced by an earlier record" if replaced else ""
                print(f"{ledger.place}: {new} of {_count(len(trials))} new{earlier}, {len(ledger)} in all")
            case "export":
                path = Path(arguments.files[0])
                print(f"{path}: {_count(export_trials(ledger, path))} written")
            case "verify":
                faults = ledger.verify()
                print("\n".join(faults) or f"{ledger.place}: {_count(len(ledger))}, all sound")
                return FAULTY if faults else 0
    return 0


def name_colours(summary: MemorySummary, path: Path | None) -> dict[Colour, str]:
    """Names the materials of a memory: by the known material of the same colour, else by the colour itself."""
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
            raise BadValueError(path, "", "has no weighing, must have mass (kg) of a tool or of a part")
        trials += found
    return trials


def _forget(arguments: argparse.Namespace, ledger: Ledger) -> int:
    """Forgets the selected trials, and returns their number; an unknown robot or object raises a BadValueError."""
    selection = Selection(arguments.robot, arguments.object, arguments.since, arguments.until, arguments.trial)
    if not any(selection):
        raise BadValueError("forget", "", "must be told what: --robot, --object, --since, --until or --trial")
    number = ledger.forget(selection)
    robots, objects = ([], []) if number else ledger.list_names()
    for option, name, known in (("--robot", arguments.robot, robots), ("--object", arguments.object, objects)):
        if known and name and name not in known:
            raise BadValueError(option, "", describe_choice(name, known))
    return number


def _check_arguments(arguments: argparse.Namespace) -> None:
    """Checks that the action has its files, and no option that it ignores."""
    needed = {"merge": "at least one memory", "export": "one file", "import": "at least one file"}
    needed["weigh"] = "at least one file of tools"
    files = len(arguments.files)
    if (arguments.action in needed and not files) or (arguments.action == "export" and files > 1):
        raise BadValueError(arguments.action, "", f"is given {files} files, must be {needed[arguments.action]}")
    if arguments.action not in needed and files:
        raise BadValueError(arguments.action, "", f"is given the file {arguments.files[0]!r}, must be none")
    if arguments.same_colour and arguments.action != "show":
        raise BadValueError("--same-colour", "", f"changes nothing in {arguments.action}, only show takes it")
    given = [name for name in ("robot", "object", "since", "until", "trial") if getattr(arguments, name)]
    if given and arguments.action != "forget":
        raise BadValueError(f"--{given[0]}", "", f"selects nothing in {arguments.action}, only forget takes it")


def _show(arguments: argparse.Namespace, ledger: Ledger, prior: Prior) -> None:
    summary = summarise(ledger, prior, options.read_same_colours(arguments, {}))
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
    """Writes the tables of materials and things."""
    lines = [f"{ledger.place}: {_count(len(ledger))}"]
    width = max((len(name) for name in (*names.values(), *(thing.name for thing in summary.things))), default=0)
    rows = [
        [f"{'material':<{width}}", f"{'kg/m^3':>7}", f"{'90 % interval':>15}", "trials", "things", "since", "robots"]
    ]
    for each in summary.materials:
        low, high = each.interval90
        felt = each.experience
        name, interval = f"{names[each.colour]:<{width}}", f"{low:6.0f} to {high:5.0f}"
        numbers = [f"{each.median:.0f}", interval, str(felt.trials), str(len(each.things))]
        rows.append([name, *numbers, felt.since[:10], ", ".join(felt.robots)])
    lines += ["", *tabulate(rows, right=range(1, 5))] if summary.materials else []
    rows = [[f"{'thing':<{width}}", f"{'kg':>7}", f"{'SD':>7}", "trials", "since", "robots"]]
    for thing in summary.things:
        felt = thing.experience
        numbers = [f"{thing.mass:.3f}", f"{thing.mass_sd:.3f}", str(felt.trials)]
        rows.append([f"{thing.name:<{width}}", *numbers, felt.since[:10], ", ".join(felt.robots)])
    lines += ["", *tabulate(rows, right=range(1, 4))] if summary.things else []
    return "\n".join([*lines, *([] if summary.materials else ["It knows nothing yet."])])
