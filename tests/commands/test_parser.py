"""Errors of the command line: one line that names option, value, bound and the nearest that fits."""

import argparse
import os
import shlex
import sys
from pathlib import Path

import pytest
from helpers.answers import answer

from affordance.choice.demand import Criterion
from affordance.commands.arguments import add_repeats
from affordance.commands.catalogue import COMMANDS, load_command
from affordance.commands.options import check_bounds
from affordance.commands.parser import OneLineParser
from affordance.extensions.payload.excitation.expectation import Aim
from affordance.extensions.people.experiments.prediction import POWER
from affordance.extensions.robots.importer import AXES
from affordance.files.model_folder import import_study


@pytest.fixture
def parser():
    parser = OneLineParser(prog="prog")
    parser.add_argument("task", choices=["reach", "hammer"])
    add_repeats(parser, 5, "observers")
    parser.add_argument("--mass", type=float)
    parser.add_argument("--vision", choices=["features", "pixels"])
    return parser


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["hamer"], "prog: task: is 'hamer', must be one of reach, hammer; did you mean 'hammer'?"),
        (["reach", "--vision", "pixel"], "prog: --vision: is 'pixel', must be one of features, pixels; did you mean"),
        (
            ["reach", "--repeets", "3"],
            "prog: --repeets: is not an option; did you mean '--repeats'? (known: --help, --repeats, --mass, ",
        ),
        (["reach", "--repeets=3"], "prog: --repeets: is not an option"),
        (["reach", "--zzz"], "prog: --zzz: is not an option (known: --help, --repeats, --mass, --vision)"),
        (["reach", "--repeat", "3"], "prog: --repeat: is not an option; did you mean '--repeats'?"),
        (["reach", "--mas=3"], "prog: --mas: is not an option"),
        (["reach", "--observer", "3"], "prog: --observer: is not an option"),
        (["reach", "--repeats", "many"], "prog: --repeats: is 'many', must be a whole number"),
        (["reach", "--mass", "x"], "prog: --mass: is 'x', must be a number"),
        (["reach", "far"], "prog: is given 'far', which is one argument too many"),
        ([], "prog: task: is missing"),
    ],
)
def test_errors_are_one_line(parser, words, message, capsys):
    with pytest.raises(SystemExit) as caught:
        parser.parse(words)
    assert caught.value.code == 2
    err = capsys.readouterr().err
    assert err.startswith(message)
    assert err.count("\n") == 1


def test_shared_numbers_may_be_at_their_bounds():
    check_bounds(argparse.Namespace(repeats=1, seed=2**32 - 1))


def test_help_imports_nothing_that_takes_long(children):
    """Help imports no library that takes long, with which it took three seconds."""
    program = "import sys; from affordance.cli import main; main(['--help']); print('imported', *sys.modules)"
    out, _ = children([sys.executable, "-c", program]).communicate()
    text, _, modules = out.partition("imported ")
    assert "  identify         identify a payload from recordings" in text
    assert not {"matplotlib", "numpy", "pydantic", "pydrake", "scipy"} & set(modules.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_imports_no_library_that_takes_long(children, name):
    """With what the command works with, its help took two seconds."""
    program = f"""
import sys
from affordance.cli import main
try:
    main([{name!r}, "--help"])
except SystemExit:
    print("imported", *sys.modules)
"""
    out, _ = children([sys.executable, "-c", program]).communicate()
    text, _, modules = out.partition("imported ")
    assert text.startswith(f"usage: affordance {name}")
    slow = {
        "cv2",
        "jinja2",
        "joblib",
        "matplotlib",
        "numpy",
        "pandas",
        "pydantic",
        "pydrake",
        "scipy",
        "trimesh",
        "xarray",
    }
    assert not slow & set(modules.split())


def test_arguments_offer_what_the_program_can_do():
    """Arguments are declared apart from what the commands do, so they repeat names and defaults."""
    offered = {
        (name, action.dest): action
        for name in ("rank", "next", "excite", "predict")
        for action in build_parser(name)._actions
    }
    criteria = [each.value for each in Criterion]
    assert [*offered["rank", "by"].choices] == [*offered["next", "by"].choices] == criteria
    assert [*offered["excite", "aim"].choices] == [each.value for each in Aim]
    assert offered["predict", "power"].default == POWER
    assert ", ".join(AXES) in next(
        each.help for each in build_parser("import-arm")._actions if each.dest == "out_axis"
    )


def build_parser(name):
    parser = OneLineParser(prog=name)
    load_command(name).add_arguments(parser)
    return parser


@pytest.mark.parametrize("name", COMMANDS)
def test_example_of_a_command_is_one_that_it_takes(name):
    parser, words = OneLineParser(prog=name), shlex.split(COMMANDS[name].example)
    command = import_study(words.pop()) if name == "study" else load_command(name)
    command.add_arguments(parser)
    parser.parse(words)


def test_help_has_groups_and_ends_with_an_example(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    lines = answer("import-arm", "--help").lines
    assert lines[0] == "usage: affordance import-arm --out DIR file [NAME:=VALUE ...] [options]"
    assert [line for line in lines if line.endswith(":") and not line.startswith(" ")] == [
        "what:",
        "how:",
        "robot:",
        "output:",
    ]
    assert lines[-1] == "example: affordance import-arm robot.urdf --out my_arm"


@pytest.mark.parametrize("width", [60, 80])
def test_list_of_commands_fits_the_terminal(monkeypatch, width):
    monkeypatch.setenv("COLUMNS", str(width))
    lines = answer("--help").lines
    assert max(map(len, lines)) <= width
    assert all(any(line.startswith(f"  {name} ") for line in lines) for name in COMMANDS)


@pytest.mark.parametrize("words", [["--help"], ["study"]])
def test_reader_that_goes_ends_a_command_quietly(children, words):
    read, write = os.pipe()
    os.close(read)
    child = children([sys.executable, "-m", "affordance", *words], stdout=write)
    os.close(write)
    _, err = child.communicate()
    assert (child.returncode, err) == (141, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_output_that_cannot_be_written_is_one_line(children):
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        # Unbuffered output would fail only once; the interpreter flushes buffered output again when it exits.
        buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
        child = children([sys.executable, "-m", "affordance", "--help"], stdout=full, env=buffered)
        _, err = child.communicate()
    assert (child.returncode, err) == (2, "affordance: No space left on device\n")
