"""The command line: ``affordance COMMAND``.

A command is a module of ``affordance.commands``, imported when it is asked for, so that ``affordance doctor`` runs
where Drake cannot be imported. The name of an experiment stands for ``run`` with that experiment.
"""

import argparse
import importlib
import logging
import sys
from collections.abc import Sequence
from typing import Protocol, cast

from affordance.commands.parser import OneLineParser
from affordance.commands.study import STUDIES
from affordance.exceptions import AffordanceError, BadValueError, describe_choice
from affordance.files.clone import import_study
from affordance.system_libraries import provide_libraries
from affordance.version import __version__

# Commands in the order of the help; a dash of a name is an underscore of its module.
COMMANDS = (
    "run",
    "new-protocol",
    "predict",
    "rank",
    "settings",
    "import-arm",
    "identify",
    "study",
    "doctor",
)
# Experiments that are commands of their own.
EXPERIMENTS = ("all", "weight", "com", "reach", "hammer", "vision")
# Needs no library of the system.
_FREE = ("doctor",)


class Command(Protocol):
    """What the module of a command offers."""

    HELP: str

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Adds its arguments to its parser."""

    def run(self, arguments: argparse.Namespace) -> int:
        """Does what is asked; returns the exit status.

        Raises:
            AffordanceError: The input is wrong; the message is one line.
        """


def main(arguments: Sequence[str] | None = None, program: str = "affordance") -> int:
    """Runs a command; returns the exit status.

    It is 0, 2 for wrong input, 3 where some of what was asked for could not be done, or 130 for an interruption.

    Args:
        arguments: Those of the command line; of this process if None.
        program: What messages begin with.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words and words[0] in EXPERIMENTS:
        words = ["run", *words]
    if words and words[0] in STUDIES:  # robustness and fit-kappa were commands of their own
        words = ["study", *words]
    if not words or words[0] in ("-h", "--help"):
        print(_describe(program))
        return 0
    if words[0] == "--version":
        print(f"{program} {__version__}")
        return 0
    name = words[0]
    if name not in COMMANDS:
        print(f"{program}: the command {describe_choice(name, (*COMMANDS, *EXPERIMENTS, *STUDIES))}", file=sys.stderr)
        return 2
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    try:
        if name not in _FREE:
            provide_libraries()
        words = words[1:]
        if name == "study" and words and not words[0].startswith("-"):
            command, name, words = load_study(words[0]), f"study {words[0]}", words[1:]
        else:
            command = load_command(name)
        logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat announces its port
        parser = OneLineParser(prog=f"{program} {name}", description=command.HELP)
        command.add_arguments(parser)
        return command.run(parser.parse(words))
    except AffordanceError as error:
        print(f"{program}: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"{program}: interrupted; the same command goes on where it was", file=sys.stderr)
        return 130
    except OSError as error:  # a full disk, a folder that was taken away
        print(f"{program}: {describe_system_error(error)}", file=sys.stderr)
        return 2


def describe_system_error(error: OSError) -> str:
    """Names the file, if the system says which, and what is wrong with it, in a line."""
    parts = (error.filename, error.strerror or str(error) or type(error).__name__)
    return " ".join(": ".join(str(part) for part in parts if part).split())


def load_study(name: str) -> Command:
    """Imports the command of a study.

    Raises:
        BadValueError: There is no such study.
        UnavailableError: The package does not lie in a clone.
    """
    if name not in STUDIES:
        raise BadValueError("study", "", describe_choice(name, STUDIES))
    return cast(Command, import_study(STUDIES[name]))


def load_command(name: str) -> Command:
    """Imports the module of a command."""
    module: object = importlib.import_module(f"affordance.commands.{name.replace('-', '_')}")
    return cast(Command, module)


def _describe(program: str) -> str:
    lines = [f"usage: {program} COMMAND ...   ({program} COMMAND --help says more)", ""]
    lines += [f"  {name:<12} {load_help(name)}" for name in COMMANDS]
    lines += [f"  {'|'.join(EXPERIMENTS)}: the same as {program} run with it", f"  {'--version':<12} the version"]
    return "\n".join(lines)


def load_help(name: str) -> str:
    """The line of help of a command; without what is missing where it cannot be imported."""
    try:
        return load_command(name).HELP
    except ImportError as error:
        return f"(cannot be imported: {error})"


if __name__ == "__main__":
    sys.exit(main())
