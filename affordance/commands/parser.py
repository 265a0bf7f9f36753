"""Parser of the command line, whose one-line errors name option, value and the nearest valid value."""

import argparse
import difflib
from collections.abc import Sequence
from typing import Any, NoReturn

from affordance.exceptions import describe_choice, show_value

_NUMBERS: dict[Any, str] = {int: "a whole number", float: "a number"}


class OneLineParser(argparse.ArgumentParser):
    """Argument parser whose errors are one line, without the usage in front."""

    def error(self, message: str) -> NoReturn:
        """Prints an error and exits with status 2."""
        self.exit(2, f"{self.prog}: {message.removeprefix('argument ')}\n")

    def parse(self, words: Sequence[str]) -> argparse.Namespace:
        """Parses arguments; an unknown one is reported with the nearest known one."""
        found, unknown = self.parse_known_args(words)
        if unknown:
            self.error(self._describe_unknown(unknown[0]))
        return found

    def _describe_unknown(self, word: str) -> str:
        if not word.startswith("-"):
            return f"is given {word!r}, which is one argument too many"
        name = word.partition("=")[0]
        known = [
            option
            for action in self._actions
            if action.help is not argparse.SUPPRESS
            for option in action.option_strings
            if option.startswith("--")
        ]
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        return f"{name}: is no option (known: {', '.join(known)}){hint}"

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            raise argparse.ArgumentError(action, describe_choice(value, map(str, action.choices)))

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError as error:
            if action.type not in _NUMBERS:
                raise
            problem = f"is {show_value(arg_string)}, must be {_NUMBERS[action.type]}"
            raise argparse.ArgumentError(action, problem) from error
