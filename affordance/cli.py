"""Command line: ``affordance COMMAND``.

A command is a module of ``affordance.commands``, imported on demand, so that ``affordance doctor`` runs where Drake
cannot be imported. The name of an experiment stands for ``run`` with that experiment.
"""

import argparse
import contextlib
import importlib
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn, Protocol, TextIO, cast, override

from affordance.commands.study import FORMER
from affordance.drake.system_libraries import provide_libraries
from affordance.exceptions import PROSE, AffordanceError, describe_choice, show_text, show_value, suggest
from affordance.files.model_folder import import_study, list_studies
from affordance.version import __version__

# What argparse says of arguments that are missing, before their names.
_REQUIRED = "the following arguments are required: "
_NUMBERS: dict[Any, str] = {int: "a whole number", float: "a number"}
# Lines of help of the commands, here so that the help imports none; a dash in a name is an underscore in its module.
COMMANDS = {
    "run": "run the paper's simulations and other experiments; write numbers, figures and report",
    "watch": "watch an observer of an experiment live in the browser",
    "predict": "predict what each learner would do in an experiment, and which number distinguishes them best",
    "lift": "let observers lift, hold or look at objects trial by trial, as a table says",
    "fit": "fit a learner to people's lifts, person by person or pooled, by their pushes",
    "compare-learners": "say which learner predicts the lifts of each person best, one step ahead",
    "new-experiment": "write an experiment of one's own that runs, as a Python file to change",
    "guess": "say what things look like they weigh: mass, centre of mass, inertia, before any is held",
    "rank": "rank tools and the ends to hold them by for a task, from drawings or pictures, and say why",
    "next": "say what to hold next so that the choice of a tool comes out right, and when to stop",
    "new-tools": "write a commented file of tools to fill in, for rank and next",
    "settings": "list the settings that --set changes, with value, unit and source",
    "import-arm": "make a folder of models for the arm of a robot's file (URDF, SDF or MJCF)",
    "compare-robots": "compare two files of one robot, joint by joint: masses, centres, inertias, limits",
    "excite": "design a motion that shows mass, centre of mass or inertia, or what a task will cost",
    "identify": "identify what a robot held: mass, centre of mass, inertia, with intervals, from recordings",
    "memory": "show, forget, merge, export, import, weigh or verify a lasting memory of what robots have felt",
    "study": f"a study that takes its time: {', '.join(list_studies()) or 'in a clone of the repository'}",
    "tutorials": "copy the tutorials to a folder, as notebooks if jupytext is installed, and open Jupyter",
    "doctor": "say which parts work on this machine, and how to get the others",
}
# Experiments that are commands of their own.
EXPERIMENTS = ("all", "weight", "com", "reach", "hammer", "vision")
# Commands that need no library of the system.
_FREE = ("doctor",)
# What the dynamic loader says if it has no memory for a library.
_NO_MEMORY = ("failed to map segment", "annot allocate memory")
# Exit status as of a process that SIGPIPE ended.
_NO_READER = 141


class OneLineParser(argparse.ArgumentParser):
    """Argument parser whose errors are one line, without the usage in front; options must be written in full."""

    def __init__(self, *, prog: str, description: str | None = None, add_help: bool = True) -> None:
        """Declares no options yet, except ``--help``."""
        super().__init__(prog=prog, description=description, add_help=add_help, allow_abbrev=False)

    def error(self, message: str) -> NoReturn:
        """Prints an error and exits with status 2."""
        lead, _, missing = message.partition(_REQUIRED)
        if not lead and missing:
            message = self._describe_missing(missing.split(", ")[0])
        self.exit(2, f"{self.prog}: {message.removeprefix('argument ')}\n")

    def _describe_missing(self, shown: str) -> str:
        """Describes a missing argument, as argparse names it, by its help."""
        meant = (each for each in self._actions if shown in (each.metavar, each.dest, "/".join(each.option_strings)))
        return ": ".join([shown, "is missing", *(each.help for each in meant if each.help)])

    def parse(self, words: Sequence[str]) -> argparse.Namespace:
        """Parses arguments; an unknown one is reported with the nearest known one."""
        found, unknown = self.parse_known_args(words)
        if unknown:
            self.error(self._describe_unknown(*unknown[:2]))
        return found

    def _describe_unknown(self, word: str, following: str = "") -> str:
        if not word.startswith("-"):
            hint = f": {self.epilog}" if self.epilog else ""
            return f"is given {word!r}, which is one argument too many{hint}"
        name, _, value = word.partition("=")
        known = [
            option
            for action in self._actions
            if action.help is not argparse.SUPPRESS
            for option in action.option_strings
            if option.startswith("--")
        ]
        hint = suggest(name, known)
        if "--set" in known and not hint:
            hint = _describe_setting(name.removeprefix("--"), value or following)
        return f"{name}: is not an option (known: {', '.join(known)}){hint}"

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            raise argparse.ArgumentError(action, describe_choice(value, map(str, action.choices)))

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError as error:
            if action.type not in _NUMBERS:
                raise
            problem = f"is {show_value(arg_string)}, must be {_NUMBERS[action.type]}{_find_whole(arg_string)}"
            raise argparse.ArgumentError(action, problem) from error


def _find_whole(word: str) -> str:
    """Names the whole number that is nearest to one with a fraction; empty if it is no number."""
    try:
        return f"; the nearest is {round(float(word))}"
    except (ValueError, OverflowError):
        return ""


def _describe_setting(name: str, value: str) -> str:
    """Says how a setting is changed that was given as an option; empty if there is none of that name."""
    from affordance.named_settings import list_settings  # here, as other messages need not wait for it

    known = any(each.name == name for each in list_settings())
    return f"; {name} is a setting: --set {name}={value or 'VALUE'}" if known else ""


class Command(Protocol):
    """Interface of the module of a command."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Adds the command's arguments to a parser."""

    def run(self, arguments: argparse.Namespace) -> int:
        """Runs the command and returns the exit status; invalid input raises an AffordanceError of one line."""


def main(arguments: Sequence[str] | None = None, program: str = "affordance") -> int:
    """Runs a command, by default that of this process, and returns the exit status; messages begin with ``program``.

    The status is 0, 2 for invalid input, 3 if some of the work could not be done, 130 after an interruption, or 141
    if whoever reads the output has gone.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        try:
            return _run(words, program)
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()  # here, where a failure can still be answered
    except AffordanceError as error:
        problem = str(error)
    except KeyboardInterrupt:
        print(f"{program}: interrupted; the same command continues where it stopped", file=sys.stderr)
        return 130
    except MemoryError as error:
        problem = describe_memory_error(error)
    except ImportError as error:  # a library that is missing, or that the loader finds no memory for
        problem = describe_import_error(error)
    except BrokenPipeError:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), sys.stdout.fileno())  # the interpreter flushes once more at its end
        return _NO_READER
    except OSError as error:  # a full disk, a removed folder
        problem = describe_system_error(error)
    print(f"{program}: {problem}", file=sys.stderr)
    return 2


def _run(words: Sequence[str], program: str) -> int:
    """Runs the command that the words name, and returns the exit status."""
    if words and words[0] in EXPERIMENTS:
        words = ["run", *words]
    if words and words[0] in FORMER:
        words = ["study", FORMER[words[0]], *words[1:]]
    if not words or words[0] in ("-h", "--help"):
        print(_describe(program))
        return 0
    if words[0] == "--version":
        print(f"{program} {__version__}")
        return 0
    name, *words = words
    if name not in COMMANDS:
        raise AffordanceError(f"the command {describe_choice(name, (*COMMANDS, *EXPERIMENTS))}")
    handler = logging.StreamHandler()
    handler.setFormatter(ShownFormatter("%(message)s"))
    logging.basicConfig(handlers=[handler], level=logging.WARNING)
    if name not in _FREE:
        provide_libraries()
    if name == "study" and words and not words[0].startswith("-"):
        study = import_study(words[0])  # a command with its own line of help
        command: Command = study
        name, description, words = f"study {words[0]}", study.HELP, words[1:]
    else:
        command, description = load_command(name), COMMANDS[name]
    logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat announces its port
    parser = OneLineParser(prog=f"{program} {name}", description=description)
    command.add_arguments(parser)
    chosen = parser.parse(words)
    with contextlib.redirect_stdout(cast(TextIO, _ShownOutput(sys.stdout))):
        return command.run(chosen)


def describe_import_error(error: ImportError) -> str:
    """Describes a library that cannot be loaded in one line; raises the error again for a part of the program."""
    if (error.name or "").partition(".")[0] in ("affordance", "studies"):
        raise error
    if any(sign in str(error) for sign in _NO_MEMORY):
        return describe_memory_error(error)
    return f"a library cannot be loaded ({' '.join(str(error).split())}); affordance doctor says what works here"


def describe_memory_error(error: Exception) -> str:
    """Describes a lack of memory in one line."""
    found = " ".join(str(error).split())
    return f"memory ran out{f' ({found})' if found else ''}; fewer --jobs, or smaller settings and files, take less"


class ShownFormatter(logging.Formatter):
    """Formatter of log messages that replaces invisible characters."""

    @override
    def format(self, record: logging.LogRecord) -> str:
        return show_text(super().format(record), PROSE)


class _ShownOutput:
    """Standard output that replaces invisible characters, as in names of files."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        return self._stream.write(show_text(text, PROSE))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def describe_system_error(error: OSError) -> str:
    """Describes an error of the system in one line: the file, if known, and the fault."""
    parts = (error.filename, error.strerror or str(error) or type(error).__name__)
    return show_text(" ".join(": ".join(str(part) for part in parts if part).split()))


def load_command(name: str) -> Command:
    """Imports the module of a command."""
    module: object = importlib.import_module(f"affordance.commands.{name.replace('-', '_')}")
    return cast(Command, module)


def _describe(program: str) -> str:
    lines = [f"usage: {program} COMMAND ...   ({program} COMMAND --help says more)", ""]
    lines += [f"  {name:<12} {text}" for name, text in COMMANDS.items()]
    lines += [f"  {'|'.join(EXPERIMENTS)}: the same as {program} run with it", f"  {'--version':<12} the version"]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
