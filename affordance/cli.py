"""Command line: ``affordance COMMAND``.

Each command is a module of ``affordance.commands``. It is imported when it is called, so ``affordance doctor`` works
even if Drake cannot be imported. The name of an experiment is short for the command that runs it.
"""

import argparse
import contextlib
import locale
import logging
import os
import shutil
import sys
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TextIO, cast, override

from affordance.commands.catalogue import COMMANDS, SHORT, SUBJECTS, Command, load_command
from affordance.commands.parser import OUTPUT, OneLineParser, find_group
from affordance.commands.terminal import ElapsedTime, QuietErrors, ShownOutput, find_width, format_error
from affordance.drake.system_libraries import provide_libraries
from affordance.exceptions import PROSE, AffordanceError, show_text, show_value, suggest
from affordance.files.model_folder import import_study
from affordance.reporting.formatting import break_line
from affordance.runs.program_errors import blame_programs
from affordance.version import __version__

# Commands that need no system library.
_FREE = ("doctor",)
# Commands that can take several seconds without a progress bar, so that the elapsed time is shown.
_SHOW_TIME = ("see", "guess", "rank", "next", "compare-robots", "excite", "identify", "memory")
# Names of the encoding of the locales C and POSIX, on Linux and macOS.
_ASCII = ("ANSI_X3.4-1968", "US-ASCII")
# Messages of the dynamic loader when there is too little memory for a library.
_NO_MEMORY = ("failed to map segment", "annot allocate memory")
_SAFE_PATH = "PYTHONSAFEPATH"
# Exit status of a process that ended because its output pipe was closed (SIGPIPE).
_NO_READER = 141


def main(arguments: Sequence[str] | None = None, program: str = "affordance") -> int:
    """Runs a command and returns its exit status.

    Args:
        arguments: Words of the command line; None for the arguments of this process.
        program: Name of the program at the beginning of messages.

    Returns:
        0 after success, 2 for invalid input, 3 if part of the work failed, 130 after an interruption, 141 if the
        output pipe was closed.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        try:
            return _run(words, program)
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()  # now, while an error can still be handled
    except AffordanceError as error:
        problem = str(error)
    except KeyboardInterrupt:
        print(f"{program}: interrupted; the same command continues where it stopped", file=sys.stderr)
        return 130
    except MemoryError as error:
        problem = describe_memory_error(error)
    except ImportError as error:  # a missing library, or too little memory to load it
        problem = describe_import_error(error)
    except BrokenPipeError:
        _drop_output()
        return _NO_READER
    except OSError as error:  # a full disk, a removed folder
        _drop_output()
        problem = describe_system_error(error)
    print(format_error(program, problem, sys.stderr), file=sys.stderr)
    return 2


def _drop_output() -> None:
    """Redirects standard output to nowhere. Otherwise Python would try to flush it at exit, and fail."""
    with contextlib.suppress(OSError, ValueError, AttributeError), Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())


def _run(words: Sequence[str], program: str) -> int:
    """Runs a command, given as words, and returns the exit status."""
    if words and words[0] in SHORT:
        words = ["run", *words]
    if words[:1] == ["help"] and len(words) > 1:
        words = [*words[1:], "--help"]
    if not words or words[0] in ("-h", "--help", "help"):
        print(_describe(program))
        return 0
    if words[0] in ("--version", "-V", "version"):
        print(f"{program} {__version__}")
        return 0
    name, *words = words
    if name not in COMMANDS:
        known = (*COMMANDS, *SHORT)
        near = suggest(name, (*known, "help", "version"))
        must = f"{near} It must" if near else ", must"
        raise AffordanceError(f"the command is {show_value(name)}{must} be one of {', '.join(known)}")
    handler = logging.StreamHandler()
    handler.setFormatter(ShownFormatter("%(message)s"))
    logging.basicConfig(handlers=[handler], level=logging.WARNING)
    if name not in _FREE:
        if (encoding := locale.getpreferredencoding(False)) in _ASCII:
            problem = "with which Drake cannot be loaded; set PYTHONUTF8=1, or a locale such as LANG=C.UTF-8"
            raise AffordanceError(f"the locale's encoding is {encoding}, {problem}")
        provide_libraries()
    if name == "study" and words and not words[0].startswith("-"):
        study = import_study(words[0])  # a command with its own help
        command: Command = study
        name, description, words = f"study {words[0]}", study.HELP, words[1:]
    else:
        command, description = load_command(name), COMMANDS[name].help
    example = f"affordance {name} {COMMANDS[name].example if name in COMMANDS else ''}".strip()
    parser = OneLineParser(prog=f"{program} {name}", description=description, example=example)
    command.add_arguments(parser)
    what = "print only the answer: no progress, no remarks"
    find_group(parser, OUTPUT).add_argument("-q", "--quiet", action="store_true", help=what)
    chosen = parser.parse(words)
    run = command.run  # imports the command's module and Drake, which resets its log level
    logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat announces its port
    with contextlib.ExitStack() as stack:
        if chosen.quiet:
            stack.enter_context(contextlib.redirect_stderr(cast(TextIO, QuietErrors(sys.stderr))))
        elapsed = ElapsedTime(name) if name in _SHOW_TIME else None
        output = ShownOutput(sys.stdout, elapsed)
        if elapsed is not None:
            stack.callback(elapsed.end)
        stack.enter_context(contextlib.redirect_stdout(cast(TextIO, output)))
        stack.enter_context(blame_programs(_list_programs(chosen)))
        stack.enter_context(_ignore_working_folder())
        return run(chosen)


@contextlib.contextmanager
def _ignore_working_folder() -> Iterator[None]:
    """Prevents child processes from importing modules in the working folder, as the console script does."""
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before


def _list_programs(chosen: argparse.Namespace) -> list[Path]:
    """Lists the files with user-written learners that the options name."""
    given = getattr(chosen, "learner", None) or []
    words = [given] if isinstance(given, str) else given
    return [Path(word.rpartition(":")[0]) for word in words if ".py:" in str(word)]


def describe_import_error(error: ImportError) -> str:
    """Describes in one line why a library cannot be imported. Errors in the program's modules are raised again."""
    if (error.name or "").partition(".")[0] in ("affordance", "studies"):
        raise error
    if any(sign in str(error) for sign in _NO_MEMORY):
        return describe_memory_error(error)
    return f"a library cannot be loaded ({' '.join(str(error).split())}); affordance doctor says what works here"


def describe_memory_error(error: Exception) -> str:
    """Describes in one line that the memory is exhausted."""
    found = " ".join(str(error).split())
    return f"memory ran out{f' ({found})' if found else ''}; fewer --jobs, or smaller settings and files, take less"


class ShownFormatter(logging.Formatter):
    """Formats log messages. Invisible characters are replaced, and lines are wrapped to the terminal's width."""

    @override
    def format(self, record: logging.LogRecord) -> str:
        lines, width = show_text(super().format(record), PROSE).split("\n"), find_width(sys.stderr)
        return "\n".join(part for line in lines for part in break_line(line, width))


def describe_system_error(error: OSError) -> str:
    """Describes a system error in one line, with the file's name if it is known."""
    parts = (error.filename, error.strerror or str(error) or type(error).__name__)
    return show_text(" ".join(": ".join(str(part) for part in parts if part).split()))


def _describe(program: str) -> str:
    """Lists all commands by subject, wrapped to the width of the terminal."""
    lines = [f"usage: {program} COMMAND [options]", f"help:  {program} COMMAND --help"]
    experiments = ", ".join(SHORT)
    indent = " " * (3 + max(map(len, COMMANDS)))
    width = shutil.get_terminal_size().columns
    for subject, commands in SUBJECTS.items():
        lines += ["", f"{subject}:"]
        for name, entry in commands.items():
            lines += textwrap.wrap(
                entry.help, width, initial_indent=f"  {name}".ljust(len(indent)), subsequent_indent=indent
            )
    short = f"{program} EXPERIMENT is short for {program} run EXPERIMENT; EXPERIMENT is {experiments}."
    lines += ["", *textwrap.wrap(short, width), f"{program} --version prints the version."]
    lines += ["", f"example: {program} run weight --repeats 10"]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
