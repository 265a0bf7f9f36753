"""``affordance completion SHELL``: prints a script with which a shell completes commands and options."""

import argparse
import shlex
from collections.abc import Iterator
from typing import NamedTuple

from affordance.belief.learners import LEARNERS, RIVALS
from affordance.commands.catalogue import COMMANDS, EXPERIMENTS, load_command
from affordance.commands.parser import OneLineParser
from affordance.experiments.suite import NAMES
from affordance.files.model_folder import list_studies

# Completions of positional arguments; for all other commands the shell completes file names.
_WORDS = {"run": ("all", *NAMES), "predict": NAMES, "watch": NAMES, "study": tuple(list_studies())}
# Words after an option that also takes others, such as a file of one's own.
_VALUES = {"--learner": (*LEARNERS, *RIVALS)}
_BASH = """\
_affordance() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} command=${{COMP_WORDS[1]}} before=${{COMP_WORDS[COMP_CWORD-1]}} words=
    if [ "$COMP_CWORD" -eq 1 ]; then
        words={commands}
    else
        case "$command $before" in
{choices}
        *) case "$command" in
{options}
        esac ;;
        esac
    fi
    COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _affordance affordance
"""


class _Option(NamedTuple):
    """Option of a command: its names, its help and its allowed values."""

    names: tuple[str, ...]
    help: str
    choices: tuple[str, ...]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    what = 'your shell; save the script in its folder of completions, or run: eval "$(affordance completion bash)"'
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help=what)


def run(arguments: argparse.Namespace) -> int:
    """Prints the script."""
    options = {name: list(_list_options(name)) for name in COMMANDS}
    if arguments.shell == "fish":
        print("\n".join(_write_fish(options)))
    else:
        is_zsh = arguments.shell == "zsh"  # zsh can read bash's completion scripts
        print(
            "autoload -U +X compinit bashcompinit && compinit && bashcompinit\n" * is_zsh + _write_bash(options),
            end="",
        )
    return 0


def _list_options(name: str) -> Iterator[_Option]:
    """Lists the options of a command; an entry without names is a positional argument."""
    parser = OneLineParser(prog=name)
    load_command(name).add_arguments(parser)
    yield _Option((), "", _WORDS.get(name, ()))
    yield _Option(("-q", "--quiet"), "print only the answer", ())
    for action in parser._actions:
        if action.help is not argparse.SUPPRESS:
            names = tuple(action.option_strings)
            words = action.choices or next((_VALUES[each] for each in names if each in _VALUES), ())
            yield _Option(names, action.help or "", tuple(map(str, words)))


def _write_bash(options: dict[str, list[_Option]]) -> str:
    """Writes the script for bash."""
    choices, cases = [], []
    for name, known in options.items():
        words = [word for each in known for word in (each.names or each.choices)]
        commands = (name, *EXPERIMENTS) if name == "run" else (name,)
        cases.append(f"        {'|'.join(commands)}) words={shlex.quote(' '.join(words))} ;;")
        for each in known:
            if each.names and each.choices:
                places = "|".join(f'"{command} {option}"' for command in commands for option in each.names)
                choices.append(f"        {places}) words={shlex.quote(' '.join(each.choices))} ;;")
    first = shlex.quote(" ".join([*COMMANDS, *EXPERIMENTS, "--help", "--version"]))
    return _BASH.format(commands=first, choices="\n".join(choices), options="\n".join(cases))


def _write_fish(options: dict[str, list[_Option]]) -> Iterator[str]:
    """Writes the lines of the script for fish."""
    for name, text in COMMANDS.items():
        yield f"complete -c affordance -n __fish_use_subcommand -a {name} -d {shlex.quote(text)}"
    for name, known in options.items():
        start = f"complete -c affordance -n '__fish_seen_subcommand_from {name}'"
        for each in known:
            names = [f"-l {each[2:]}" if each.startswith("--") else f"-s {each[1:]}" for each in each.names]
            words = [f"-a {shlex.quote(' '.join(each.choices))}"] if each.choices else []
            if names or words:
                takes_files = any(option in _VALUES for option in each.names)
                exclusive = ["-r" if takes_files else "-x"] if each.choices and names else []
                yield " ".join([start, *names, *exclusive, *words, f"-d {shlex.quote(each.help)}"])
