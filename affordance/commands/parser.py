"""Parser of a command's options, with one-line errors, grouped help and an example."""

import argparse
import sys
from collections.abc import Sequence
from typing import Any, NoReturn, override

from affordance.commands.terminal import format_error
from affordance.exceptions import describe_choice, show_value, suggest

# Titles of the option groups at the end of a help text, after positional arguments and all other options.
ROBOT, OUTPUT = "robot", "output"
_LAST: dict[str | None, int] = {ROBOT: 1, OUTPUT: 2}
# Beginning of argparse's message about missing arguments, which is followed by their names.
_REQUIRED = "the following arguments are required: "
_NUMBERS: dict[Any, str] = {int: "a whole number", float: "a number"}


def find_group(parser: argparse.ArgumentParser, title: str) -> argparse._ArgumentGroup:
    """Finds a group of options by its title. A missing group is added."""
    known = (group for group in parser._action_groups if group.title == title)
    return next(known, None) or parser.add_argument_group(title)


class OneLineParser(argparse.ArgumentParser):
    """Argument parser with one-line errors that do not repeat the usage. Options must be written in full.

    Attributes:
        hint: Advice that is shown if there are too many arguments; may be empty.
    """

    def __init__(
        self, *, prog: str, description: str | None = None, example: str = "", add_help: bool = True
    ) -> None:
        """Creates a parser that only has ``--help``. The example is the last line of the help."""
        epilog = f"example: {example}" if example else None
        super().__init__(prog=prog, description=description, epilog=epilog, add_help=add_help, allow_abbrev=False)
        self._positionals.title, self._optionals.title = "what", "how"
        self.hint = ""

    @override
    def format_help(self) -> str:
        """Formats the help. Its usage line shows only positional and required arguments."""
        formatter = self._get_formatter()
        shown = [action for action in self._actions if action.required or not action.option_strings]
        formatter.add_usage(None, shown, [], prefix="")
        self.usage = f"{formatter.format_help().strip()} [options]".replace("%", "%%")
        self._action_groups.sort(key=lambda group: _LAST.get(group.title, 0))
        return super().format_help()

    @override
    def error(self, message: str) -> NoReturn:
        """Prints an error and exits with status 2."""
        lead, _, missing = message.partition(_REQUIRED)
        if not lead and missing:
            message = self._describe_missing(missing.split(", ")[0])
        self.exit(2, f"{format_error(self.prog, message.removeprefix('argument '), sys.stderr)}\n")

    def _describe_missing(self, shown: str) -> str:
        """Describes a missing argument with its help and the example. ``shown`` is its name in argparse."""
        meant = (each for each in self._actions if shown in (each.metavar, each.dest, "/".join(each.option_strings)))
        notes = "".join(f" ({each.help})" for each in meant if each.help)
        return "; ".join([f"{shown}: is missing{notes}", *([self.epilog] if self.epilog else [])])

    def parse(self, words: Sequence[str]) -> argparse.Namespace:
        """Parses arguments. For an unknown argument, the error suggests the most similar known argument."""
        found, unknown = self.parse_known_args(words)
        if unknown:
            self.error(self._describe_unknown(*unknown[:2]))
        return found

    def _describe_unknown(self, word: str, following: str = "") -> str:
        if not word.startswith("-"):
            hint = f": {self.hint}" if self.hint else ""
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
        return f"{name}: is not an option{hint} (known: {', '.join(known)})"

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
    """Suggests the nearest whole number; empty if the word is not a number."""
    try:
        return f"; the nearest is {round(float(word))}"
    except (ValueError, OverflowError):
        return ""


def _describe_setting(name: str, value: str) -> str:
    """Explains ``--set`` if a setting is given as an option; empty if there is no setting of that name."""
    from affordance.named_settings import list_settings  # imported here, because only this message needs it

    known = any(each.name == name for each in list_settings())
    return f"; {name} is a setting: --set {name}={value or 'VALUE'}" if known else ""
