"""Mistakes in a user's program are named by the line of its file, wherever they surface."""

import runpy

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.exceptions import AffordanceError, BadValueError
from affordance.runs.program_errors import blame_program


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text("def divide(x):\n    return 1 / x\n\n\ndef call(f):\n    return f()\n", encoding="utf-8")
    return path, runpy.run_path(str(path))


def run(path, function, *arguments):
    with blame_program(path):
        return function(*arguments)


def test_innermost_line_of_the_file_is_named(program):
    path, names = program
    said = refuse(run, path, names["call"], lambda: names["divide"](0))
    assert said == f"{path}: line 2, in divide: ZeroDivisionError: division by zero"


def test_library_that_the_file_calls_wrongly_is_named_by_the_line_of_the_call(program):
    path, names = program
    said = refuse(run, path, names["call"], lambda: np.zeros(2) + np.zeros(3))
    assert said.startswith(f"{path}: line 6, in call: ValueError: operands could not be broadcast")


def test_mistake_outside_of_the_file_is_named_with_its_place(program):
    path, _ = program
    said = refuse(run, path, np.polyfit, [1.0], [1.0, 2.0], 1)
    assert said.startswith(f"{path}: TypeError: ")
    assert "_polynomial" in said


def test_text_of_another_process_is_read(program):
    path, _ = program

    def fail():
        text = f'Traceback:\n  File "{path}", line 6, in call\n  File "{path}", line 2, in divide\n'
        raise KeyError("x") from RuntimeError(text)

    assert refuse(run, path, fail) == f"{path}: line 2, in divide: KeyError: 'x'"


@pytest.mark.parametrize("error", [BadValueError("file.yaml", "key", "is 3"), MemoryError("no")])
def test_refusals_and_lack_of_memory_are_left_as_they_are(program, error):
    def fail():
        raise error

    with pytest.raises((AffordanceError, MemoryError)) as caught, blame_program(program[0]):
        fail()
    assert caught.value is error
