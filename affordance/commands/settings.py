"""``affordance settings``: lists every setting with its value, unit and source."""

import argparse
import textwrap
from typing import Any

from affordance.commands.options import add_json, add_learner, add_set, change_by_name, print_answer
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError, describe_choice
from affordance.named_settings import NamedSetting, list_settings, list_usual, show_setting

# Width of lines unless the terminal is narrower, [characters].
_WIDTH = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("names", nargs="*", metavar="NAME", help="settings, or groups of settings (default: all)")
    add_set(parser)
    add_learner(parser)
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Prints the selected settings."""
    settings = change_by_name(arguments)
    default = {each.name: each.value for each in list_usual(settings)}
    found = list_settings(settings)
    known = [each.name for each in found]
    groups = list(dict.fromkeys(name.partition(".")[0] for name in known))
    for name in arguments.names:
        if name not in known and name not in groups:
            raise BadValueError("settings", "", describe_choice(name, groups))
    chosen = [each for each in found if not arguments.names or _is_among(each.name, arguments.names)]
    width = min(_WIDTH, find_width() or _WIDTH)
    lines, content = list[str](), dict[str, Any]()
    for each in chosen:
        source = "--set" if default.get(each.name, ...) != each.value else each.source
        lines += describe(each, source, width)
        shown = show_setting(each.value)
        value = each.value if isinstance(each.value, bool | int | float | str | tuple) else shown
        content[each.name] = {"value": value, "unit": each.unit, "meaning": each.meaning, "source": source}
    print_answer(arguments, "\n".join(lines), content)
    return 0


def describe(setting: NamedSetting, source: str, width: int) -> list[str]:
    """Formats a setting: name, value and unit, then meaning and source."""
    unit = f" {setting.unit}" if setting.unit not in ("", "1") and setting.value is not None else ""
    text = f"{setting.meaning} Source: {source}." if setting.meaning else f"Source: {source}."
    indent = " " * 4
    lines = textwrap.wrap(
        text, width, initial_indent=indent, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
    return [f"{setting.name} = {show_setting(setting.value) or repr('')}{unit}", *lines]


def _is_among(name: str, chosen: list[str]) -> bool:
    return any(name == each or name.startswith(f"{each}.") for each in chosen)
