"""Colours and elapsed time are shown on a terminal, and not in a pipe or a file."""

import io
import time

import pytest
from helpers.answers import answer

from affordance.commands import terminal
from affordance.commands.terminal import RED, ElapsedTime, QuietErrors, ShownOutput, format_error, paint

RED_MARK = "\033[31mNOT TO BE TRUSTED\033[0m"


class Screen(io.StringIO):
    """Stream that is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def colours(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")


def write(stream, text):
    ShownOutput(stream).write(text)
    return stream.getvalue()


def test_verdict_is_coloured_on_a_terminal_only():
    assert write(Screen(), "NOT TO BE TRUSTED:") == f"{RED_MARK}:"
    assert write(io.StringIO(), "NOT TO BE TRUSTED:") == "NOT TO BE TRUSTED:"


@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_colours_can_be_switched_off(monkeypatch, name, value):
    monkeypatch.setenv(name, value)
    assert write(Screen(), "NOT TO BE TRUSTED:") == "NOT TO BE TRUSTED:"


def test_text_of_a_file_cannot_colour_a_terminal():
    assert write(Screen(), "a\033[31mb NOT TO BE TRUSTED") == f"a\ufffd[31mb {RED_MARK}"


def test_json_is_not_coloured():
    assert write(Screen(), '{"doubts": "NOT TO BE TRUSTED"}') == '{"doubts": "NOT TO BE TRUSTED"}'


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("1.0 kg +- 2 g, centre of mass (1, 2, 3) +- 1 mm in tip: trusted", "32"),
        ("2 kg at (0 0 0) m in the hand is too heavy: elbow needs 9 N m of 5 N m at most.", "31"),
        ("2 kg at (0 0 0) m in the hand fits: elbow needs 2 N m of 5 N m at most.", "32"),
        ("  warning: the hand is tilted", "33"),
        ("not met Drops shrink", "31"),
        ("drake       does not work: no Drake here", "31"),
    ],
)
def test_each_verdict_has_its_colour(text, code):
    assert f"\033[{code}m" in write(Screen(), text)


def test_name_is_not_taken_for_a_verdict():
    assert write(Screen(), "Take the trusted hammer; it fits, of 3 met criteria") == (
        "Take the trusted hammer; it fits, of 3 met criteria"
    )


def test_time_is_shown_until_the_command_prints(monkeypatch):
    screen = Screen()
    monkeypatch.setattr("sys.stderr", screen)
    monkeypatch.setattr(terminal, "_PATIENCE", 0.01)
    elapsed = ElapsedTime("rank")
    time.sleep(0.1)
    assert "rank: 0 s\r" in screen.getvalue()
    ShownOutput(io.StringIO(), elapsed).write("answer")
    shown = screen.getvalue()
    assert shown.endswith("\033[K")
    time.sleep(0.05)
    assert screen.getvalue() == shown


def test_time_of_a_quick_command_is_not_shown(monkeypatch):
    screen = Screen()
    monkeypatch.setattr("sys.stderr", screen)
    ElapsedTime("memory").end()
    assert screen.getvalue() == ""


def test_nothing_is_shown_where_there_is_no_terminal(monkeypatch):
    monkeypatch.setattr(terminal, "_PATIENCE", 0.01)
    for stream in (io.StringIO(), QuietErrors(Screen())):
        monkeypatch.setattr("sys.stderr", stream)
        elapsed = ElapsedTime("rank")
        time.sleep(0.05)
        elapsed.end()
        assert stream.getvalue() == ""


def test_error_is_one_line_in_a_pipe_and_wrapped_between_words_on_a_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    problem = "experiment: is 'wieght', must be one of weight, com, reach, hammer; did you mean 'weight'?"
    assert format_error("affordance", problem, io.StringIO()) == f"affordance: {problem}"
    shown = format_error("affordance", problem, Screen())
    assert shown.startswith("\033[31maffordance:\033[0m experiment:")
    assert max(map(len, shown.replace("\033[31m", "").replace("\033[0m", "").split("\n"))) <= 40
    assert " ".join(shown.split()).endswith(problem)


@pytest.mark.parametrize(("given", "width"), [(None, 0), ("50", 50), ("many", 0)])
def test_width_of_a_pipe_is_the_one_that_is_given(monkeypatch, given, width):
    if given is not None:
        monkeypatch.setenv("COLUMNS", given)
    monkeypatch.setattr("sys.stdout", io.StringIO())
    monkeypatch.setattr("sys.__stdout__", io.StringIO())
    assert terminal.find_width() == width
    assert terminal.find_width(io.StringIO()) == 0


def test_error_is_coloured_on_a_terminal():
    assert paint("affordance:", RED, Screen()) == "\033[31maffordance:\033[0m"


def test_quiet_prints_the_answer_without_remarks():
    words = ["rank", "--demo", "--samples", 50, "--only", "machinist hammer"]
    loud, quiet = answer(*words).out, answer(*words, "--quiet").out
    assert loud.startswith("Demonstration on ")
    assert loud.endswith(f"\n\n{quiet}")
